//! Blockers of arming, while the amplifiers are off.

use super::{Blockers, Guard, GuardInputs, SceneKind, Surroundings};

impl Guard {
    /// Returns the blockers of arming, without those of `Arming::user_blockers`.
    pub(super) fn find_blockers(&self, sense: &GuardInputs, around: &Surroundings<'_>) -> Blockers {
        let outside = around.arm.is_some_and(|(_, pose)| {
            let q = pose.angles();
            !(self.stops.contains_joints(q) && self.stops.contains_linkage(q))
        });
        let bits = [
            (around.arm.is_none(), Blockers::NO_CALIBRATION),
            (!around.zeroed, Blockers::NOT_ZEROED),
            // A jog replaces a scene.
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
