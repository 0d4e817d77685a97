//! The device's end of the link, as a state machine without I/O.
//!
//! Bytes from the host go in through [`Link::receive`], bytes for the host come
//! out of [`Link::transmit`], and [`Link::turn`] does what is due in between.
//! Nothing here waits and nothing reads a clock: time is the loop's tick count.
//! [`task::run`] wraps it for a board's reader and writer; tests and the native
//! device call it directly, so every fault of a link can be played to it byte
//! by byte.
//!
//! What it promises:
//! - Answers and requests go before telemetry. When the writer is slow,
//!   telemetry is dropped and counted, nothing else.
//! - A tile buffer is asked of the host only if there is one to put it in.
//! - Frames that are damaged, unasked for, or of another scene change nothing.
//! - A hello at any time (after a zero, which ends what an earlier host may
//!   have left unfinished) begins a session anew and keeps the scene and every
//!   tile that is held, so a host that comes back goes on where it was.

mod desk;
mod focus;
mod log;
mod outbox;
mod session;
pub mod task;
#[cfg(test)]
mod tests;

use hapterra_core::phantom::{Calibration, Mechanism};
use hapterra_core::terrain::Tile;
use hapterra_core::tick::Command;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode};
use hapterra_core::wire::message::{DeviceHello, PROTOCOL};
use hapterra_core::wire::status::{BootReport, Health, Refusal};
use heapless::spsc::{Consumer, Producer};

use crate::board::TickClock;
use crate::channels::{Record, SPARES};
use crate::led::Signal;
use crate::vitals::Vitals;
use outbox::Outbox;
pub use session::POINTS_AHEAD;
use session::{Backlog, Session};

/// What is known of the device when it starts.
#[derive(Clone, Debug)]
pub(crate) struct Identity {
    hello: DeviceHello,
    boot: BootReport,
    calibration: Option<Calibration>,
}

impl Identity {
    /// Takes the board's name, cut to what the message holds, how it started,
    /// and the arm that it knows.
    pub(crate) fn new<C: TickClock>(
        board: &str,
        boot: BootReport,
        mechanism: Option<&Mechanism>,
    ) -> Self {
        let hello = DeviceHello {
            protocol: PROTOCOL,
            board: name(board),
            version: name(env!("CARGO_PKG_VERSION")),
            window: 0,
            tick_hz: C::HZ / C::PERIOD,
            clock_hz: C::HZ,
            epoch: None,
        };
        Self {
            hello,
            boot,
            calibration: mechanism.map(|mechanism| *mechanism.calibration()),
        }
    }
}

fn name<const N: usize>(text: &str) -> heapless::String<N> {
    let mut name = heapless::String::new();
    // Stops at the first character that does not fit.
    let _ = text.chars().try_for_each(|c| name.push(c));
    name
}

/// The queues to and from the loop, as the link holds them.
pub(crate) struct LinkEnds<'t> {
    pub(crate) commands: Producer<'t, Command<'t>>,
    pub(crate) spent: Consumer<'t, &'t mut Tile>,
    pub(crate) records: Consumer<'t, Record>,
    pub(crate) settings: Producer<'t, Mechanism>,
    pub(crate) healths: Consumer<'t, Health>,
    pub(crate) vitals: &'t Vitals,
}

/// The link's large buffers.
pub(crate) struct Buffers {
    reader: FrameReader<MAX_FRAME>,
    outbox: Outbox,
    backlog: Backlog,
}

impl Buffers {
    pub(crate) const fn new() -> Self {
        Self {
            reader: FrameReader::new(),
            outbox: Outbox::new(),
            backlog: Backlog::new(),
        }
    }
}

/// The device's end of the link, for a window of `D × D` tiles.
pub struct Link<'t, const D: usize> {
    reader: &'t mut FrameReader<MAX_FRAME>,
    session: Session<'t, D>,
}

impl<'t, const D: usize> Link<'t, D> {
    pub(crate) fn new(
        identity: Identity,
        spare: [&'t mut Tile; SPARES],
        ends: LinkEnds<'t>,
        buffers: &'t mut Buffers,
    ) -> Self {
        let Buffers {
            reader,
            outbox,
            backlog,
        } = buffers;
        Self {
            reader,
            session: Session::new(identity, spare, ends, outbox, backlog),
        }
    }

    /// Takes bytes from the host and acts on every frame that ends in them.
    ///
    /// Returns how many were taken. Fewer than given, even none, while the loop
    /// or the writer has to catch up first: offer the rest again after a turn.
    pub fn receive(&mut self, bytes: &[u8]) -> usize {
        let mut taken = 0;
        while let Some(rest) = bytes.get(taken..).filter(|rest| !rest.is_empty()) {
            if !self.session.has_room() {
                break;
            }
            let (n, frame) = self.reader.push(rest);
            taken += n;
            match frame.map(|frame| frame.and_then(decode)) {
                Some(Ok(message)) => self.session.on_message(message),
                Some(Err(bad)) => self.session.on_bad_frame(bad),
                None => {}
            }
        }
        taken
    }

    /// Does what is due: collects what the loop left, asks for tiles, hands on
    /// the next point, packs telemetry.
    pub fn turn(&mut self) {
        self.session.turn();
    }

    /// Moves bytes that are to be sent next into `into`; returns how many.
    /// They count as sent.
    pub fn transmit(&mut self, into: &mut [u8]) -> usize {
        self.session.transmit(into)
    }

    /// The transport was interrupted: what was under way is lost.
    pub fn interrupted(&mut self) {
        *self.reader = FrameReader::new();
        self.session.interrupted();
    }

    /// Whether there is nothing for the loop to do until the host has spoken.
    ///
    /// True without a scene, between the points of a replay, and, in a scene
    /// that asks for it ([`Scene::hold_clock`]), while the host owes a tile. An
    /// emulated board then lets its clock stand still, and whoever runs the
    /// device in lock-step does not tick; a real board goes on ticking.
    ///
    /// [`Scene::hold_clock`]: hapterra_core::wire::message::Scene::hold_clock
    #[must_use]
    pub fn may_stand_still(&self) -> bool {
        self.session.may_stand_still()
    }

    /// Whether the arm is in use: the scene in force is felt through the
    /// encoders, or force is still going out.
    #[must_use]
    pub fn drives_arm(&self) -> bool {
        self.session.drives_arm()
    }

    /// What the board's status LED has to say.
    #[must_use]
    pub fn signal(&self) -> Signal {
        self.session.signal()
    }

    /// A calibration that the host wants stored in the board's memory, until
    /// [`Self::stored`] tells how that went. The arm is disarmed.
    #[must_use]
    pub fn to_store(&self) -> Option<Calibration> {
        self.session.to_store()
    }

    /// How storing it went: [`Refusal::NoMemory`], [`Refusal::MemoryFull`] or
    /// [`Refusal::MemoryFailed`].
    pub fn stored(&mut self, result: Result<(), Refusal>) {
        self.session.stored(result);
    }

    /// Whether the host has said goodbye and everything is sent.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.session.has_ended()
    }

    /// Frames so far that were not understood.
    #[must_use]
    pub const fn bad_frames(&self) -> u32 {
        self.session.bad_frames()
    }
}
