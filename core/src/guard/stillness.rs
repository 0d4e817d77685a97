//! A motor that pushes while its encoder does not move.
//!
//! Resting on a surface, that is how it should be, so a push against a
//! standing encoder is suspicious only in two cases:
//! - *All* encoders stand to the count for two seconds while a motor has more
//!   than its continuous current. No hand is that calm under such a force.
//! - *One* encoder stands while its motor pushes and the other joints travel
//!   a long way. Sliding on a plane turns joint 2 hardly at all, and friction
//!   may hold it for a while; but no hand pushes evenly to a twentieth of a
//!   newton along 40 cm.

use glam::Vec3;

/// Readings (a millisecond each) that all encoders may stand under load.
const ALL_STILL: u32 = 2_000;
/// Counts that the other joints may travel while one stands: about 400 mm.
const TRAVEL: u32 = 16_000;

/// Watches for motors that push in vain.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stillness {
    all_still: u32,
    others: [u32; 3],
}

impl Stillness {
    /// Takes how far the encoders moved in a millisecond under these currents.
    /// True if a motor pushes and nothing comes of it.
    pub(super) fn look(&mut self, moved: [i32; 3], currents_a: Vec3, continuous_a: Vec3) -> bool {
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
        for (axis, (others, own)) in self.others.iter_mut().zip(way).enumerate() {
            *others = match own == 0 && loaded.test(axis) {
                true => others.saturating_add(all),
                false => 0,
            };
        }
        self.all_still > ALL_STILL || self.others.iter().any(|others| *others > TRAVEL)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONTINUOUS: Vec3 = Vec3::splat(1.24);

    fn ticks_until_found(moved: [i32; 3], currents_a: Vec3) -> Option<u32> {
        let mut stillness = Stillness::default();
        (1..10_000).find(|_| stillness.look(moved, currents_a, CONTINUOUS))
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
        assert_eq!(found, Some(1_601));
    }
}
