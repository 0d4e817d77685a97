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
    /// The scene is in force. `resumed` tells whether the device held it
    /// already and continues where it was.
    Opened {
        /// Returns the device's introduction.
        device: &'e DeviceHello,
        /// True if it continues with the scene it held.
        resumed: bool,
    },
    /// The sample of one tick of a scene whose HIP comes from the encoders.
    Sample(&'e TickRecord),
    /// The sample at one point of a replay.
    Rendered {
        /// The number that the host gave the point.
        seq: u32,
        /// HIP, proxy, force and state at the point.
        sample: &'e TickRecord,
    },
    /// State of the device's guard; sent at the beginning of a session, at each change, and twice a
    /// second.
    Guard(&'e Report),
    /// A view was put in ([`Client::put_view`]), or was not: the device refuses it, does
    /// not answer, or was restarted meanwhile.
    Viewed {
        /// The view.
        view: &'e SceneChange,
        /// True if it is in force.
        taken: bool,
    },
    /// The answer to a question for the status.
    Status(&'e Status),
    /// The calibration in force.
    Calibration(Option<&'e Calibration>),
    /// Result of a request.
    Answered {
        /// The request.
        request: &'e Request,
        /// Success, or the reason of the refusal.
        result: Result<(), Refusal>,
    },
    /// A tick was marked, as was asked for by [`Request::Mark`].
    Marked {
        /// The tick ([`TickRecord::tick`]).
        tick: u32,
    },
    /// A tile of the scene's level was sent to the device, which may lose it and ask again.
    TileSent(TileKey),
    /// A request was given up: the device does not answer it, or was
    /// restarted meanwhile. Whether it was done is not known.
    Unanswered(&'e HostRequest),
}

/// Arming of the device in a session, as soon as the scene is in force. A device that comes
/// back after it was lost is armed again by itself only where the arm is virtual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Arming {
    /// Encoder readings in the zero pose, if the host has them.
    pub zero: Option<[i32; 3]>,
}

impl Arming {
    /// For a virtual Phantom, which was switched on in its zero pose.
    pub const VIRTUAL: Self = Self { zero: Some([0; 3]) };
}

/// Samples after which the host says that it is there: half a second of a device whose
/// time runs faster than the host's.
const SAMPLES_A_SIGN: u32 = 500;
/// Bytes that are sent per reception at most, but for the tile that reaches beyond
/// them: a device has four requests under way, of 4.5 KiB each. What is left out is asked
/// for again.
const SAID_AT_ONCE: usize = 32 * 1024;
/// Tiles that are held back, or sent to one reception, at most.
const WITHHELD: usize = 16;
/// For so long a tile that is on its way from elsewhere is sent when it comes: a device asks
/// again for what it still wants ([`hapterra_core::terrain`]).
const AWAITED_FOR: Duration = Duration::from_secs(1);
/// Tiles that are awaited at once, at most.
const AWAITED: usize = 64;
/// Between two lines of the log about requests for tiles that there are not.
const LOG_EVERY: Duration = Duration::from_secs(1);

/// Serves one terrain to one device. Bytes from the device go into
/// [`Client::receive`]; bytes for it come out of there and of
/// [`Client::due`], which is to be called now and then. `now` is the time since any
/// fixed moment.
pub struct Client<'t> {
    terrain: Lent<'t>,
    /// The terrain of a view that is not in force yet.
    next: Option<(SceneChange, Terrain<'t>)>,
    scene: Scene,
    arming: Option<Arming>,
    talk: HostProtocol,
    reader: Box<FrameReader<MAX_FRAME>>,
    tile: TileBuffer,
    materials: MaterialBuffer,
    /// The device of the present session.
    device: Option<DeviceHello>,
    /// The scene was not taken yet in this session.
    is_new: bool,
    /// The scene was taken in some session, and the device asked to arm.
    has_armed: bool,
    /// Tiles that are sent once the device has its zero: work before the
    /// first tick must not depend on how long a message takes.
    withheld: Vec<TileKey>,
    /// Tiles that the present reception was answered with.
    sent: Vec<TileKey>,
    /// Tiles whose heights have not come yet from elsewhere, and when they were asked for.
    awaited: Vec<(TileKey, Duration)>,
    /// Tiles ahead of the HIP.
    prefetch: Prefetch,
    zeroing: bool,
    /// The pending point of a replay, and the time at which it was sent.
    point: Option<(HipCommand, Duration)>,
    tally: LinkStats,
    samples_since_sign: u32,
    logged: Option<Duration>,
}

/// A terrain that is served: the one that the client was lent, or that of another view.
enum Lent<'t> {
    Whole(&'t Terrain<'t>),
    SceneChange(Box<Terrain<'t>>),
}

impl<'t> Deref for Lent<'t> {
    type Target = Terrain<'t>;

    fn deref(&self) -> &Terrain<'t> {
        match self {
            Self::Whole(terrain) => terrain,
            Self::SceneChange(terrain) => terrain,
        }
    }
}

impl<'t> Client<'t> {
    /// A client that has not sent anything yet. It arms the device at the
    /// beginning of each session, if `arming` says how.
    #[must_use]
    pub fn new(
        terrain: &'t Terrain<'t>,
        scene: Scene,
        arming: Option<Arming>,
        patience: Timeouts,
    ) -> Self {
        Self::numbered(terrain, scene, arming, patience, fastrand::u64(..))
    }

    /// The same, with the numbers of its sessions drawn from a seed.
    #[must_use]
    pub fn numbered(
        terrain: &'t Terrain<'t>,
        scene: Scene,
        arming: Option<Arming>,
        patience: Timeouts,
        seed: u64,
    ) -> Self {
        Self {
            terrain: Lent::Whole(terrain),
            next: None,
            scene,
            arming,
            talk: HostProtocol::new(Some(scene), patience, fastrand::Rng::with_seed(seed))
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
            tally: LinkStats::default(),
            samples_since_sign: 0,
            logged: None,
        }
    }

    /// The scene that is served.
    #[must_use]
    pub const fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Statistics of the link.
    #[must_use]
    pub const fn tally(&self) -> &LinkStats {
        &self.tally
    }

    /// State of the conversation.
    #[must_use]
    pub const fn state(&self) -> State {
        self.talk.state()
    }

    /// The session that is spoken in, or will be.
    #[must_use]
    pub const fn session(&self) -> SessionNumber {
        self.talk.session()
    }

    /// Time-outs.
    #[must_use]
    pub const fn patience(&self) -> &Timeouts {
        self.talk.patience()
    }

    /// Begins a session, the first or another: appends the hello to `out`.
    pub fn greet(&mut self, now: Duration, out: &mut Vec<u8>) {
        *self.reader = FrameReader::new();
        self.is_new = true;
        self.withheld.clear();
        self.awaited.clear();
        self.prefetch.forget();
        self.zeroing = false;
        if self.talk.greet(now, out) {
            self.tally.drawn();
        }
    }

    /// Ends the session: appends the goodbye to `out`. The device is known to be
    /// disarmed when the state is [`State::Closed`].
    pub fn leave(&mut self, now: Duration, out: &mut Vec<u8>) {
        self.talk.leave(now, out);
    }

    /// Asks for something, after what was asked for before.
    pub fn ask(&mut self, ask: HostRequest) {
        self.talk.ask(ask);
    }

    /// Puts another view of the scene in, of this terrain: says it until it is answered
    /// ([`Event::Viewed`]). The clutch has to be open
    /// ([`Request::Clutch`]). What lies around the HIP there is read meanwhile.
    pub fn put_view(
        &mut self,
        now: Duration,
        view: SceneChange,
        terrain: Terrain<'t>,
        out: &mut Vec<u8>,
    ) {
        prefetch::read_around(&terrain, &view.hip);
        self.next = Some((view, terrain));
        self.talk.put_view(view, now, out);
    }

    /// The view that was put in is in force, if the protocol says so; or it is not and
    /// will not be. Tells which.
    fn settle_view(&mut self, over: bool, on: &mut dyn FnMut(Event<'_>)) {
        let epoch = self.talk.scene().map(|scene| scene.epoch);
        let taken = |view: &SceneChange| epoch == Some(view.scene.epoch);
        let settled = self.next.take_if(|(view, _)| over || taken(view));
        if let Some((view, terrain)) = settled {
            let taken = taken(&view);
            if taken {
                self.scene = view.scene;
                self.awaited.clear();
                self.prefetch.forget();
                self.terrain = Lent::SceneChange(Box::new(terrain));
            }
            on(Event::Viewed { view: &view, taken });
        }
    }

    /// Renders a point: sends it until it is answered.
    pub fn step(&mut self, now: Duration, point: HipCommand, out: &mut Vec<u8>) {
        self.point = Some((point, now));
        self.talk.say(&ToDevice::Hip(point), out);
    }

    /// Appends what is due to `out`.
    ///
    /// # Errors
    /// When a deadline has passed: [`LinkError::Silent`], [`LinkError::Taken`],
    /// [`LinkError::NotConfirmed`].
    pub fn due(
        &mut self,
        now: Duration,
        out: &mut Vec<u8>,
        on: &mut dyn FnMut(Event<'_>),
    ) -> Result<(), LinkError> {
        if self.samples_since_sign >= SAMPLES_A_SIGN {
            self.samples_since_sign = 0;
            self.talk.hasten_alive();
        }
        let checked = self.talk.due(now, out);
        if self.talk.take_lost_view(now).is_some() {
            self.settle_view(true, on);
        }
        self.repeat_point(now, out);
        for ask in self.talk.take_unanswered() {
            self.tally.unanswered += 1;
            if matches!(ask, HostRequest::Request(Request::Zero { .. })) {
                self.hand_over_withheld(out, on);
            }
            on(Event::Unanswered(&ask));
        }
        checked
    }

    fn repeat_point(&mut self, now: Duration, out: &mut Vec<u8>) {
        let again = self.talk.patience().again;
        let is_open = self.state() == State::Open;
        if let Some((point, said)) = &mut self.point
            && is_open
            && now.saturating_sub(*said) >= again
        {
            *said = now;
            self.talk.say(&ToDevice::Hip(*point), out);
        }
    }

    /// Takes bytes from the device, appends the answers to `out` and reports
    /// what happened. Frames that make no sense are counted and passed over.
    ///
    /// # Errors
    /// [`LinkError::Version`] and [`LinkError::SceneRefused`]; [`LinkError::Taken`] and
    /// [`LinkError::LetGo`] where the device says that the session is over.
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
                Ok(FromDevice::Version(check)) => self.talk.on_version_check(check)?,
                Ok(FromDevice::Message(message)) => {
                    if message.session != self.talk.session() {
                        self.tally.foreign_frames += 1;
                    }
                    if let Some(event) = self.talk.hear(now, message, out)? {
                        self.on_protocol_event(now, event, out, on);
                    }
                }
                Err(bad) => {
                    self.tally.bad_frames += 1;
                    tracing::debug!(?bad, "a frame was not understood");
                }
            }
        }
        self.say_awaited(now, out, on);
        Ok(())
    }

    fn on_protocol_event(
        &mut self,
        now: Duration,
        event: ProtocolEvent,
        out: &mut Vec<u8>,
        on: &mut dyn FnMut(Event<'_>),
    ) {
        match event {
            ProtocolEvent::Greeted { device, restarted } => {
                self.on_greeted(device, restarted);
                self.settle_view(true, on);
            }
            ProtocolEvent::SceneChange => self.settle_view(true, on),
            ProtocolEvent::SceneAck => self.on_scene_taken(now, out, on),
            ProtocolEvent::Answered(ask, message) => self.on_answered(now, ask, &message, out, on),
            ProtocolEvent::Other(message) => self.on_message(now, message, out, on),
        }
    }

    fn on_greeted(&mut self, device: DeviceHello, restarted: bool) {
        if restarted {
            self.is_new = true;
            self.withheld.clear();
            self.zeroing = false;
            self.tally.restarted();
        } else {
            // Where a restart came between, only the session's last part is known.
            let LastSession {
                session,
                opened_by,
                count,
                ..
            } = device.last;
            let ours = self.talk.previous();
            let whole = ours.is_some_and(|ours| (ours.0.get(), ours.1) == (session, opened_by));
            self.tally.opened(whole.then_some(count));
        }
        self.device = Some(device);
    }

    fn on_scene_taken(&mut self, now: Duration, out: &mut Vec<u8>, on: &mut dyn FnMut(Event<'_>)) {
        if !std::mem::take(&mut self.is_new) {
            return;
        }
        let again = std::mem::replace(&mut self.has_armed, true);
        // A real arm that has returned is as it is: armed, or its user says when it is
        // to be.
        if let Some(Arming { zero }) = self.arming.filter(|a| !again || a.zero.is_some()) {
            if let Some(counts) = zero {
                self.zeroing = true;
                self.talk
                    .ask(HostRequest::Request(Request::Zero { counts }));
            }
            self.talk.ask(HostRequest::Request(Request::Arm));
            self.talk.say_pending(now, out);
        }
        if let Some(device) = &self.device {
            let resumed = device.epoch == Some(self.scene.epoch);
            on(Event::Opened { device, resumed });
        }
    }

    fn on_answered(
        &mut self,
        now: Duration,
        ask: HostRequest,
        message: &ToHost,
        out: &mut Vec<u8>,
        on: &mut dyn FnMut(Event<'_>),
    ) {
        // The next goes out at once.
        self.talk.say_pending(now, out);
        if matches!(ask, HostRequest::Request(Request::Zero { .. })) {
            self.hand_over_withheld(out, on);
        }
        match (ask, message) {
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
                // A device that asks more often than it reads is not answered more often.
                let known = match self.zeroing {
                    true => &mut self.withheld,
                    false => &mut self.sent,
                };
                let has_room = out.len() < SAID_AT_ONCE && known.len() < WITHHELD;
                if has_room && !known.contains(&key) {
                    known.push(key);
                    if !self.zeroing {
                        self.on_need(now, key, out, on);
                    }
                }
            }
            ToHost::Telemetry(telemetry) => {
                let samples = telemetry.samples.len() as u32;
                self.samples_since_sign = self.samples_since_sign.saturating_add(samples);
                // Until the scene is taken they are of another, or of none.
                if self.tally.received(&telemetry) && !self.is_new {
                    if let (Some(device), Some(last)) = (&self.device, telemetry.samples.last()) {
                        let tick_hz = f64::from(device.tick_hz);
                        self.prefetch
                            .follow(&self.terrain, last.tick, &last.hip, tick_hz);
                    }
                    telemetry.samples.iter().for_each(|s| on(Event::Sample(s)));
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
                self.tally.told(count);
                on(Event::Guard(&report));
            }
            ToHost::Goodbye(count) => self.tally.told(count),
            // Said twice, or of a scene that is not served any more.
            _ => {}
        }
    }

    fn hand_over_withheld(&mut self, out: &mut Vec<u8>, on: &mut dyn FnMut(Event<'_>)) {
        self.zeroing = false;
        for key in std::mem::take(&mut self.withheld) {
            self.on_need(Duration::ZERO, key, out, on);
        }
    }

    fn on_need(
        &mut self,
        now: Duration,
        key: TileKey,
        out: &mut Vec<u8>,
        on: &mut dyn FnMut(Event<'_>),
    ) {
        let Some((heights, status)) = self.terrain.tile_of(&self.scene, key, &mut self.tile) else {
            return self.on_no_tile(now, key);
        };
        // The fallback comes without.
        let materials = match key.level == self.scene.level {
            true => self.terrain.materials_of(key, &mut self.materials),
            false => None,
        };
        let of_materials = materials.as_ref().map(|(_, status)| *status);
        if !status.and(of_materials.unwrap_or_default()).is_complete() {
            return self.wait_for(now, key);
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
        self.talk.say(&message, out);
        let bytes = out.len() - before;
        if key.level != self.scene.level {
            // Each view has its own fallback, and all have one name.
            return self.tally.sent_fallback(bytes);
        }
        self.tally.sent_tile(key, bytes);
        on(Event::TileSent(key));
    }

    /// Sends a tile when its heights have come.
    fn wait_for(&mut self, asked: Duration, key: TileKey) {
        self.awaited.retain(|(other, _)| *other != key);
        if self.awaited.len() < AWAITED {
            self.awaited.push((key, asked));
        }
    }

    /// Sends the tiles whose heights have come since.
    fn say_awaited(&mut self, now: Duration, out: &mut Vec<u8>, on: &mut dyn FnMut(Event<'_>)) {
        for (key, asked) in std::mem::take(&mut self.awaited) {
            let is_wanted = now.saturating_sub(asked) <= AWAITED_FOR;
            if is_wanted && out.len() < SAID_AT_ONCE {
                self.on_need(asked, key, out, on);
            } else if is_wanted {
                self.wait_for(asked, key);
            }
        }
    }

    /// A device may ask for anything, as often as it likes.
    fn on_no_tile(&mut self, now: Duration, key: TileKey) {
        self.tally.no_tiles += 1;
        let due = |at: Duration| now.saturating_sub(at) >= LOG_EVERY;
        if self.logged.is_none_or(due) {
            self.logged = Some(now);
            let so_far = self.tally.no_tiles;
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
