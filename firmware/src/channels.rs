//! The memory of the application, and the queues between its two halves.
//!
//! The loop runs in an interrupt and the link in a task below it. They share
//! single-producer queues and a few counters, and nothing else: no lock that
//! one could wait for, no tile that both could touch.

use hapterra_core::guard::{Fault, TickRate};
use hapterra_core::phantom::Mechanism;
use hapterra_core::terrain::{IN_FLIGHT, Tile};
use hapterra_core::tick::{Command, Haptics};
use hapterra_core::wire::message::Sample;
use hapterra_core::wire::status::{BootReport, Health};
use heapless::spsc::Queue;

use crate::board::{Amplifiers, Encoders, TickClock};
use crate::haptic_loop::{HapticLoop, LoopEnds};
use crate::link::{Buffers, Identity, Link, LinkEnds};
use crate::store::Stored;
use crate::vitals::Vitals;

/// Tile buffers besides the window's: one for each tile on its way.
pub const SPARES: usize = IN_FLIGHT;
/// Slots of the command queue, one of which stays empty.
const COMMANDS: usize = 16;
/// Slots of the record queue: the link may sleep through this many ticks.
const RECORDS: usize = 32;
/// Slots of the settings queue: one set of settings at a time.
const SETTINGS: usize = 2;
/// Slots of the queue by which the loop tells where it stands.
const HEALTHS: usize = 2;

/// All tile buffers of a device with a window of `D × D` tiles.
pub struct Tiles<const D: usize> {
    window: [[Tile; D]; D],
    spare: [Tile; SPARES],
}

impl<const D: usize> Tiles<D> {
    /// Vacant buffers.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            window: [const { [const { Tile::VACANT }; D] }; D],
            spare: [const { Tile::VACANT }; SPARES],
        }
    }

    /// The window's buffers and the spare ones.
    pub(crate) fn split(&mut self) -> ([[&mut Tile; D]; D], [&mut Tile; SPARES]) {
        let window = self.window.each_mut().map(|row| row.each_mut());
        (window, self.spare.each_mut())
    }
}

impl<const D: usize> Default for Tiles<D> {
    fn default() -> Self {
        Self::new()
    }
}

/// One tick as the loop reports it to the link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Record {
    /// What was felt.
    pub sample: Sample,
    /// The number of the point that this answers.
    pub answers: Option<u32>,
}

/// The queues between the loop and the link, and the link's large buffers:
/// all that is better placed once than moved.
pub struct Channels<'t> {
    commands: Queue<Command<'t>, COMMANDS>,
    /// Room for every buffer that can be on its way back.
    spent: Queue<&'t mut Tile, { SPARES + 1 }>,
    records: Queue<Record, RECORDS>,
    settings: Queue<Mechanism, SETTINGS>,
    healths: Queue<Health, HEALTHS>,
    vitals: Vitals,
    buffers: Buffers,
}

impl<'t> Channels<'t> {
    /// The loop's ends, the link's ends, the link's buffers.
    pub(crate) fn split(&'t mut self) -> (LoopEnds<'t>, LinkEnds<'t>, &'t mut Buffers) {
        let (to_loop, commands) = self.commands.split();
        let (spent, spent_here) = self.spent.split();
        let (records, records_here) = self.records.split();
        let (to_arm, settings) = self.settings.split();
        let (healths, healths_here) = self.healths.split();
        let vitals = &self.vitals;
        let loop_ends = LoopEnds {
            commands,
            spent,
            records,
            settings,
            healths,
            vitals,
        };
        let link_ends = LinkEnds {
            commands: to_loop,
            spent: spent_here,
            records: records_here,
            settings: to_arm,
            healths: healths_here,
            vitals,
        };
        (loop_ends, link_ends, &mut self.buffers)
    }

    /// Empty queues.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            commands: Queue::new(),
            spent: Queue::new(),
            records: Queue::new(),
            settings: Queue::new(),
            healths: Queue::new(),
            vitals: Vitals::new(),
            buffers: Buffers::new(),
        }
    }
}

impl Default for Channels<'_> {
    fn default() -> Self {
        Self::new()
    }
}

/// What a board brings to the application.
pub struct Hardware<E, A, C> {
    /// The encoders.
    pub encoders: E,
    /// The amplifiers, off.
    pub amplifiers: A,
    /// The tick's timer and the clock.
    pub clock: C,
    /// The Phantom's calibration record, as the board's memory has it.
    pub calibration: Stored,
    /// What the board found when it started.
    pub boot: BootReport,
}

/// The application's two halves, and the signs of life of both.
pub struct Application<'t, E, A: Amplifiers, C, const D: usize> {
    /// For the timer interrupt.
    pub haptic_loop: HapticLoop<'t, E, A, C, D>,
    /// For the link task.
    pub link: Link<'t, D>,
    /// For the supervisor.
    pub vitals: &'t Vitals,
}

/// Builds the application in the given memory. `board` is the name by which the
/// host knows the board.
pub fn assemble<'t, E, A, C, const D: usize>(
    tiles: &'t mut Tiles<D>,
    channels: &'t mut Channels<'t>,
    hardware: Hardware<E, A, C>,
    board: &str,
) -> Application<'t, E, A, C, D>
where
    E: Encoders,
    A: Amplifiers,
    C: TickClock,
{
    let (loop_ends, link_ends, buffers) = channels.split();
    let vitals = loop_ends.vitals;
    let (window, spare) = tiles.split();
    let mechanism = prepared(&hardware.calibration);
    let damaged = hardware.calibration != Stored::Missing && mechanism.is_none();
    let found = damaged.then_some(Fault::CalibrationCorrupt);
    let mut haptics = Haptics::new(window, rate::<C>(), hardware.boot.fault().or(found));
    if let Some(mechanism) = mechanism {
        haptics.configure(mechanism);
    }
    let haptic_loop = HapticLoop::new(
        haptics,
        loop_ends,
        hardware.encoders,
        hardware.amplifiers,
        hardware.clock,
    );
    let identity = Identity::new::<C>(board, hardware.boot, mechanism.as_ref());
    let link = Link::new(identity, spare, link_ends, buffers);
    Application {
        haptic_loop,
        link,
        vitals,
    }
}

/// The tick rate that a board's clock was built for.
pub(crate) const fn rate<C: TickClock>() -> TickRate {
    const {
        match TickRate::new(C::HZ / C::PERIOD) {
            Some(rate) => rate,
            None => panic!("the tick rate is 1 to 10 kHz"),
        }
    }
}

fn prepared(stored: &Stored) -> Option<Mechanism> {
    match stored {
        Stored::Found(calibration) => Mechanism::new(calibration).ok(),
        Stored::Missing | Stored::Damaged => None,
    }
}
