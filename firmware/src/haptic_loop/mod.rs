//! The haptic loop, which the timer interrupt calls 1,000 to 10,000 times a second.
//!
//! It does only I/O and book-keeping around [`Haptics::tick_into`]: take what the
//! link brought, read the encoders, tick, write the amplifiers, leave a record,
//! measure what that cost. Everything it does is bounded and nothing waits.

mod clutch_input;
mod liveness;
mod mark_pulse;
mod reporter;
mod timing;

use core::mem;

use hapterra_core::guard::thermal::Temperatures;
use hapterra_core::guard::{Fault, GuardInputs, GuardOutputs};
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::Scene;
use hapterra_core::tick::{Command, Haptics, HipSource, Outcome};

use crate::board::{Amplifiers, EnabledAmplifiers, Encoders, TickClock};
use crate::monitor::Part;
use crate::motor_memory::{MotorLog, Words};
use crate::queues::{LoopEnds, LoopReport, QueuedTick};
use clutch_input::ClutchInput;
use liveness::Liveness;
use mark_pulse::Mark;
use reporter::Reporter;
use timing::Timing;

/// The most commands taken in one tick; the rest wait for the next.
const COMMANDS_PER_TICK: usize = 4;

/// The amplifiers in either of their states.
enum Power<A: Amplifiers> {
    Off(A),
    On(A::Enabled),
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
    clutch_input: ClutchInput,
    /// The last tick's outcome, kept in its place so that it need not be copied.
    outcome: Outcome,
    liveness: Liveness,
    reporter: Reporter,
    mark: Mark,
    motor_log: MotorLog,
    /// An answer that found the queue full. No other tick runs before it is out.
    unsent: Option<QueuedTick>,
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
            clutch_input: ClutchInput::new(C::RATE),
            outcome: Outcome::default(),
            liveness: Liveness::new(C::RATE),
            reporter: Reporter::new(C::RATE),
            mark: Mark::new(C::RATE),
            motor_log: MotorLog::new(C::RATE),
            unsent: None,
        }
    }

    /// Gives access to the board's encoders, for a caller that sets them.
    pub fn encoders_mut(&mut self) -> &mut E {
        &mut self.encoders
    }

    /// Runs one tick. Returns what the amplifiers were left with.
    pub fn tick(&mut self) -> GuardOutputs {
        let began = self.timing.begin(&mut self.clock);
        if began.after_gap {
            // First of all: the force of the last tick has acted for too long already.
            self.drive(&GuardOutputs::default());
            self.give_to_haptics(Command::Trip(Fault::TickGap));
        }
        self.ends.monitor.count_tick();
        self.ends.monitor.check_in(Part::Tick);
        let live = self.liveness.tick(self.ends.monitor.fed());
        let drive = match self.unsent.take() {
            Some(record) => {
                self.answer(record);
                self.follow_arm(live)
            }
            None => {
                self.take_commands();
                self.render(live)
            }
        };
        self.mark.tick(self.outcome.sample.tick);
        if self.timing.end(&self.clock, began) {
            self.give_to_haptics(Command::Trip(Fault::TickOverrun));
        }
        drive
    }

    /// Returns the state to keep over a reset after this tick, if any: a copy of the
    /// motors' temperatures, and which of the two it is. Called after each tick.
    pub fn motors_to_keep(&mut self) -> Option<(usize, Words)> {
        self.motor_log.tick(&self.haptics.temperatures())
    }

    /// The level that the mark pin changes to after this tick, if it does.
    #[must_use]
    pub const fn mark_edge(&self) -> Option<bool> {
        self.mark.edge()
    }

    /// The calibration in force.
    #[must_use]
    pub fn calibration(&self) -> Option<&Calibration> {
        self.haptics.calibration()
    }

    /// Returns the temperatures of the motors by the thermal model.
    #[must_use]
    pub const fn temperatures(&self) -> Temperatures {
        self.haptics.temperatures()
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
                Command::Scene(scene) => {
                    take_materials(&mut self.haptics, &mut self.ends, scene);
                }
                Command::Mark(number) => self.mark.begin(*number),
                _ => {}
            }
            self.give_to_haptics(command);
        }
    }

    fn give_to_haptics(&mut self, command: Command<'t>) {
        // A refused scene is none: what is rendered follows from the scene in force alone, and the
        // guard says that there is none.
        if let Ok(Some(tile)) = self.haptics.accept(command) {
            // The queue has room for every buffer there is.
            let _ = self.ends.spent.enqueue(tile);
        }
    }

    fn render(&mut self, watchdog_live: bool) -> GuardOutputs {
        match self.haptics.source() {
            HipSource::Encoders | HipSource::None => self.render_arm(watchdog_live),
            HipSource::Points { pending: true } => self.render_point(watchdog_live),
            HipSource::Points { pending: false } => self.follow_arm(watchdog_live),
        }
    }

    /// Runs the pure tick. A function of its own, and there once: the tick's code
    /// is most of an image.
    #[inline(never)]
    fn run_tick(&mut self, sense: &GuardInputs, watchdog_live: bool) {
        self.haptics
            .tick_into(sense, watchdog_live, &mut self.outcome);
    }

    fn render_arm(&mut self, watchdog_live: bool) -> GuardOutputs {
        let sense = self.encoders.sense();
        if let Some(held) = self.clutch_input.tick(sense.clutch) {
            self.give_to_haptics(Command::ClutchInput(held));
        }
        self.run_tick(&sense, watchdog_live);
        let drive = self.outcome.drive;
        self.drive(&drive);
        let is_rendered = self.haptics.source() == HipSource::Encoders;
        if is_rendered && self.reporter.sends_sample(&self.outcome.sample) {
            let record = self.record(None);
            if self.ends.records.enqueue(record).is_err() {
                self.ends.monitor.count_dropped();
            }
        }
        self.report(&sense, &drive);
        drive
    }

    /// Renders the point under way. The encoders are read all the same: the arm may be
    /// moved meanwhile.
    fn render_point(&mut self, watchdog_live: bool) -> GuardOutputs {
        let drive = GuardOutputs::default();
        self.drive(&drive);
        let sense = self.encoders.sense();
        self.run_tick(&sense, watchdog_live);
        self.report(&sense, &drive);
        let record = self.record(self.outcome.answers);
        if record.answers.is_some() {
            self.answer(record);
        } else {
            // It only tells the link what holds the point up; the next one will, too.
            let _ = self.ends.records.enqueue(record);
        }
        drive
    }

    /// A tick of a replay without a point: nothing is rendered, and the arm is followed.
    fn follow_arm(&mut self, watchdog_live: bool) -> GuardOutputs {
        let drive = GuardOutputs::default();
        self.drive(&drive);
        let sense = self.encoders.sense();
        self.haptics.follow(&sense, watchdog_live);
        self.report(&sense, &drive);
        drive
    }

    fn record(&mut self, answers: Option<u32>) -> QueuedTick {
        self.timing.fill(&mut self.outcome.sample);
        QueuedTick {
            sample: self.outcome.sample,
            answers,
        }
    }

    /// Reports where the guard stands, at once when that has changed and ten times a
    /// second. Where the queue is full the next tick reports.
    fn report(&mut self, sense: &GuardInputs, drive: &GuardOutputs) {
        let (report, marked) = (self.haptics.report(), self.mark.latest());
        if self.reporter.sends_report(&report, marked.number) && self.ends.health.ready() {
            let health = self.haptics.health(sense, drive);
            let epoch = self.haptics.scene().map(|scene| scene.epoch);
            // There is room.
            let _ = self.ends.health.enqueue(LoopReport {
                health,
                epoch,
                marked,
            });
            self.reporter.sent_report(&report, marked.number);
        }
    }

    /// Sends an answer, or keeps it for the next tick: answers are never lost.
    fn answer(&mut self, record: QueuedTick) {
        self.unsent = self.ends.records.enqueue(record).err();
    }

    /// Brings the amplifiers to what the tick asks for.
    fn drive(&mut self, drive: &GuardOutputs) {
        let power = self.power.take().map(|power| match (power, drive.enabled) {
            (Power::Off(off), false) => Power::Off(rested(off, drive)),
            (Power::On(on), false) => Power::Off(on.disable()),
            (Power::Off(off), true) => Power::On(written(off.enable(), drive)),
            (Power::On(on), true) => Power::On(written(on, drive)),
        });
        // An assignment would drop what is there, which is nothing; but with it
        // the drivers' destructors, which can panic, would be part of the tick.
        mem::forget(mem::replace(&mut self.power, power));
    }
}

/// Hands the loop the table of a scene with materials, if it comes with one: a later scene's may
/// wait behind a scene that continues with the table before.
fn take_materials<const D: usize>(
    haptics: &mut Haptics<'_, D>,
    ends: &mut LoopEnds<'_>,
    scene: &Scene,
) {
    if let (Some(sum), Some(table)) = (scene.materials, ends.materials.peek())
        && table.check_sum() == sum
    {
        haptics.take_materials(table);
        // It stays in its place until it was copied.
        drop(ends.materials.dequeue());
    }
}

fn written<A: EnabledAmplifiers>(mut amplifiers: A, drive: &GuardOutputs) -> A {
    amplifiers.write(drive.currents_a.to_array());
    amplifiers
}

fn rested<A: Amplifiers>(mut amplifiers: A, drive: &GuardOutputs) -> A {
    amplifiers.rest(drive.held.to_array());
    amplifiers
}

#[cfg(test)]
mod tests;
