//! The checks of a tick's inputs, before anything is driven.

use super::speed::SpeedCheck;
use super::{Blockers, Fault, Guard, GuardInputs, Limits, Mode, SceneKind, Surroundings};

impl Guard {
    /// Checks every input of a tick before anything is driven. Returns whether the
    /// encoders lost counts, so that the arm has to be zeroed again.
    pub fn watch(&mut self, sense: &GuardInputs, around: &Surroundings<'_>) -> bool {
        self.limits = Limits::empty();
        // Before the arm is zeroed its position means nothing, nor does a jump.
        let jumped = around.zeroed && self.has_jumped(sense.counts);
        if jumped {
            self.trip(Fault::EncoderJump);
        }
        if !around.zeroed || jumped {
            self.counts = None;
        }
        let is_on = self.mode().drives();
        if let Some(fault) = self.feedback.check(sense, self.currents_a, is_on) {
            self.trip(fault);
        }
        // A jog does not outlive its arming.
        if self.mode() == Mode::Disarmed {
            self.jog = None;
        }
        if self.motors.too_hot {
            self.trip(Fault::MotorTooHot);
        }
        if self.mode().drives() {
            self.watch_driven(sense, around);
        }
        if !self.mode().drives() {
            self.watch_undriven(sense, around);
        }
        jumped
    }

    /// Returns true if an encoder moved farther than it can.
    fn has_jumped(&mut self, counts: [i32; 3]) -> bool {
        let most = self.max_counts;
        let jumped = self.counts.is_some_and(|last| {
            let mut axes = last.iter().zip(counts);
            axes.any(|(a, b)| a.abs_diff(b) > most)
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
                // The host let go first.
                Mode::Fading => self.stop(),
                _ => self.trip(Fault::DeadManReleased),
            }
        }
    }

    /// The first fault that may not be while the amplifiers are on.
    fn find_fault(&mut self, sense: &GuardInputs, around: &Surroundings<'_>) -> Option<Fault> {
        let Some((mechanism, pose)) = around.arm else {
            return Some(Fault::CalibrationCorrupt);
        };
        if sense.emergency_stop {
            return Some(Fault::EmergencyStop);
        }
        if sense.hardware_failed {
            return Some(Fault::Hardware);
        }
        if sense.outputs_not_as_set {
            return Some(Fault::OutputsNotAsSet);
        }
        if self.feedback.is_unready(sense) {
            return Some(Fault::AmplifierNotReady);
        }
        if !around.watchdog_live {
            return Some(Fault::TaskStalled);
        }
        if !self.stops.each_allows(pose.angles()) {
            return Some(Fault::JointLimit);
        }
        if !self.stops.linkage_allows(pose.angles()) {
            return Some(Fault::Linkage);
        }
        match self.speed.check(sense.counts, mechanism, pose) {
            SpeedCheck::NotYet => None,
            SpeedCheck::TooFast => Some(Fault::TooFast),
            SpeedCheck::Moved(moved) => {
                let bearable = self.motors.continuous_a;
                let in_vain = self.stall.check(moved, self.currents_a, bearable);
                let (hz, gain) = (self.speed.hz, self.arming.gain);
                let jogged = self.jog.as_mut();
                let jogged =
                    jogged.and_then(|jog| jog.check(moved, hz, mechanism, pose.angles(), gain));
                in_vain.then_some(Fault::NoMotion).or(jogged)
            }
        }
    }

    fn watch_undriven(&mut self, sense: &GuardInputs, around: &Surroundings<'_>) {
        // Nothing is commanded: what flows all the same is what was measured.
        self.motors.rest(self.feedback.measured_a());
        self.feedback.rest(sense);
        self.hold.pass();
        self.speed.restart(sense.counts);
        let blockers = self.find_blockers(sense, around);
        self.arming.wait(blockers, sense.dead_man);
        self.blockers = blockers | self.arming.user_blockers(sense.dead_man);
    }

    /// Returns the blockers of arming, besides those of the user.
    fn find_blockers(&self, sense: &GuardInputs, around: &Surroundings<'_>) -> Blockers {
        let outside = around.arm.is_some_and(|(_, pose)| {
            let q = pose.angles();
            !(self.stops.each_allows(q) && self.stops.linkage_allows(q))
        });
        let bits = [
            (around.arm.is_none(), Blockers::NO_CALIBRATION),
            (!around.zeroed, Blockers::NOT_ZEROED),
            // A jog takes the place of a scene.
            (
                around.scene == SceneKind::None && self.jog.is_none(),
                Blockers::NO_SCENE,
            ),
            (around.scene == SceneKind::Points, Blockers::REPLAY),
            (self.fault.is_some(), Blockers::FAULT_LATCHED),
            (sense.emergency_stop, Blockers::EMERGENCY_STOP),
            (sense.hardware_failed, Blockers::HARDWARE),
            (sense.outputs_not_as_set, Blockers::OUTPUTS_NOT_AS_SET),
            (sense.amplifier_not_ready, Blockers::AMPLIFIER_NOT_READY),
            (outside, Blockers::OUTSIDE_LIMITS),
            (!around.watchdog_live, Blockers::WATCHDOG_NOT_LIVE),
        ];
        let set = bits.into_iter().filter(|(is, _)| *is);
        set.fold(Blockers::empty(), |all, (_, bit)| all | bit)
    }
}
