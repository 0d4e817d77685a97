//! The queues between the haptic loop and the link, and their messages.
//!
//! The loop runs in an interrupt, the link in a task below it. They share only single-producer
//! queues and the counters of [`Monitor`]: neither half ever waits for a lock, and no tile is
//! reachable from both halves at once.

use hapterra_core::force::MaterialTable;
use hapterra_core::phantom::Kinematics;
use hapterra_core::scene::Health;
use hapterra_core::scene::TickRecord;
use hapterra_core::terrain::{IN_FLIGHT, Tile};
use hapterra_core::tick::Command;
use heapless::spsc::{Consumer, Producer, Queue};

use crate::monitor::Monitor;

/// Tile buffers besides the window's: one for each requested tile, and one more. The two tiles of a
/// fallback use two of them, so at most three tiles of the field are requested with a fallback.
pub(crate) const SPARES: usize = IN_FLIGHT + 1;
/// Slots of the command queue, one of which stays empty.
const COMMANDS: usize = 16;
/// Slots of the record queue: the link may be delayed by this many samples. Unpacking the slowest
/// tile takes it three.
const RECORDS: usize = 28;
/// Slots of the settings queue: one set of settings at a time.
const SETTINGS: usize = 2;
/// Slots of the queue of material tables: one table at a time.
const MATERIALS: usize = 2;
/// Slots of the health queue: one report at a time.
const HEALTH: usize = 2;

/// The loop's record of one tick for the link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct QueuedTick {
    /// Record of the tick.
    pub(crate) sample: TickRecord,
    /// The number of the point that this tick answers.
    pub(crate) answered_seq: Option<u32>,
}

/// The loop's state as reported to the link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LoopReport {
    /// The guard's state, and the measured and commanded values.
    pub(crate) health: Health,
    /// The epoch of the current scene.
    pub(crate) epoch: Option<u32>,
    /// The latest mark whose pulse is over.
    pub(crate) marked: Marked,
}

/// A mark whose pulse is over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Marked {
    /// The mark's number ([`Command::Mark`]); 0 before the first.
    pub(crate) number: u8,
    /// The tick that was marked.
    pub(crate) tick: u32,
}

/// All queues between the loop and the link.
pub(crate) struct Queues<'t> {
    commands: Queue<Command<'t>, COMMANDS>,
    /// Room for every buffer that can be returned.
    spent: Queue<&'t mut Tile, { SPARES + 1 }>,
    records: Queue<QueuedTick, RECORDS>,
    settings: Queue<Kinematics, SETTINGS>,
    materials: Queue<MaterialTable, MATERIALS>,
    health: Queue<LoopReport, HEALTH>,
    monitor: Monitor,
}

/// The ends of the queues that the haptic loop holds.
pub(crate) struct LoopEnds<'t> {
    pub(crate) commands: Consumer<'t, Command<'t>>,
    pub(crate) spent: Producer<'t, &'t mut Tile>,
    pub(crate) records: Producer<'t, QueuedTick>,
    pub(crate) settings: Consumer<'t, Kinematics>,
    pub(crate) materials: Consumer<'t, MaterialTable>,
    pub(crate) health: Producer<'t, LoopReport>,
    pub(crate) monitor: &'t Monitor,
}

/// The ends of the queues that the link holds.
pub(crate) struct LinkEnds<'t> {
    pub(crate) commands: Producer<'t, Command<'t>>,
    pub(crate) spent: Consumer<'t, &'t mut Tile>,
    pub(crate) records: Consumer<'t, QueuedTick>,
    pub(crate) settings: Producer<'t, Kinematics>,
    pub(crate) materials: Producer<'t, MaterialTable>,
    pub(crate) health: Consumer<'t, LoopReport>,
    pub(crate) monitor: &'t Monitor,
}

impl<'t> Queues<'t> {
    /// Makes empty queues.
    pub(crate) const fn new() -> Self {
        Self {
            commands: Queue::new(),
            spent: Queue::new(),
            records: Queue::new(),
            settings: Queue::new(),
            materials: Queue::new(),
            health: Queue::new(),
            monitor: Monitor::new(),
        }
    }

    /// Splits every queue into the loop's end and the link's end.
    pub(crate) fn split(&'t mut self) -> (LoopEnds<'t>, LinkEnds<'t>) {
        let commands = self.commands.split();
        let spent = self.spent.split();
        let records = self.records.split();
        let settings = self.settings.split();
        let materials = self.materials.split();
        let health = self.health.split();
        let monitor = &self.monitor;
        let loop_ends = LoopEnds {
            commands: commands.1,
            spent: spent.0,
            records: records.0,
            settings: settings.1,
            materials: materials.1,
            health: health.0,
            monitor,
        };
        let link_ends = LinkEnds {
            commands: commands.0,
            spent: spent.1,
            records: records.1,
            settings: settings.0,
            materials: materials.0,
            health: health.1,
            monitor,
        };
        (loop_ends, link_ends)
    }
}
