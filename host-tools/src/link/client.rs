//! The host's side of a session about a terrain, without I/O and without a clock.

use std::ops::Deref;
use std::time::Duration;

use hapterra_core::guard::Report;
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::{HipCommand, Scene, SceneChange, TickRecord};
use hapterra_core::terrain::TileKey;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME};
use hapterra_core::wire::hello::DeviceHello;
use hapterra_core::wire::materials::MaterialTile;
use hapterra_core::wire::message::{TileMessage, ToDevice, ToHost};
use hapterra_core::wire::request::{Refusal, Request};
use hapterra_core::wire::session::{LastSession, SessionNumber};
use hapterra_core::wire::status::Status;

use super::error::LinkError;
use super::host_protocol::{HostProtocol, ProtocolEvent, State};
use super::host_request::HostRequest;
use super::link_stats::LinkStats;
use super::messages::{FromDevice, from_device, next_frame};
use super::prefetch::{self, Prefetch};
use super::timeouts::Timeouts;
use crate::materials::{MaterialBuffer, Materials};
use crate::terrain::{Terrain, TileBuffer};

/// A message from the device, for the user of the session.
#[derive(Debug)]
pub enum Event<'e> {
    /// The scene is in force.
    Opened {
        /// The device's introduction.
        device: &'e DeviceHello,
        /// True if the device still had the scene and continues with it.
        resumed: bool,
    },
    /// The sample of one tick, in a scene whose HIP position is computed from the encoders.
    Sample(&'e TickRecord),
    /// The sample at one point of a replay.
    Rendered {
        /// The number that the host gave to the point.
        seq: u32,
        /// HIP, proxy, force and state at the point.
        sample: &'e TickRecord,
    },
    /// State of the device's guard; sent at the beginning of a session, at each change, and twice a
    /// second.
    Guard(&'e Report),
    /// A scene change ([`Client::put_view`]) is in force, or failed: the device refused it, did not
    /// answer, or was restarted meanwhile.
    SceneChangeResult {
        /// The scene change.
        view: &'e SceneChange,
        /// True if it is in force.
        accepted: bool,
    },
    /// The latest scene change was cancelled ([`Request::CancelChange`]): the scene before it stays
    /// in force.
    ChangeCancelled,
    /// The answer to a status query.
    Status(&'e Status),
    /// The calibration in force.
    Calibration(Option<&'e Calibration>),
    /// Result of a request.
    Answered {
        /// The request.
        request: &'e Request,
        /// Success, or the reason for the refusal.
        result: Result<(), Refusal>,
    },
    /// The device marked a tick, as [`Request::Mark`] requested.
    Marked {
        /// The tick ([`TickRecord::tick`]).
        tick: u32,
    },
    /// A tile of the scene's level was sent to the device, which may lose it and request it again.
    TileSent(TileKey),
    /// A request was given up: the device did not answer it, or was restarted meanwhile. The device
    /// may have executed it.
    Unanswered(&'e HostRequest),
}

/// Arming of the device in a session, as soon as the scene is in force. After a lost device
/// returns, it is armed again automatically only if the arm is virtual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Arming {
    /// Encoder readings in the zero pose, if the host has them.
    pub zero: Option<[i32; 3]>,
}

impl Arming {
    /// For a virtual Phantom, which was switched on in its zero pose.
    pub const VIRTUAL: Self = Self { zero: Some([0; 3]) };
}

/// Samples after which the host sends a sign of life: half a second of a device whose time runs
/// faster than the host's.
const HEARTBEAT_SAMPLES: u32 = 500;
/// Max bytes sent for each reception; the last tile may exceed them. A device has at most four
/// requests pending, of 4.5 KiB each, and repeats requests that were not answered.
const MAX_BYTES_AT_ONCE: usize = 32 * 1024;
/// Max tiles withheld, or sent for one reception.
const MAX_WITHHELD: usize = 16;
/// Time for which the client waits for a tile from another source and sends it on arrival: after
/// that, a device repeats its request if it still needs the tile ([`hapterra_core::terrain`]).
const AWAIT_TIMEOUT: Duration = Duration::from_secs(1);
/// Max tiles awaited at once.
const MAX_AWAITED: usize = 64;
/// Time between two log lines about requests for tiles that do not exist.
const LOG_INTERVAL: Duration = Duration::from_secs(1);

/// Serves one terrain to one device. [`Client::receive`] processes bytes from the device; it and
/// [`Client::append_due`], which must be called regularly, append bytes for the device. `now` is the time
/// since any fixed moment.
pub struct Client<'t> {
    terrain: ServedTerrain<'t>,
    /// The terrain of a scene change that is not in force yet.
    next: Option<(SceneChange, Terrain<'t>)>,
    /// The scene before a change in contact, and its terrain, until the change is rendered or the
    /// next one is sent.
    before: Option<(Scene, ServedTerrain<'t>)>,
    scene: Scene,
    arming: Option<Arming>,
    protocol: HostProtocol,
    reader: Box<FrameReader<MAX_FRAME>>,
    tile: TileBuffer,
    materials: MaterialBuffer,
    /// The device of the present session.
    device: Option<DeviceHello>,
    /// True until the device accepts the scene in this session.
    is_new: bool,
    /// True if the scene was accepted in some session, and the device was requested to arm.
    has_armed: bool,
    /// Tiles that are sent once the device has its zero: the work before the first tick must not
    /// depend on the duration of a message.
    withheld: Vec<TileKey>,
    /// Tiles sent for the present reception.
    sent: Vec<TileKey>,
    /// Tiles whose heights have not arrived yet from another source, and the time of their request.
    awaited: Vec<(TileKey, Duration)>,
    /// Tiles ahead of the HIP.
    prefetch: Prefetch,
    zeroing: bool,
    /// The pending point of a replay, and the time at which it was sent.
    point: Option<(HipCommand, Duration)>,
    stats: LinkStats,
    samples_since_heartbeat: u32,
    logged_at: Option<Duration>,
}

/// The served terrain: the borrowed one, or the one of a scene change.
enum ServedTerrain<'t> {
    Borrowed(&'t Terrain<'t>),
    Changed(Box<Terrain<'t>>),
}

impl<'t> Deref for ServedTerrain<'t> {
    type Target = Terrain<'t>;

    fn deref(&self) -> &Terrain<'t> {
        match self {
            Self::Borrowed(terrain) => terrain,
            Self::Changed(terrain) => terrain,
        }
    }
}

impl<'t> Client<'t> {
    /// Creates a client that has not sent anything yet. It arms the device at the beginning of each
    /// session if `arming` is set.
    #[must_use]
    pub fn new(
        terrain: &'t Terrain<'t>,
        scene: Scene,
        arming: Option<Arming>,
        timeouts: Timeouts,
    ) -> Self {
        Self::numbered(terrain, scene, arming, timeouts, fastrand::u64(..))
    }

    /// As [`Client::new`], with session numbers drawn from a seed.
    #[must_use]
    pub fn numbered(
        terrain: &'t Terrain<'t>,
        scene: Scene,
        arming: Option<Arming>,
        timeouts: Timeouts,
        seed: u64,
    ) -> Self {
        Self {
            terrain: ServedTerrain::Borrowed(terrain),
            next: None,
            before: None,
            scene,
            arming,
            protocol: HostProtocol::new(Some(scene), timeouts, fastrand::Rng::with_seed(seed))
                .with_materials(terrain.grid().materials().map(Materials::table)),
            reader: Box::default(),
            tile: TileBuffer::default(),
            materials: MaterialBuffer::default(),
            device: None,
            is_new: true,
            has_armed: false,
            withheld: vec![],
            sent: vec![],
            awaited: vec![],
            prefetch: Prefetch::default(),
            zeroing: false,
            point: None,
            stats: LinkStats::default(),
            samples_since_heartbeat: 0,
            logged_at: None,
        }
    }

    /// Returns the served scene.
    #[must_use]
    pub const fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Returns the statistics of the link.
    #[must_use]
    pub const fn stats(&self) -> &LinkStats {
        &self.stats
    }

    /// Returns the state of the conversation.
    #[must_use]
    pub const fn state(&self) -> State {
        self.protocol.state()
    }

    /// Returns the number of the present or next session.
    #[must_use]
    pub const fn session(&self) -> SessionNumber {
        self.protocol.session()
    }

    /// Returns the time-outs.
    #[must_use]
    pub const fn timeouts(&self) -> &Timeouts {
        self.protocol.timeouts()
    }

    /// Begins a session, the first or another: appends the open message to `out`.
    pub fn greet(&mut self, now: Duration, out: &mut Vec<u8>) {
        *self.reader = FrameReader::new();
        self.is_new = true;
        self.withheld.clear();
        self.awaited.clear();
        self.prefetch.forget();
        self.zeroing = false;
        if self.protocol.greet(now, out) {
            self.stats.begin_session();
        }
    }

    /// Ends the session: appends the close message to `out`. The device has confirmed that it is
    /// disarmed when the state is [`State::Closed`].
    pub fn leave(&mut self, now: Duration, out: &mut Vec<u8>) {
        self.protocol.leave(now, out);
    }

    /// Adds a request after the earlier ones.
    pub fn enqueue(&mut self, request: HostRequest) {
        self.protocol.enqueue(request);
    }

    /// Puts a scene change in force, with its terrain: repeats it until it is answered
    /// ([`Event::SceneChangeResult`]). The clutch has to be open ([`Request::Clutch`]). Meanwhile the tiles
    /// around the new HIP position are read.
    pub fn put_view(
        &mut self,
        now: Duration,
        view: SceneChange,
        terrain: Terrain<'t>,
        out: &mut Vec<u8>,
    ) {
        prefetch::prefetch_around(&terrain, &view.hip);
        self.before = None;
        self.next = Some((view, terrain));
        self.protocol.put_view(view, now, out);
    }

    /// Ends the pending scene change and reports the result.
    fn resolve_view(&mut self, accepted: bool, on: &mut dyn FnMut(Event<'_>)) {
        if let Some((view, terrain)) = self.next.take() {
            if accepted {
                let terrain = ServedTerrain::Changed(Box::new(terrain));
                let before = self.serve(view.scene, terrain);
                self.before = view.in_contact.is_some().then_some(before);
            }
            on(Event::SceneChangeResult {
                view: &view,
                accepted,
            });
        }
    }

    /// Returns true if the pending scene change is in force by the epoch of the protocol's scene.
    fn is_next_in_force(&self) -> bool {
        let epoch = self.protocol.scene().map(|scene| scene.epoch);
        let next = self.next.as_ref().map(|(view, _)| view.scene.epoch);
        epoch == next
    }

    /// Serves another scene, and returns the one before.
    fn serve(&mut self, scene: Scene, terrain: ServedTerrain<'t>) -> (Scene, ServedTerrain<'t>) {
        self.awaited.clear();
        self.sent.clear();
        self.withheld.clear();
        self.prefetch.forget();
        let scene = std::mem::replace(&mut self.scene, scene);
        (scene, std::mem::replace(&mut self.terrain, terrain))
    }

    /// Serves the scene before the latest change if the protocol reports that the change was
    /// cancelled.
    fn restore_view(&mut self, on: &mut dyn FnMut(Event<'_>)) {
        if self.protocol.take_restored()
            && let Some((scene, terrain)) = self.before.take()
        {
            self.serve(scene, terrain);
            on(Event::ChangeCancelled);
        }
    }

    /// Renders a point: sends it until it is answered.
    pub fn step(&mut self, now: Duration, point: HipCommand, out: &mut Vec<u8>) {
        self.point = Some((point, now));
        self.protocol.append_message(&ToDevice::Hip(point), out);
    }

    /// Appends the messages that are due to `out`.
    ///
    /// # Errors
    /// When a deadline has passed: [`LinkError::Silent`], [`LinkError::Taken`],
    /// [`LinkError::NotConfirmed`].
    pub fn append_due(
        &mut self,
        now: Duration,
        out: &mut Vec<u8>,
        on: &mut dyn FnMut(Event<'_>),
    ) -> Result<(), LinkError> {
        if self.samples_since_heartbeat >= HEARTBEAT_SAMPLES {
            self.samples_since_heartbeat = 0;
            self.protocol.make_heartbeat_due();
        }
        let checked = self.protocol.append_due(now, out);
        if self.protocol.take_unanswered_view(now).is_some() {
            self.resolve_view(false, on);
        }
        self.repeat_point(now, out);
        for request in self.protocol.take_unanswered() {
            self.stats.unanswered += 1;
            if matches!(request, HostRequest::Request(Request::Zero { .. })) {
                self.send_withheld(out, on);
            }
            on(Event::Unanswered(&request));
        }
        checked
    }

    fn repeat_point(&mut self, now: Duration, out: &mut Vec<u8>) {
        let again = self.protocol.timeouts().retry;
        let is_open = self.state() == State::Open;
        if let Some((point, sent_at)) = &mut self.point
            && is_open
            && now.saturating_sub(*sent_at) >= again
        {
            *sent_at = now;
            self.protocol.append_message(&ToDevice::Hip(*point), out);
        }
    }

    /// Processes bytes from the device, appends the answers to `out` and reports events. Invalid
    /// frames are counted and skipped.
    ///
    /// # Errors
    /// [`LinkError::Version`] and [`LinkError::SceneRefused`]; [`LinkError::Taken`] and
    /// [`LinkError::HostSilent`] if the device reports that the session is over.
    pub fn receive(
        &mut self,
        now: Duration,
        mut bytes: &[u8],
        out: &mut Vec<u8>,
        on: &mut dyn FnMut(Event<'_>),
    ) -> Result<(), LinkError> {
        self.sent.clear();
        while let Some(frame) = next_frame(&mut self.reader, &mut bytes, from_device) {
            match frame {
                Ok(FromDevice::Version(check)) => self.protocol.on_version_check(check)?,
                Ok(FromDevice::Message(message)) => {
                    if message.session != self.protocol.session() {
                        self.stats.foreign_frames += 1;
                    }
                    if let Some(event) = self.protocol.on_frame(now, message, out)? {
                        self.on_protocol_event(now, event, out, on);
                    }
                }
                Err(bad) => {
                    self.stats.bad_frames += 1;
                    tracing::debug!(?bad, "a frame was not understood");
                }
            }
        }
        self.send_awaited(now, out, on);
        Ok(())
    }

    fn on_protocol_event(
        &mut self,
        now: Duration,
        event: ProtocolEvent,
        out: &mut Vec<u8>,
        on: &mut dyn FnMut(Event<'_>),
    ) {
        self.restore_view(on);
        match event {
            ProtocolEvent::HelloReceived { device, restarted } => {
                self.on_hello(device, restarted);
                self.resolve_view(self.is_next_in_force(), on);
            }
            ProtocolEvent::SceneChange { accepted } => self.resolve_view(accepted, on),
            ProtocolEvent::SceneAck => self.on_scene_ack(now, out, on),
            ProtocolEvent::Answered(request, message) => {
                self.on_answered(now, request, &message, out, on);
            }
            ProtocolEvent::Other(message) => self.on_message(now, message, out, on),
        }
    }

    fn on_hello(&mut self, device: DeviceHello, restarted: bool) {
        if restarted {
            self.is_new = true;
            self.withheld.clear();
            self.zeroing = false;
            self.stats.on_restarted();
        } else {
            // After a restart, only the session's last part is known.
            let LastSession {
                session,
                opened_by,
                count,
                ..
            } = device.last;
            let ours = self.protocol.previous();
            let whole = ours.is_some_and(|ours| (ours.0.get(), ours.1) == (session, opened_by));
            self.stats.on_opened(whole.then_some(count));
        }
        self.device = Some(device);
    }

    fn on_scene_ack(&mut self, now: Duration, out: &mut Vec<u8>, on: &mut dyn FnMut(Event<'_>)) {
        if !std::mem::take(&mut self.is_new) {
            return;
        }
        let again = std::mem::replace(&mut self.has_armed, true);
        // A real arm that returns keeps its state: it is armed already, or its user decides when to
        // arm it.
        if let Some(Arming { zero }) = self.arming.filter(|a| !again || a.zero.is_some()) {
            if let Some(counts) = zero {
                self.zeroing = true;
                self.protocol
                    .enqueue(HostRequest::Request(Request::Zero { counts }));
            }
            self.protocol.enqueue(HostRequest::Request(Request::Arm));
            self.protocol.append_pending(now, out);
        }
        if let Some(device) = &self.device {
            let resumed = device.epoch == Some(self.scene.epoch);
            on(Event::Opened { device, resumed });
        }
    }

    fn on_answered(
        &mut self,
        now: Duration,
        request: HostRequest,
        message: &ToHost,
        out: &mut Vec<u8>,
        on: &mut dyn FnMut(Event<'_>),
    ) {
        // Send the next request at once.
        self.protocol.append_pending(now, out);
        if matches!(request, HostRequest::Request(Request::Zero { .. })) {
            self.send_withheld(out, on);
        }
        match (request, message) {
            (HostRequest::Request(request), ToHost::Answer(answer)) => on(Event::Answered {
                request: &request,
                result: answer.result,
            }),
            (_, &ToHost::Marked { tick, .. }) => on(Event::Marked { tick }),
            (_, ToHost::Status { status, .. }) => on(Event::Status(status)),
            (_, ToHost::Calibration { calibration, .. }) => {
                on(Event::Calibration(calibration.as_ref()));
            }
            _ => {}
        }
    }

    fn on_message(
        &mut self,
        now: Duration,
        message: ToHost,
        out: &mut Vec<u8>,
        on: &mut dyn FnMut(Event<'_>),
    ) {
        let is_open = self.state() == State::Open;
        match message {
            ToHost::TileRequest { epoch, key } if is_open && epoch == self.scene.epoch => {
                // A device that requests tiles faster than it reads is not answered faster.
                let known = match self.zeroing {
                    true => &mut self.withheld,
                    false => &mut self.sent,
                };
                let has_room = out.len() < MAX_BYTES_AT_ONCE && known.len() < MAX_WITHHELD;
                if has_room && !known.contains(&key) {
                    known.push(key);
                    if !self.zeroing {
                        self.on_tile_request(now, key, out, on);
                    }
                }
            }
            ToHost::Telemetry(telemetry) => {
                let samples = telemetry.samples.len() as u32;
                self.samples_since_heartbeat = self.samples_since_heartbeat.saturating_add(samples);
                // Until the scene is accepted, the samples belong to another scene or to none.
                if self.stats.received(&telemetry) && !self.is_new {
                    if let (Some(device), Some(last)) = (&self.device, telemetry.samples.last()) {
                        let tick_hz = f64::from(device.tick_hz);
                        self.prefetch
                            .follow(&self.terrain, last.tick, &last.hip, tick_hz);
                    }
                    for sample in &telemetry.samples {
                        if self.protocol.on_rendered(sample.view) {
                            self.before = None;
                        }
                        on(Event::Sample(sample));
                    }
                }
            }
            ToHost::PointAnswer { seq, sample } => {
                self.point.take_if(|(point, _)| point.seq == seq);
                on(Event::Rendered {
                    seq,
                    sample: &sample,
                });
            }
            ToHost::Guard(report) => on(Event::Guard(&report)),
            ToHost::Heartbeat { count, report, .. } => {
                self.stats.set_reported(count);
                on(Event::Guard(&report));
            }
            ToHost::Goodbye(count) => self.stats.set_reported(count),
            // A repeated message, or one about a scene that is not served any more.
            _ => {}
        }
    }

    fn send_withheld(&mut self, out: &mut Vec<u8>, on: &mut dyn FnMut(Event<'_>)) {
        self.zeroing = false;
        for key in std::mem::take(&mut self.withheld) {
            self.on_tile_request(Duration::ZERO, key, out, on);
        }
    }

    fn on_tile_request(
        &mut self,
        now: Duration,
        key: TileKey,
        out: &mut Vec<u8>,
        on: &mut dyn FnMut(Event<'_>),
    ) {
        let Some((heights, status)) = self.terrain.tile_of(&self.scene, key, &mut self.tile) else {
            return self.on_no_tile(now, key);
        };
        // Fallback tiles have no materials.
        let materials = match key.level == self.scene.level {
            true => self.terrain.materials_of(key, &mut self.materials),
            false => None,
        };
        let of_materials = materials.as_ref().map(|(_, status)| *status);
        if !status.and(of_materials.unwrap_or_default()).is_complete() {
            return self.await_tile(now, key);
        }
        let tile = TileMessage {
            epoch: self.scene.epoch,
            key,
            heights,
        };
        let message = match materials {
            Some((materials, _)) => ToDevice::MaterialTile(MaterialTile { tile, materials }),
            None => ToDevice::Tile(tile),
        };
        let before = out.len();
        self.protocol.append_message(&message, out);
        let bytes = out.len() - before;
        if key.level != self.scene.level {
            // Each placement has its own fallback, but all have the same key.
            return self.stats.sent_fallback(bytes);
        }
        self.stats.sent_tile(key, bytes);
        on(Event::TileSent(key));
    }

    /// Registers a tile to be sent when its heights arrive.
    fn await_tile(&mut self, requested_at: Duration, key: TileKey) {
        self.awaited.retain(|(other, _)| *other != key);
        if self.awaited.len() < MAX_AWAITED {
            self.awaited.push((key, requested_at));
        }
    }

    /// Sends the awaited tiles whose heights have arrived.
    fn send_awaited(&mut self, now: Duration, out: &mut Vec<u8>, on: &mut dyn FnMut(Event<'_>)) {
        for (key, requested_at) in std::mem::take(&mut self.awaited) {
            let is_fresh = now.saturating_sub(requested_at) <= AWAIT_TIMEOUT;
            if is_fresh && out.len() < MAX_BYTES_AT_ONCE {
                self.on_tile_request(requested_at, key, out, on);
            } else if is_fresh {
                self.await_tile(requested_at, key);
            }
        }
    }

    /// Counts a request for a tile that does not exist; the log is limited, because a device may
    /// repeat such requests at any rate.
    fn on_no_tile(&mut self, now: Duration, key: TileKey) {
        self.stats.no_tiles += 1;
        let due = |at: Duration| now.saturating_sub(at) >= LOG_INTERVAL;
        if self.logged_at.is_none_or(due) {
            self.logged_at = Some(now);
            let so_far = self.stats.no_tiles;
            tracing::warn!(
                ?key,
                so_far,
                "the device requested a tile that does not exist"
            );
        }
    }
}

#[cfg(test)]
#[path = "client_tests.rs"]
pub(crate) mod tests;
