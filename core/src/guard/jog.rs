//! A jog: one motor is given a small current for a limited time, and nothing else is
//! driven. It shows which joint a motor turns, and which way, before any force is rendered.
//!
//! A jog goes through arming as a scene does: nothing may block it, and the dead-man
//! switch has to be pressed after the command. The current then comes in over 2 s,
//! stays for the jog's time, and goes out over 0.1 s; after that the arm is disarmed.
//! There is no contact and no compensation of the arm's weight: what a person holds in
//! the hand is the arm and this one motor.
//!
//! All other checks of the guard stay, and three of its own come on top: no joint may
//! move faster than [`FAST_RAD_S`] or farther than [`FAR_RAD`], whichever motor it is
//! that really turns it ([`Fault::JogRanAway`]), and at half the current the joint's
//! encoder must have moved ([`Fault::NoMotion`]).

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::Fault;
use crate::phantom::{Calibration, Kinematics};
use crate::rate::TickRate;

/// Most current of a jog, as a share of what the motor can bear for ever: 0.31 A on a
/// Premium 1.5, some 0.4 N at its tip.
pub const JOG_SHARE: f32 = 0.25;
/// Longest time at full current, ms.
pub const JOG_MOST_MS: u16 = 5_000;
/// Fastest that a joint may turn during a jog, rad/s: 0.2 m/s at the tip of a
/// Premium 1.5. Read from one millisecond to the next, to within a count.
pub const FAST_RAD_S: f32 = 1.0;
/// Farthest that a joint may turn during a jog, rad: some 40 mm at the tip of a
/// Premium 1.5.
pub const FAR_RAD: f32 = 0.2;
/// By half the current the joint's encoder has moved by more than this, counts: with
/// one of its two channels dead an encoder still goes one up and one down.
const STILL_COUNTS: f32 = 1.0;

/// A host's request: a current in one motor for a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Jog {
    /// The axis, 0 to 2: which of the board's three commands.
    pub axis: u8,
    /// The current that the amplifier is asked for, A, whatever the record says of the
    /// motor's sign. At most [`JOG_SHARE`] of the continuous current either way.
    pub current_a: f32,
    /// Duration at full current, ms; at most [`JOG_MOST_MS`].
    pub hold_ms: u16,
}

impl Jog {
    /// Returns true if a device with this record accepts it unchanged.
    #[must_use]
    pub fn is_valid(&self, record: &Calibration) -> bool {
        let most = JOG_SHARE * record.continuous_current_a;
        let most = most.to_array().get(usize::from(self.axis)).copied();
        most.is_some_and(|most| self.current_a.abs() <= most) && self.hold_ms <= JOG_MOST_MS
    }
}

/// A jog under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct JogRun {
    /// The axis' unit vector.
    axis: Vec3,
    /// The full current of each axis, A: of this one alone.
    full_a: Vec3,
    /// Ticks at full current that are left.
    left: u32,
    /// Joint angles when the amplifiers came on.
    from_rad: Option<Vec3>,
    /// True if the axis' encoder has moved since.
    moved: bool,
}

impl JogRun {
    /// An axis that there is not has no current, nor has what is not a number.
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
            left: rate.ticks(u32::from(jog.hold_ms.min(JOG_MOST_MS))),
            from_rad: None,
            moved: false,
        }
    }

    /// Takes the counts that each encoder moved in a reading (`hz` a second), the
    /// joints' angles and the share of the current that flows. What the jog may not do.
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
        // A reading is a count off at most.
        let fast = (moved - Vec3::ONE) * per_count * hz;
        let from = *self.from_rad.get_or_insert(angles_rad);
        let way = (angles_rad - from).abs();
        let within = fast.cmple(Vec3::splat(FAST_RAD_S)) & way.cmple(Vec3::splat(FAR_RAD));
        if !within.all() {
            return Some(Fault::JogRanAway);
        }
        // Angles are whole counts but for their rounding.
        self.moved |= (way / per_count).dot(self.axis) > STILL_COUNTS + 0.5;
        (gain >= 0.5 && !self.moved).then_some(Fault::NoMotion)
    }

    /// A tick's currents, A, with the share `gain` let through; no larger than a jog
    /// may be.
    pub(super) fn currents_a(&self, continuous_a: Vec3, gain: f32) -> Vec3 {
        let most = JOG_SHARE * continuous_a;
        self.full_a.clamp(-most, most) * gain
    }

    /// One tick at full current. Whether the jog's time is over.
    pub(super) fn hold(&mut self) -> bool {
        self.left = self.left.saturating_sub(1);
        self.left == 0
    }
}

#[cfg(test)]
#[path = "jog_tests.rs"]
mod tests;
