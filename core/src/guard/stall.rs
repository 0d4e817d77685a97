//! Detection of a motor that pushes while its encoder does not move.
//!
//! In contact with a surface this is normal, so a push against a stationary encoder is suspicious
//! only in two cases:
//! - *All* encoders are stationary, to the count, for two seconds while a motor has more than its
//!   continuous current. No hand is that steady under such a force.
//! - *One* encoder is stationary, to within a count, while its motor pushes and the other joints
//!   move. A hand trembles by more than a count, so in a motion that turns one joint only, the
//!   other joints still move.

use glam::Vec3;

/// Readings (a millisecond each) for which all encoders may be stationary under load.
const MAX_ALL_STILL: u32 = 2_000;
/// Counts that the other joints may move together while one is stationary: about 200 mm. A hand
/// that turns one joint only, at up to half a metre a second, with a tremor of 0.2 mm (measured on
/// the virtual Phantom), moves them by a third of this. A hand that rubs along a straight line
/// without a tremor also moves them by less.
pub const MAX_OTHERS_TRAVEL: u32 = 8_000;
/// Distance, in counts, within which a joint counts as stationary: an encoder with one dead channel
/// still alternates by one count.
const STATIONARY_BAND: u32 = 1;

/// Detector of motors that push without a motion.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StallDetector {
    all_still: u32,
    /// Distance of each joint from the place where it became stationary.
    off: [i32; 3],
    /// Motion of the other joints since then.
    others: [u32; 3],
}

impl StallDetector {
    /// Processes the motion of the encoders in a millisecond under these currents. Returns true if
    /// a motor pushes without a motion.
    // Inlined: it has one caller, and a call would copy its arguments in every tick.
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
        let distances = moved.map(i32::unsigned_abs);
        let all = distances
            .iter()
            .fold(0, |sum: u32, w| sum.saturating_add(*w));
        let loaded = load.cmpgt(0.5 * continuous_a);
        let axes = self.off.iter_mut().zip(&mut self.others);
        for (axis, ((off, others), moved)) in axes.zip(moved).enumerate() {
            *off = off.saturating_add(moved);
            if loaded.test(axis) && off.unsigned_abs() <= STATIONARY_BAND {
                *others = others.saturating_add(all - moved.unsigned_abs());
            } else {
                (*off, *others) = (0, 0);
            }
        }
        self.all_still > MAX_ALL_STILL
            || self.others.iter().any(|others| *others > MAX_OTHERS_TRAVEL)
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
    fn resting_and_sliding_are_not_detected_as_stalls() {
        assert_eq!(ticks_until_found([0; 3], Vec3::splat(1.2)), None);
        assert_eq!(ticks_until_found([3, 1, -1], Vec3::splat(5.5)), None);
        // Motion in one joint only: the others do not push.
        assert_eq!(ticks_until_found([5, 0, 0], Vec3::new(3.0, 0.5, 0.0)), None);
    }

    #[test]
    fn dead_encoders_under_load_are_detected() {
        assert_eq!(ticks_until_found([0; 3], Vec3::Y * 1.3), Some(2_001));
    }

    #[test]
    fn dead_encoder_of_a_driven_joint_is_detected() {
        let found = ticks_until_found([0, 0, -10], Vec3::Y * 0.7);
        assert_eq!(found, Some(801));
    }

    #[test]
    fn encoder_toggling_by_one_count_is_detected_as_dead() {
        let mut detector = StallDetector::default();
        let found = (1..10_000).find(|i| {
            let moved = [-10, if i % 2 == 0 { 1 } else { -1 }, 0];
            detector.check(moved, Vec3::Y * 0.7, CONTINUOUS)
        });
        assert_eq!(found, Some(801));
    }

    #[test]
    fn creeping_joint_is_not_detected_as_dead() {
        let mut detector = StallDetector::default();
        let found = (1..100_000).find(|i| {
            let moved = [-10, i32::from(i % 60 == 0), 0];
            detector.check(moved, Vec3::Y * 0.7, CONTINUOUS)
        });
        assert_eq!(found, None);
    }
}
