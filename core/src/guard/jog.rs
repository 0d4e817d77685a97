//! A jog: a small current in one motor for a limited time, with nothing else driven. It shows which
//! joint a motor turns, and in which direction, before any force is rendered.
//!
//! A jog is armed like a scene: nothing may block it, and the dead-man switch must be pressed after
//! the command. The current then ramps up over 2 s, stays for the jog's time, and fades out over
//! 0.1 s; after that the arm is disarmed. There is no contact and no compensation of the arm's
//! weight: the hand holds only the arm and this one motor.
//!
//! All other checks of the guard stay active, with three more: no joint may move faster than
//! [`MAX_JOG_SPEED_RAD_S`] or farther than [`MAX_JOG_ROTATION_RAD`], whichever motor really turns
//! it ([`Fault::JogRanAway`]), and at half the current the joint's encoder must have moved
//! ([`Fault::NoMotion`]).

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::Fault;
use crate::phantom::{Calibration, Kinematics};
use crate::rate::TickRate;

/// Maximum current of a jog, as a share of the motor's continuous current: 0.31 A on a Premium 1.5,
/// some 0.4 N at its tip.
pub const JOG_SHARE: f32 = 0.25;
/// Maximum time at full current, ms.
pub const JOG_MAX_MS: u16 = 5_000;
/// Maximum speed of a joint during a jog, rad/s: 0.2 m/s at the tip of a Premium 1.5. Measured over
/// one millisecond, to within a count.
pub const MAX_JOG_SPEED_RAD_S: f32 = 1.0;
/// Maximum rotation of a joint during a jog, rad: some 40 mm at the tip of a Premium 1.5.
pub const MAX_JOG_ROTATION_RAD: f32 = 0.2;
/// Counts that the joint's encoder must exceed by half the current: an encoder with one dead
/// channel still alternates by one count.
const STILL_COUNTS: f32 = 1.0;

/// A host's request for a current in one motor for a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Jog {
    /// The axis, 0 to 2: one of the board's three commands.
    pub axis: u8,
    /// The amplifier's current, A, independent of the motor's sign in the calibration. At most
    /// [`JOG_SHARE`] of the continuous current in either direction.
    pub current_a: f32,
    /// Time at full current, ms; at most [`JOG_MAX_MS`].
    pub hold_ms: u16,
}

impl Jog {
    /// Returns true if a device with this calibration record accepts the jog unchanged.
    #[must_use]
    pub fn is_valid(&self, record: &Calibration) -> bool {
        let max_a = JOG_SHARE * record.continuous_current_a;
        let max_a = max_a.to_array().get(usize::from(self.axis)).copied();
        max_a.is_some_and(|max_a| self.current_a.abs() <= max_a) && self.hold_ms <= JOG_MAX_MS
    }
}

/// A jog in progress.
#[derive(Clone, Copy, Debug)]
pub(super) struct ActiveJog {
    /// The axis' unit vector.
    axis: Vec3,
    /// The full current of each axis, A; zero except for this one.
    full_a: Vec3,
    /// Ticks at full current that are left.
    left: u32,
    /// Joint angles when the amplifiers were switched on.
    from_rad: Option<Vec3>,
    /// True if the axis' encoder has moved since.
    moved: bool,
}

impl ActiveJog {
    /// Creates a jog; an invalid axis or a current that is not a number results in no current.
    pub(super) fn new(jog: Jog, rate: TickRate) -> Self {
        let axis = Vec3::AXES.get(usize::from(jog.axis));
        let axis = axis.copied().unwrap_or(Vec3::ZERO);
        let full_a = match jog.current_a.is_finite() {
            true => axis * jog.current_a,
            false => Vec3::ZERO,
        };
        Self {
            axis,
            full_a,
            left: rate.ticks(u32::from(jog.hold_ms.min(JOG_MAX_MS))),
            from_rad: None,
            moved: false,
        }
    }

    /// Checks the counts that each encoder moved in a reading (`hz` a second), at the joints'
    /// angles and the share `gain` of the current. Returns the fault, if any.
    pub(super) fn check(
        &mut self,
        moved: [i32; 3],
        hz: f32,
        mechanism: &Kinematics,
        angles_rad: Vec3,
        gain: f32,
    ) -> Option<Fault> {
        let per_count = mechanism.radians_per_count().abs();
        let moved = Vec3::from_array(moved.map(|counts| counts as f32)).abs();
        // A reading may be off by a count.
        let fast = (moved - Vec3::ONE) * per_count * hz;
        let from = *self.from_rad.get_or_insert(angles_rad);
        let rotation = (angles_rad - from).abs();
        let within = fast.cmple(Vec3::splat(MAX_JOG_SPEED_RAD_S))
            & rotation.cmple(Vec3::splat(MAX_JOG_ROTATION_RAD));
        if !within.all() {
            return Some(Fault::JogRanAway);
        }
        // Angles are whole counts, apart from rounding.
        self.moved |= (rotation / per_count).dot(self.axis) > STILL_COUNTS + 0.5;
        (gain >= 0.5 && !self.moved).then_some(Fault::NoMotion)
    }

    /// Returns a tick's currents, A, with the share `gain`, clamped to a jog's limit.
    pub(super) fn currents_a(&self, continuous_a: Vec3, gain: f32) -> Vec3 {
        let max_a = JOG_SHARE * continuous_a;
        self.full_a.clamp(-max_a, max_a) * gain
    }

    /// Counts a tick at full current. Returns true if the jog's time is over.
    pub(super) fn count_hold_tick(&mut self) -> bool {
        self.left = self.left.saturating_sub(1);
        self.left == 0
    }
}

#[cfg(test)]
#[path = "jog_tests.rs"]
mod tests;
