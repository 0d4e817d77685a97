//! What the timer interrupt calls a thousand times a second, or up to ten
//! thousand.
//!
//! It does only I/O and book-keeping around [`Haptics::tick`]: take what the
//! link brought, read the encoders, tick, write the amplifiers, leave a record,
//! measure what that cost. Everything it does is bounded and nothing waits.

mod liveness;
mod reporter;

use core::mem;

use hapterra_core::guard::{Drive, Fault, Sense};
use hapterra_core::phantom::Mechanism;
use hapterra_core::terrain::Tile;
use hapterra_core::tick::{Command, Haptics, Outcome};
use hapterra_core::wire::message::Source;
use hapterra_core::wire::status::Health;
use hapterra_tick::FastTick;
use heapless::spsc::{Consumer, Producer};

use crate::board::{Amplifiers, EnabledAmplifiers, Encoders, TickClock};
use crate::channels::{Record, rate};
use crate::timing::Timing;
use crate::vitals::{Part, Vitals};
use liveness::Liveness;
use reporter::Reporter;

/// Commands taken in one tick, at most; the rest wait for the next.
pub const COMMANDS_PER_TICK: usize = 4;

/// Where the hand's position comes from at the moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Feed {
    /// There is no scene: nothing to feel, nothing to record. The guard still
    /// looks at the arm.
    Nothing,
    /// The encoders.
    Arm,
    /// Points over the link; whether one is being felt.
    Points { pending: bool },
}

/// The amplifiers in either of their states.
enum Power<A: Amplifiers> {
    Off(A),
    On(A::Enabled),
}

/// The queues to and from the link, as the loop holds them.
pub(crate) struct LoopEnds<'t> {
    pub(crate) commands: Consumer<'t, Command<'t>>,
    pub(crate) spent: Producer<'t, &'t mut Tile>,
    pub(crate) records: Producer<'t, Record>,
    pub(crate) settings: Consumer<'t, Mechanism>,
    pub(crate) healths: Producer<'t, Health>,
    pub(crate) vitals: &'t Vitals,
}

/// The haptic loop over a board's encoders `E`, amplifiers `A` and clock `C`,
/// with a window of `D × D` tiles.
pub struct HapticLoop<'t, E, A: Amplifiers, C, const D: usize> {
    haptics: Haptics<'t, D>,
    ends: LoopEnds<'t>,
    encoders: E,
    /// `None` only while the amplifiers change state.
    power: Option<Power<A>>,
    clock: C,
    timing: Timing,
    feed: Feed,
    /// The last tick's, kept in its place so that it need not be copied.
    outcome: Outcome,
    liveness: Liveness,
    reporter: Reporter,
    /// An answer that found the queue full; nothing else happens before it is out.
    unsent: Option<Record>,
}

impl<'t, E, A, C, const D: usize> HapticLoop<'t, E, A, C, D>
where
    E: Encoders,
    A: Amplifiers,
    C: TickClock,
{
    pub(crate) fn new(
        haptics: Haptics<'t, D>,
        ends: LoopEnds<'t>,
        encoders: E,
        amplifiers: A,
        clock: C,
    ) -> Self {
        Self {
            haptics,
            ends,
            encoders,
            power: Some(Power::Off(amplifiers)),
            clock,
            timing: Timing::new::<C>(),
            feed: Feed::Nothing,
            outcome: Outcome::default(),
            liveness: Liveness::new(rate::<C>()),
            reporter: Reporter::new(rate::<C>()),
            unsent: None,
        }
    }

    /// The board's encoders, for whoever feeds them from outside.
    pub fn encoders_mut(&mut self) -> &mut E {
        &mut self.encoders
    }
}

