//! The checks of a tick's inputs, before anything is driven.

use super::{Fault, Guard, GuardInputs, Limits, Mode, Surroundings};

impl Guard {
    /// Checks every input of a tick before anything is driven. Returns true if the encoders lost
    /// counts, so that the arm must be zeroed again.
    pub fn watch(&mut self, sense: &GuardInputs, around: &Surroundings<'_>) -> bool {
        self.limits = Limits::empty();
        // Before the arm is zeroed, neither its position nor a jump has a meaning.
        let jumped = around.zeroed && self.has_jumped(sense.counts);
        if jumped {
            self.trip(Fault::EncoderJump);
        }
        if !around.zeroed || jumped {
            self.counts = None;
        }
        let is_on = self.mode().is_driving();
        if let Some(fault) = self.feedback.check(sense, self.currents_a, is_on) {
            self.trip(fault);
        }
        // A jog ends when its arming ends.
        if self.mode() == Mode::Disarmed {
            self.jog = None;
        }
        if self.motors.too_hot {
            self.trip(Fault::MotorTooHot);
        }
        if self.mode().is_driving() {
            self.watch_driven(sense, around);
        }
        if !self.mode().is_driving() {
            self.watch_undriven(sense, around);
        }
        jumped
    }

    /// Returns true if an encoder moved farther than the arm can.
    fn has_jumped(&mut self, counts: [i32; 3]) -> bool {
        let max_counts = self.max_counts;
        let jumped = self.counts.is_some_and(|last| {
            let mut axes = last.iter().zip(counts);
            axes.any(|(a, b)| a.abs_diff(b) > max_counts)
        });
        self.counts = Some(counts);
        jumped
    }

    fn watch_driven(&mut self, sense: &GuardInputs, around: &Surroundings<'_>) {
        if let Some(fault) = self.find_fault(sense, around) {
            return self.trip(fault);
        }
        if !sense.dead_man {
            match self.mode() {
                // The host disarmed first.
                Mode::Fading => self.stop(),
                _ => self.trip(Fault::DeadManReleased),
            }
        }
    }

    fn watch_undriven(&mut self, sense: &GuardInputs, around: &Surroundings<'_>) {
        // Nothing is commanded: only a measured current can flow.
        self.motors.advance_off(self.feedback.measured_a());
        self.feedback.reset_off(sense);
        self.hold.count_tick();
        self.speed.restart(sense.counts);
        let blockers = self.find_blockers(sense, around);
        self.arming.advance_off(blockers, sense.dead_man);
        self.blockers = blockers | self.arming.user_blockers(sense.dead_man);
    }
}
