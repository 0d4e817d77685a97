//! The faults that end driving: conditions that are forbidden while the amplifiers are on.

use super::speed::SpeedCheck;
use super::{Fault, Guard, GuardInputs, Surroundings};

impl Guard {
    /// Returns the first fault that is present while the amplifiers are on.
    pub(super) fn find_fault(
        &mut self,
        sense: &GuardInputs,
        around: &Surroundings<'_>,
    ) -> Option<Fault> {
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
        if !self.stops.contains_joints(pose.angles()) {
            return Some(Fault::JointLimit);
        }
        if !self.stops.contains_linkage(pose.angles()) {
            return Some(Fault::Linkage);
        }
        match self.speed.check(sense.counts, mechanism, pose) {
            SpeedCheck::NotYet => None,
            SpeedCheck::TooFast => Some(Fault::TooFast),
            SpeedCheck::Moved(moved) => {
                let continuous_a = self.motors.continuous_a;
                let is_stalled = self.stall.check(moved, self.currents_a, continuous_a);
                let (hz, gain) = (self.speed.hz, self.arming.gain);
                let jogged = self.jog.as_mut();
                let jogged =
                    jogged.and_then(|jog| jog.check(moved, hz, mechanism, pose.angles(), gain));
                is_stalled.then_some(Fault::NoMotion).or(jogged)
            }
        }
    }
}
