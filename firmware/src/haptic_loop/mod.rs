//! The haptic loop, which the timer interrupt calls 1,000 to 10,000 times a second.
//!
//! It does only I/O and book-keeping around [`Haptics::tick_into`]: it applies the link's commands,
//! reads the encoders, runs the tick, writes the amplifiers, queues a record and measures the time.
//! All its work is bounded, and it never waits.

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
use crate::monitor::WatchedPart;
use crate::motor_memory::{MotorLog, Words};
use crate::queues::{LoopEnds, LoopReport, QueuedTick};
use clutch_input::ClutchInput;
use liveness::Liveness;
use mark_pulse::Mark;
use reporter::Reporter;
use timing::Timing;

/// Maximum number of commands applied in one tick; the rest wait for the next.
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
    /// The last tick's outcome, written in place to avoid a copy.
    outcome: Outcome,
    liveness: Liveness,
    reporter: Reporter,
    mark: Mark,
    motor_log: MotorLog,
    /// An answer for which the queue had no room. No other tick is rendered before it is queued.
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

    /// Returns the board's encoders, for a caller that sets them.
    pub fn encoders_mut(&mut self) -> &mut E {
        &mut self.encoders
    }

    /// Runs one tick. Returns the outputs to which the amplifiers were set.
    pub fn tick(&mut self) -> GuardOutputs {
        let began = self.timing.begin(&mut self.clock);
        if began.after_gap {
            // Before all else: the force of the last tick has acted for too long.
            self.drive(&GuardOutputs::default());
            self.apply_command(Command::Trip(Fault::TickGap));
        }
        self.ends.monitor.count_tick();
        self.ends.monitor.check_in(WatchedPart::Tick);
        let live = self.liveness.tick(self.ends.monitor.fed());
        let drive = match self.unsent.take() {
            Some(record) => {
                self.answer(record);
                self.monitor_arm(live)
            }
            None => {
                self.drain_commands();
                self.render(live)
            }
        };
        self.mark.tick(self.outcome.sample.tick);
        if self.timing.end(&self.clock, began) {
            self.apply_command(Command::Trip(Fault::TickOverrun));
        }
        drive
    }

    /// Returns the state to keep across a reset, if any: the index and the content of one of the
    /// two copies of the motors' temperatures. Call it after each tick.
    pub fn due_motor_copy(&mut self) -> Option<(usize, Words)> {
        self.motor_log.tick(&self.haptics.temperatures())
    }

    /// Returns the new level of the mark pin, if this tick changes it.
    #[must_use]
    pub const fn mark_edge(&self) -> Option<bool> {
        self.mark.edge()
    }

    /// Returns the current calibration.
    #[must_use]
    pub fn calibration(&self) -> Option<&Calibration> {
        self.haptics.calibration()
    }

    /// Returns the temperatures of the motors by the thermal model.
    #[must_use]
    pub const fn temperatures(&self) -> Temperatures {
        self.haptics.temperatures()
    }

    fn drain_commands(&mut self) {
        if let Some(mechanism) = self.ends.settings.dequeue() {
            self.haptics.configure(mechanism);
        }
        for _ in 0..COMMANDS_PER_TICK {
            let Some(command) = self.ends.commands.dequeue() else {
                return;
            };
            match &command {
                Command::Scene(scene) => {
                    set_materials(&mut self.haptics, &mut self.ends, scene);
                }
                Command::Mark(number) => self.mark.begin(*number),
                _ => {}
            }
            self.apply_command(command);
        }
    }

    fn apply_command(&mut self, command: Command<'t>) {
        // A refused scene needs no handling: the loop then has no scene, and the guard reports
        // that.
        if let Ok(Some(tile)) = self.haptics.accept(command) {
            // The queue has room for all buffers.
            let _ = self.ends.spent.enqueue(tile);
        }
        self.return_spares();
    }

    /// Returns the buffers that the window no longer needs.
    fn return_spares(&mut self) {
        while let Some(tile) = self.haptics.take_spare() {
            let _ = self.ends.spent.enqueue(tile);
        }
    }

    fn render(&mut self, watchdog_live: bool) -> GuardOutputs {
        match self.haptics.source() {
            HipSource::Encoders | HipSource::None => self.render_arm(watchdog_live),
            HipSource::Points { pending: true } => self.render_point(watchdog_live),
            HipSource::Points { pending: false } => self.monitor_arm(watchdog_live),
        }
    }

    /// Runs the pure tick. Not inlined: its code is most of an image, which contains it once.
    #[inline(never)]
    fn run_tick(&mut self, sense: &GuardInputs, watchdog_live: bool) {
        self.haptics
            .tick_into(sense, watchdog_live, &mut self.outcome);
    }

    fn render_arm(&mut self, watchdog_live: bool) -> GuardOutputs {
        let sense = self.encoders.sense();
        if let Some(held) = self.clutch_input.tick(sense.clutch) {
            self.apply_command(Command::ClutchInput(held));
        }
        let view = self.outcome.sample.view;
        self.run_tick(&sense, watchdog_live);
        let drive = self.outcome.drive;
        self.drive(&drive);
        if self.outcome.sample.view != view {
            // A placement has changed in this tick, and left the fallback of the one before.
            self.return_spares();
        }
        let is_rendered = self.haptics.source() == HipSource::Encoders;
        if is_rendered && self.reporter.is_sample_due(&self.outcome.sample) {
            let record = self.record(None);
            if self.ends.records.enqueue(record).is_err() {
                self.ends.monitor.count_dropped();
            }
        }
        self.report(&sense, &drive);
        drive
    }

    /// Renders the current point. Also reads the encoders, because the arm may be moved meanwhile.
    fn render_point(&mut self, watchdog_live: bool) -> GuardOutputs {
        let drive = GuardOutputs::default();
        self.drive(&drive);
        let sense = self.encoders.sense();
        self.run_tick(&sense, watchdog_live);
        self.report(&sense, &drive);
        let record = self.record(self.outcome.answered_seq);
        if record.answered_seq.is_some() {
            self.answer(record);
        } else {
            // It only reports which tile the point lacks; the next record repeats that.
            let _ = self.ends.records.enqueue(record);
        }
        drive
    }

    /// Runs a tick of a replay without a point: nothing is rendered, and the arm is monitored.
    fn monitor_arm(&mut self, watchdog_live: bool) -> GuardOutputs {
        let drive = GuardOutputs::default();
        self.drive(&drive);
        let sense = self.encoders.sense();
        self.haptics.monitor(&sense, watchdog_live);
        self.report(&sense, &drive);
        drive
    }

    fn record(&mut self, answered_seq: Option<u32>) -> QueuedTick {
        self.timing.fill(&mut self.outcome.sample);
        QueuedTick {
            sample: self.outcome.sample,
            answered_seq,
        }
    }

    /// Reports the guard's state, at once after a change and ten times a second. If the queue is
    /// full, the next tick reports.
    fn report(&mut self, sense: &GuardInputs, drive: &GuardOutputs) {
        let (report, marked) = (self.haptics.report(), self.mark.latest());
        if self.reporter.is_report_due(&report, marked.number) && self.ends.health.ready() {
            let health = self.haptics.health(sense, drive);
            let epoch = self.haptics.epoch();
            // `ready` has found room.
            let _ = self.ends.health.enqueue(LoopReport {
                health,
                epoch,
                marked,
            });
            self.reporter.mark_reported(&report, marked.number);
        }
    }

    /// Sends an answer, or keeps it for the next tick: answers are never lost.
    fn answer(&mut self, record: QueuedTick) {
        self.unsent = self.ends.records.enqueue(record).err();
    }

    /// Sets the amplifiers to the outputs of the tick.
    fn drive(&mut self, drive: &GuardOutputs) {
        let power = self.power.take().map(|power| match (power, drive.enabled) {
            (Power::Off(off), false) => Power::Off(write_held(off, drive)),
            (Power::On(on), false) => Power::Off(on.disable()),
            (Power::Off(off), true) => Power::On(write_currents(off.enable(), drive)),
            (Power::On(on), true) => Power::On(write_currents(on, drive)),
        });
        // An assignment would drop the old value. That is `None`, but the drivers' destructors,
        // which can panic, would become part of the tick.
        mem::forget(mem::replace(&mut self.power, power));
    }
}

/// Sets the table of a scene with materials, if the queued table is this scene's. It may be a later
/// scene's if this scene continues with the previous table.
fn set_materials<const D: usize>(
    haptics: &mut Haptics<'_, D>,
    ends: &mut LoopEnds<'_>,
    scene: &Scene,
) {
    if let (Some(sum), Some(table)) = (scene.materials, ends.materials.peek())
        && table.check_sum() == sum
    {
        haptics.set_materials(table);
        // The table stays in the queue until it is copied.
        drop(ends.materials.dequeue());
    }
}

fn write_currents<A: EnabledAmplifiers>(mut amplifiers: A, drive: &GuardOutputs) -> A {
    amplifiers.write(drive.currents_a.to_array());
    amplifiers
}

fn write_held<A: Amplifiers>(mut amplifiers: A, drive: &GuardOutputs) -> A {
    amplifiers.set_held_outputs(drive.held.to_array());
    amplifiers
}

#[cfg(test)]
mod tests;
