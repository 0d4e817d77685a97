//! The device's end of the link, as a state machine without I/O.
//!
//! [`Link::receive`] reads bytes from the host, [`Link::transmit`] supplies bytes for the host, and
//! [`Link::poll`] does the pending work. Nothing here waits or reads a clock: time is the loop's
//! tick count. [`task::run`] connects it to a board's reader and writer; tests and the native
//! device call it directly, so that a test can inject any fault of a link byte by byte.
//!
//! Guarantees:
//! - Answers and requests are sent before telemetry. If the writer is slow, only telemetry is
//!   dropped, and it is counted.
//! - A tile is requested only if a buffer is free for it.
//! - Frames that are damaged, not requested, or of another scene or session change nothing.
//! - A hello at any time (after a zero byte, which ends any unfinished frame) opens a new session
//!   and keeps the scene and all stored tiles, so that a returning host continues where it was.
//! - If the host falls silent, the arm renders the stored tiles until the host's time-out; then it
//!   is disarmed.
//! - A placement changes while no force is rendered, or under a pressing hand from the
//!   present force on; the arm stays armed.
//! - A bye is answered once the amplifiers are off.

mod commands;
mod device_state;
mod host_timeout;
mod loader;
mod log;
mod materials;
mod messages;
mod poll;
mod requests;
mod session;
pub mod task;
#[cfg(test)]
mod tests;
mod tiles;
mod tx_queue;
mod views;

use hapterra_core::contact::ContactState;
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::{HipCommand, Scene, Source, TickRecord};
use hapterra_core::terrain::{RequestHint, Tile, TileRequester};
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME};
use hapterra_core::wire::message::ToHost;
use hapterra_core::wire::request::Refusal;
use hapterra_core::wire::session::{SampleCount, SessionNumber};
use heapless::{Deque, Vec};

use crate::led::LedPattern;
use crate::queues::{LinkEnds, QueuedTick, SPARES};
use commands::CommandRoom;
pub(crate) use device_state::{ArmConfig, DeviceState};
use loader::LoaderEntry;
use materials::LoopMaterials;
use session::{Session, SessionState};
pub use tiles::fill_tile;
use tx_queue::TxQueue;
use views::{ChangeInContact, HostClutch};

/// Capacity for samples that wait for the writer; when it is full, new ones are dropped.
const SAMPLES: usize = 16;
/// Points that a host may send ahead; further ones are dropped.
pub const POINTS_AHEAD: usize = 16;

/// The link's large buffers.
pub(crate) struct Buffers {
    reader: FrameReader<MAX_FRAME>,
    tx: TxQueue,
    /// Samples that wait for the writer.
    samples: Deque<TickRecord, SAMPLES>,
}

impl Buffers {
    pub(crate) const fn new() -> Self {
        Self {
            reader: FrameReader::new(),
            tx: TxQueue::new(),
            samples: Deque::new(),
        }
    }
}

/// Progress of a replay's points.
#[derive(Clone, Copy, Debug, Default)]
struct ReplayProgress {
    /// The number of the point that the loop is rendering.
    current: Option<u32>,
    /// The last answer, for a host that missed it.
    last: Option<QueuedTick>,
}

/// The device's end of the link, for a window of `D × D` tiles.
pub struct Link<'t, const D: usize> {
    /// `None` only while a message that was read borrows from it.
    reader: Option<&'t mut FrameReader<MAX_FRAME>>,
    tx: &'t mut TxQueue,
    samples: &'t mut Deque<TickRecord, SAMPLES>,
    ends: LinkEnds<'t>,
    session: Session,
    /// Session of the last host that only reads.
    read_only_session: Option<SessionNumber>,
    /// True if the command queue was empty when the loop's reports were last read.
    commands_drained: bool,
    /// State of arming, calibration and status.
    device: DeviceState,
    /// Entry into the loader in the chip's ROM.
    loader: LoaderEntry,
    scene: Option<Scene>,
    /// The last table of materials sent to the loop.
    materials: Option<LoopMaterials>,
    /// Number of the latest placement; samples with another number are older.
    view: u8,
    /// The latest placement's change in contact, until it is cancelled or another one arrives.
    change: Option<ChangeInContact>,
    clutch: HostClutch,
    requester: TileRequester<D>,
    /// Millisecond in which the tile requester last found nothing to request; cleared by any
    /// change. Its search is long, so it is not repeated in every tick.
    nothing_to_request_at: Option<u32>,
    request_hint: Option<RequestHint>,
    last_record: QueuedTick,
    spare: Vec<&'t mut Tile, SPARES>,
    points: Deque<HipCommand, POINTS_AHEAD>,
    replay: ReplayProgress,
    /// Samples in the last telemetry message.
    batch: u32,
    /// Samples dropped here; the monitor counts those that the loop dropped.
    dropped: u32,
    bad_frames: u32,
    /// Frames of sessions that are not open.
    foreign_frames: u32,
}

