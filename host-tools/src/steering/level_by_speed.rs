//! The level of detail by the hand's speed.

/// Time for which the hand must be slow before the level gets finer, ms.
const SLOW_MS: u32 = 200;
/// Time constant of the smoothed velocity, ms: one count of an encoder has little effect on it.
const SMOOTHING_MS: f64 = 30.0;
/// Longest time of a motion, ms. After a longer one, such as a gap in the samples, the motion in it
/// is unknown.
const MAX_STEP_MS: u32 = 1_000;

/// A rule with hysteresis. The level is the finest at which the hand moves at most one haptic cell
/// in a millisecond. It becomes coarser at once, and finer after the speed has been below half of
/// the finer level's limit for [`SLOW_MS`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LevelBySpeed {
    /// Levels above the finest one of the placement.
    coarser: u8,
    slow_ms: u32,
    /// Maximum speed in that time, haptic cells of the finest level a millisecond.
    max_speed: f64,
    /// Smoothed velocity east and north, device millimetres a millisecond.
    velocity: [f64; 2],
}

impl LevelBySpeed {
    /// Maximum number of levels above the finest one: above that, a slope would lose its shape.
    pub(super) const MAX_COARSER: u8 = 3;

    /// Returns the required number of levels above the finest one.
    pub(super) const fn coarser(&self) -> u8 {
        self.coarser
    }

    /// Takes a motion of the hand east and north, device millimetres, in a time; `cell_mm` is the
    /// size of the finest level's haptic cells.
    pub(super) fn take_motion(&mut self, moved_mm: [f64; 2], ms: u32, cell_mm: f64) {
        if !(1..=MAX_STEP_MS).contains(&ms) {
            return;
        }
        let share = 1.0 - (-f64::from(ms) / SMOOTHING_MS).exp();
        for (velocity, moved_mm) in self.velocity.iter_mut().zip(moved_mm) {
            *velocity += (moved_mm / f64::from(ms) - *velocity) * share;
        }
        // The link can deliver any bits.
        if self.velocity.iter().any(|velocity| !velocity.is_finite()) {
            self.velocity = [0.0; 2];
        }
        let [east, north] = self.velocity;
        self.take_speed(east.hypot(north) / cell_mm, ms);
    }

    /// Takes a speed, haptic cells of the finest level a millisecond, that lasted `ms`.
    fn take_speed(&mut self, speed: f64, ms: u32) {
        let needed = level_within(1.0, speed);
        let is_slow = level_within(0.5, speed) < self.coarser;
        if needed <= self.coarser && is_slow {
            self.slow_ms = self.slow_ms.saturating_add(ms);
            self.max_speed = self.max_speed.max(speed);
            if self.slow_ms < SLOW_MS {
                return;
            }
            self.coarser = level_within(0.5, self.max_speed);
        } else {
            self.coarser = self.coarser.max(needed);
        }
        (self.slow_ms, self.max_speed) = (0, 0.0);
    }
}

/// Returns the finest level, above the finest one, at which a speed is within this share of the
/// limit.
fn level_within(share: f64, speed: f64) -> u8 {
    let levels = 0..LevelBySpeed::MAX_COARSER;
    let is_within = |level: &u8| speed <= share * f64::from(*level).exp2();
    levels
        .into_iter()
        .find(is_within)
        .unwrap_or(LevelBySpeed::MAX_COARSER)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the levels after speeds that lasted some milliseconds each.
    fn levels<const N: usize>(speeds: [(f64, u32); N]) -> [u8; N] {
        let mut rule = LevelBySpeed::default();
        speeds.map(|(speed, ms)| {
            (0..ms).for_each(|_| rule.take_speed(speed, 1));
            rule.coarser()
        })
    }

    #[test]
    fn level_gets_coarser_at_once_by_cells_per_millisecond() {
        assert_eq!(
            levels([(1.0, 1), (1.1, 1), (2.1, 1), (4.1, 1)]),
            [0, 1, 2, 3]
        );
        assert_eq!(levels([(1e9, 1), (f64::NAN, 1)]), [3, 3], "it has a limit");
    }

    #[test]
    fn level_gets_finer_after_the_speed_is_half_for_a_while() {
        let slow = SLOW_MS;
        assert_eq!(levels([(1.5, 1), (0.4, slow - 1), (0.4, 1)]), [1, 1, 0]);
        assert_eq!(levels([(1.5, 1), (0.6, 10 * slow)]), [1, 1], "above half");
        assert_eq!(levels([(9.0, 1), (0.9, slow)]), [3, 1], "several at once");
        let interrupted = [(1.5, 1), (0.4, slow - 1), (0.6, 1), (0.4, slow - 1)];
        assert_eq!(levels(interrupted), [1; 4]);
    }

    #[test]
    fn oscillating_speed_changes_the_level_once() {
        let mut rule = LevelBySpeed::default();
        let mut changes = 0;
        for ms in 0..20_000 {
            let before = rule.coarser();
            // Around the limit, at 0.5 to 50 Hz.
            let hz = 0.5 + 49.5 * f64::from(ms) / 20_000.0;
            let phase = std::f64::consts::TAU * hz * f64::from(ms) / 1_000.0;
            rule.take_speed(1.0 + 0.45 * phase.sin(), 1);
            changes += u32::from(rule.coarser() != before);
        }
        assert_eq!(changes, 1);
    }

    #[test]
    fn motion_in_more_than_a_second_is_ignored() {
        let mut rule = LevelBySpeed::default();
        (0..200).for_each(|_| rule.take_motion([0.07, 0.0], 1, 0.03));
        assert_eq!(rule.coarser(), 2);
        for ms in [1_001, u32::MAX] {
            rule.take_motion([0.0, 0.0], ms, 0.03);
            assert_eq!(rule.coarser(), 2, "{ms} ms");
        }
        rule.take_motion([0.0, 0.0], 1_000, 0.03);
        assert_eq!(rule.coarser(), 0);
    }

    #[test]
    fn encoder_counts_of_a_still_hand_are_no_motion() {
        let mut rule = LevelBySpeed::default();
        for sample in 0..10_000 {
            // A count of one cell to and fro, in each millisecond.
            let moved_mm = if sample % 2 == 0 { 0.03 } else { -0.03 };
            rule.take_motion([moved_mm, -moved_mm], 1, 0.03);
            assert_eq!(rule.coarser(), 0);
        }
        // Half as fast in samples of two milliseconds.
        (0..200).for_each(|_| rule.take_motion([0.07, 0.0], 1, 0.03));
        assert_eq!(rule.coarser(), 2);
        let mut rule = LevelBySpeed::default();
        (0..200).for_each(|_| rule.take_motion([0.07, 0.0], 2, 0.03));
        assert_eq!(rule.coarser(), 1);
    }
}
