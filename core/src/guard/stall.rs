//! A motor that pushes while its encoder does not move.
//!
//! Resting on a surface, that is how it should be, so a push against a
//! standing encoder is suspicious only in two cases:
//! - *All* encoders stand to the count for two seconds while a motor has more
//!   than its continuous current. No hand is that calm under such a force.
//! - *One* encoder stands, give or take a count, while its motor pushes and the
//!   other joints travel. A hand trembles by more than a count, so along a way
//!   that turns one joint only the others still move.

use glam::Vec3;

/// Readings (a millisecond each) that all encoders may stand under load.
const ALL_STILL: u32 = 2_000;
/// Counts that the other joints may travel together while one stands: about
/// 200 mm. Three times what a hand does that turns one joint only, at up to half
/// a metre a second, with a tremor of 0.2 mm (measured on the virtual Phantom);
/// and more than it does rubbing along a straight line without any.
pub const TRAVEL: u32 = 8_000;
/// A joint stands while it stays this near, in counts, to where it was: with one
/// of its two channels dead an encoder still goes one up and one down.
const BAND: u32 = 1;

/// Watches for motors that push in vain.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StallDetector {
    all_still: u32,
    /// Distance of each joint from where it began to stand.
    off: [i32; 3],
    /// Travel of the other joints since.
    others: [u32; 3],
}

impl StallDetector {
    /// Takes how far the encoders moved in a millisecond under these currents.
    /// True if a motor pushes and nothing comes of it.
    // It has one caller, and would be a call with copies of its arguments in every tick.
    #[inline(always)]
    pub(super) fn check(&mut self, moved: [i32; 3], currents_a: Vec3, continuous_a: Vec3) -> bool {
        let load = currents_a.abs();
        if load.cmple(0.5 * continuous_a).all() {
            *self = Self::default();
            return false;
        }
        let strained = load.cmpgt(continuous_a).any();
        let still = moved.iter().all(|moved| *moved == 0);
        self.all_still = if strained && still {
            self.all_still + 1
        } else {
            0
        };
        let way = moved.map(i32::unsigned_abs);
        let all = way.iter().fold(0, |sum: u32, w| sum.saturating_add(*w));
        let loaded = load.cmpgt(0.5 * continuous_a);
        let axes = self.off.iter_mut().zip(&mut self.others);
        for (axis, ((off, others), moved)) in axes.zip(moved).enumerate() {
            *off = off.saturating_add(moved);
            if loaded.test(axis) && off.unsigned_abs() <= BAND {
                *others = others.saturating_add(all - moved.unsigned_abs());
            } else {
                (*off, *others) = (0, 0);
            }
        }
        self.all_still > ALL_STILL || self.others.iter().any(|others| *others > TRAVEL)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONTINUOUS: Vec3 = Vec3::splat(1.24);

    fn ticks_until_found(moved: [i32; 3], currents_a: Vec3) -> Option<u32> {
        let mut detector = StallDetector::default();
        (1..10_000).find(|_| detector.check(moved, currents_a, CONTINUOUS))
    }

    #[test]
    fn resting_and_sliding_are_not_suspicious() {
        assert_eq!(ticks_until_found([0; 3], Vec3::splat(1.2)), None);
        assert_eq!(ticks_until_found([3, 1, -1], Vec3::splat(5.5)), None);
        // Along one joint only: the others do not push.
        assert_eq!(ticks_until_found([5, 0, 0], Vec3::new(3.0, 0.5, 0.0)), None);
    }

    #[test]
    fn all_encoders_dead_under_load() {
        assert_eq!(ticks_until_found([0; 3], Vec3::Y * 1.3), Some(2_001));
    }

    #[test]
    fn one_encoder_dead_while_its_motor_drives_the_arm_away() {
        let found = ticks_until_found([0, 0, -10], Vec3::Y * 0.7);
        assert_eq!(found, Some(801));
    }

    #[test]
    fn one_channel_dead_goes_up_and_down_by_a_count() {
        let mut detector = StallDetector::default();
        let found = (1..10_000).find(|i| {
            let moved = [-10, if i % 2 == 0 { 1 } else { -1 }, 0];
            detector.check(moved, Vec3::Y * 0.7, CONTINUOUS)
        });
        assert_eq!(found, Some(801));
    }

    #[test]
    fn a_joint_that_creeps_stands_only_for_a_while() {
        let mut detector = StallDetector::default();
        let found = (1..100_000).find(|i| {
            let moved = [-10, i32::from(i % 60 == 0), 0];
            detector.check(moved, Vec3::Y * 0.7, CONTINUOUS)
        });
        assert_eq!(found, None);
    }
}