impl<'t, const D: usize> Link<'t, D> {
    pub(crate) fn new(
        device: DeviceState,
        spare: [&'t mut Tile; SPARES],
        ends: LinkEnds<'t>,
        buffers: &'t mut Buffers,
    ) -> Self {
        Self {
            reader: Some(&mut buffers.reader),
            tx: &mut buffers.tx,
            samples: &mut buffers.samples,
            ends,
            session: Session::new(),
            read_only_session: None,
            commands_drained: false,
            device,
            loader: LoaderEntry::default(),
            scene: None,
            materials: None,
            view: 0,
            change: None,
            clutch: HostClutch::default(),
            requester: TileRequester::new(),
            nothing_to_request_at: None,
            request_hint: None,
            last_record: QueuedTick::default(),
            spare: spare.into_iter().collect(),
            points: Deque::new(),
            replay: ReplayProgress::default(),
            batch: 0,
            dropped: 0,
            bad_frames: 0,
            foreign_frames: 0,
        }
    }

    /// Reads bytes from the host and handles every frame that ends in them.
    ///
    /// Returns the number of bytes read. It is less than the input, even zero, while the loop or
    /// the writer has to catch up: pass the rest again after a poll.
    pub fn receive(&mut self, bytes: &[u8]) -> usize {
        let mut consumed = 0;
        while let Some(rest) = bytes.get(consumed..).filter(|rest| !rest.is_empty()) {
            let Some(room) = self.room_for_message() else {
                break;
            };
            let Some(reader) = self.reader.take() else {
                break;
            };
            let (n, frame) = reader.push(rest);
            consumed += n;
            let received =
                frame.map(|frame| frame.and_then(|content| self.on_content(content, room)));
            if let Some(Err(bad)) = received {
                self.on_bad_frame(bad);
            }
            self.reader = Some(reader);
        }
        consumed
    }

    /// Returns room for one message, which may need one command, one table and one answer.
    fn room_for_message(&self) -> Option<CommandRoom> {
        let has_room = self.ends.materials.ready() && self.tx.has_room();
        self.room_for_command().filter(|_| has_room)
    }

    /// Resets the link after an interruption of the transport: unfinished frames and pending
    /// messages are lost.
    pub fn interrupted(&mut self) {
        if let Some(reader) = &mut self.reader {
            **reader = FrameReader::new();
        }
        self.clear_messages();
    }

    /// Returns true if the loop has nothing to do until a message of the host arrives.
    ///
    /// True without a scene, between the points of a replay, and, with [`Scene::hold_clock`], while
    /// a requested tile is missing. An emulated board then stops its clock, and a caller that runs
    /// the device in lock-step runs no tick; a real board keeps ticking.
    #[must_use]
    pub fn may_stop_clock(&self) -> bool {
        let is_waiting = match &self.scene {
            None => true,
            Some(scene) if scene.source == Source::Points => self.replay.current.is_none(),
            Some(scene) if scene.hold_clock && self.requester.in_flight() > 0 => return true,
            Some(_) => false,
        };
        // Commands have to reach the loop, the force has to ramp down, and a host that closes has
        // to receive its answer.
        let is_closing = self.session.is_closing();
        is_waiting
            && !(is_closing && self.device.may_drive)
            && self.ends.commands.is_empty()
            && self.ends.settings.is_empty()
            && self.device.is_idle()
    }

    /// Returns true if the current scene is rendered through the encoders.
    fn is_arm_scene(&self) -> bool {
        self.scene.is_some_and(|s| s.source == Source::Encoders)
    }

    /// Returns true if the arm is in use: the current scene is rendered through the encoders, or a
    /// force still ramps down.
    #[must_use]
    pub fn is_arm_in_use(&self) -> bool {
        self.is_arm_scene() || self.device.is_driving()
    }

    /// Returns the pattern of the board's status LED.
    #[must_use]
    pub fn led_pattern(&self) -> LedPattern {
        let touching = self.last_record.sample.state == ContactState::Touching;
        LedPattern::of(&self.device.health.report, touching)
    }

    /// Returns the calibration to store in the board's memory, until [`Self::stored`] receives the
    /// result. The arm is disarmed.
    #[must_use]
    pub fn to_store(&self) -> Option<Calibration> {
        self.device.to_store()
    }

    /// Sets the result of storing the calibration; the errors are [`Refusal::NoMemory`],
    /// [`Refusal::MemoryFull`] and [`Refusal::MemoryFailed`].
    pub fn stored(&mut self, result: Result<(), Refusal>) {
        self.device.stored(result);
    }

    /// Returns true if the session has ended with a disarmed arm, and its last answer was sent.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.session.state() == SessionState::Acknowledged && self.tx.is_empty()
    }

    /// Returns the count of the session's samples that were sent before the next message.
    fn sample_count(&self) -> SampleCount {
        let waiting = if self.tx.is_telemetry_pending() {
            self.batch
        } else {
            0
        };
        self.session.count(waiting, self.samples_dropped())
    }

    fn send(&mut self, message: &ToHost) {
        self.send_in(self.session.number(), message);
    }

    fn send_in(&mut self, session: SessionNumber, message: &ToHost) {
        // Callers have checked that there is room.
        self.tx.push(session, message);
    }

    /// Answers a point with the loop's record of it.
    fn answer_point(&mut self, record: QueuedTick) {
        let is_open = self.session.is_open();
        if let Some(seq) = record.answered_seq.filter(|_| is_open) {
            let sample = record.sample;
            self.send(&ToHost::PointAnswer { seq, sample });
        }
    }
}