impl<'t, E, A, C, const D: usize> HapticLoop<'t, E, A, C, D>
where
    E: Encoders,
    A: Amplifiers,
    C: TickClock,
    Haptics<'t, D>: FastTick,
{
    /// One tick. Returns what the amplifiers were left with.
    pub fn tick(&mut self) -> Drive {
        let began = self.timing.begin(&mut self.clock);
        self.ends.vitals.count_tick();
        self.ends.vitals.check_in(Part::Tick);
        if let Some(record) = self.unsent.take() {
            self.answer(record);
            return Drive::default();
        }
        self.take_commands();
        let drive = self.feel();
        if self.timing.end(&self.clock, began) {
            self.give_to_haptics(Command::Trip(Fault::TickOverrun));
        }
        drive
    }

    fn take_commands(&mut self) {
        if let Some(mechanism) = self.ends.settings.dequeue() {
            self.haptics.configure(mechanism);
        }
        for _ in 0..COMMANDS_PER_TICK {
            let Some(command) = self.ends.commands.dequeue() else {
                return;
            };
            match &command {
                Command::Scene(scene) if scene.source == Source::Encoders => self.feed = Feed::Arm,
                Command::Scene(_) => self.feed = Feed::Points { pending: false },
                Command::DropScene => self.feed = Feed::Nothing,
                Command::Point(_) => self.feed = Feed::Points { pending: true },
                _ => {}
            }
            self.give_to_haptics(command);
        }
    }

    fn give_to_haptics(&mut self, command: Command<'t>) {
        if let Some(tile) = self.haptics.accept(command) {
            // The queue has room for every buffer there is.
            let _ = self.ends.spent.enqueue(tile);
        }
    }

    fn feel(&mut self) -> Drive {
        let live = self.liveness.tick(self.ends.vitals.fed());
        match self.feed {
            Feed::Arm | Feed::Nothing => self.feel_arm(live),
            Feed::Points { pending } => self.feel_point(pending),
        }
    }

    fn feel_arm(&mut self, watchdog_live: bool) -> Drive {
        let sense = self.encoders.sense();
        self.haptics
            .tick_fast(&sense, watchdog_live, &mut self.outcome);
        let drive = self.outcome.drive;
        self.drive(&drive);
        if self.feed == Feed::Arm && self.reporter.records_this(&self.outcome.sample) {
            if self.ends.records.ready() {
                self.timing.fill(&mut self.outcome.sample);
                // There is room.
                let _ = self.ends.records.enqueue(Record {
                    sample: self.outcome.sample,
                    answers: None,
                });
            } else {
                self.ends.vitals.count_dropped();
            }
        }
        self.report(&sense, &drive);
        drive
    }

    /// Tells where the loop stands, when something has changed and now and
    /// then. Where there is no room it is told in the next tick.
    fn report(&mut self, sense: &Sense, drive: &Drive) {
        let report = self.haptics.report();
        if self.reporter.reports_this(&report) && self.ends.healths.ready() {
            let health = self.haptics.health(sense, drive);
            // There is room.
            let _ = self.ends.healths.enqueue(health);
            self.reporter.reported(&report);
        }
    }

    fn feel_point(&mut self, pending: bool) -> Drive {
        let drive = Drive::default();
        self.drive(&drive);
        if !pending {
            return drive;
        }
        let sense = Sense::default();
        self.haptics.tick_fast(&sense, false, &mut self.outcome);
        self.report(&sense, &drive);
        let mut outcome = self.outcome;
        self.timing.fill(&mut outcome.sample);
        let record = Record {
            sample: outcome.sample,
            answers: outcome.answers,
        };
        if outcome.answers.is_some() {
            self.feed = Feed::Points { pending: false };
            self.answer(record);
        } else {
            // Only tells the link what holds the point up: the next will, too.
            let _ = self.ends.records.enqueue(record);
        }
        drive
    }

    /// Sends an answer on, or keeps it for the next tick: answers are not lost.
    fn answer(&mut self, record: Record) {
        self.unsent = self.ends.records.enqueue(record).err();
    }

    /// Brings the amplifiers to what the tick asks for.
    fn drive(&mut self, drive: &Drive) {
        let power = self.power.take().map(|power| match (power, drive.enabled) {
            (Power::Off(off), false) => Power::Off(off),
            (Power::On(on), false) => Power::Off(on.disable()),
            (Power::Off(off), true) => Power::On(written(off.enable(), drive)),
            (Power::On(on), true) => Power::On(written(on, drive)),
        });
        // An assignment would drop what is there, which is nothing; but with it
        // the drivers' destructors, which can panic, would be part of the tick.
        mem::forget(mem::replace(&mut self.power, power));
    }
}

fn written<A: EnabledAmplifiers>(mut amplifiers: A, drive: &Drive) -> A {
    amplifiers.write(drive.currents_a.to_array());
    amplifiers
}

#[cfg(test)]
mod tests;
