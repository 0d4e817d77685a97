//! The tip's speed, estimated only as exactly as its limit requires.

use glam::Vec3;

use crate::phantom::{Kinematics, Pose, Readings};
use crate::rate::TickRate;

/// Number of readings, a millisecond each, for which the tip may stay above twice the speed limit.
const MAX_READINGS_TOO_FAST: u32 = 5;

/// Monitor of the tip's speed, once a millisecond.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SpeedMonitor {
    readings: Readings,
    /// Ticks between two readings, and since the last one.
    every: u32,
    ticks: u32,
    /// Readings a second.
    pub(super) hz: f32,
    /// Maximum counts of each axis between two readings at which the tip is below the limit in
    /// every pose.
    surely_slow: [u32; 3],
    /// Maximum difference between the tip's speed from the last two readings alone and that from
    /// FOAW, mm/s: the slope of FOAW is within a count of the last difference.
    rough_mm_s: f32,
    limit_mm_s: f32,
    too_fast: u32,
    /// The share of the force at this speed: 1 up to the limit, 0 from twice the limit on.
    pub(super) share: f32,
}

/// Result of a tick's check of the speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SpeedCheck {
    /// Between two readings.
    NotYet,
    /// A reading was taken, with the counts moved since the last one.
    Moved([i32; 3]),
    /// The same, and the tip has been above twice the limit for too long.
    TooFast,
}

impl SpeedMonitor {
    pub(super) fn new(rate: TickRate) -> Self {
        let every = rate.ticks(1);
        Self {
            every,
            hz: rate.hz() as f32 / every as f32,
            share: 1.0,
            ..Self::default()
        }
    }

    pub(super) fn configure(&mut self, mechanism: &Kinematics) {
        let record = mechanism.calibration();
        self.limit_mm_s = record.max_speed_mm_s;
        let (l1, l2) = (record.l1_mm, record.l2_mm);
        // A third of the limit for each joint, with its longest lever, minus a count for the
        // readings' error.
        let levers_mm = Vec3::new(l1 + l2, l1, l2) * mechanism.radians_per_count().abs();
        self.rough_mm_s = self.hz * levers_mm.element_sum();
        let counts = self.limit_mm_s / (3.0 * self.hz * levers_mm);
        self.surely_slow = counts.to_array().map(|c| (c as u32).saturating_sub(1));
    }

    /// Restarts from counts that are unrelated to the earlier ones.
    pub(super) fn restart(&mut self, counts: [i32; 3]) {
        self.readings.restart(counts);
        self.ticks = 0;
        self.too_fast = 0;
        self.share = 1.0;
    }

    /// Processes a tick's counts.
    // Inlined: it has one caller, and a call would copy its arguments in every tick.
    #[inline(always)]
    pub(super) fn check(
        &mut self,
        counts: [i32; 3],
        mechanism: &Kinematics,
        pose: &Pose,
    ) -> SpeedCheck {
        self.ticks += 1;
        if self.ticks < self.every {
            return SpeedCheck::NotYet;
        }
        self.ticks = 0;
        self.readings.push(counts);
        let moved = self.readings.moved();
        let speed_of =
            |counts: Vec3| pose.tip_velocity_mm_s(counts * self.hz * mechanism.radians_per_count());
        if self.is_surely_slow(moved) || self.is_roughly_slow(moved, speed_of) {
            self.share = 1.0;
            self.too_fast = 0;
            return SpeedCheck::Moved(moved);
        }
        let speed = speed_of(self.readings.velocity()).length();
        let over = speed / self.limit_mm_s - 1.0;
        self.share = 1.0 - over.clamp(0.0, 1.0);
        self.too_fast = if over < 1.0 { 0 } else { self.too_fast + 1 };
        match self.too_fast > MAX_READINGS_TOO_FAST {
            true => SpeedCheck::TooFast,
            false => SpeedCheck::Moved(moved),
        }
    }

    /// Returns the tip's velocity, device frame, mm/s.
    pub(super) fn velocity_mm_s(&self, mechanism: &Kinematics, pose: &Pose) -> Vec3 {
        let counts = self.readings.velocity();
        pose.tip_velocity_mm_s(counts * self.hz * mechanism.radians_per_count())
    }

    /// Returns true if the tip is below the limit in every pose.
    fn is_surely_slow(&self, moved: [i32; 3]) -> bool {
        let slow = |axis: usize| moved[axis].unsigned_abs() <= self.surely_slow[axis];
        slow(0) && slow(1) && slow(2)
    }

    /// Returns true if the last two readings alone show that the tip is below the limit: FOAW costs
    /// as much as the rest of a tick.
    fn is_roughly_slow(&self, moved: [i32; 3], speed_of: impl Fn(Vec3) -> Vec3) -> bool {
        let [x, y, z] = moved.map(|moved| moved as f32);
        let max_mm_s = self.limit_mm_s - self.rough_mm_s;
        max_mm_s > 0.0 && speed_of(Vec3::new(x, y, z)).length_squared() <= max_mm_s * max_mm_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::cases;
    use crate::phantom::Calibration;

    /// A hand that accelerates and decelerates at random, beyond the limit and back.
    #[test]
    fn rough_speed_check_agrees_with_the_exact_check() {
        let mechanism = Kinematics::new(&Calibration::PREMIUM_1_5).expect("valid");
        let mut rough = SpeedMonitor::new(TickRate::DEFAULT);
        rough.configure(&mechanism);
        let mut exact = rough;
        exact.rough_mm_s = f32::INFINITY;
        exact.surely_slow = [0; 3];
        let (mut counts, mut rates, mut state) = ([0_i32; 3], [0_i32; 3], 1_u32);
        let mut dice = |sides: u32| {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            (state % sides) as i32
        };
        let (mut slowed, mut full) = (0, 0);
        const TICKS: u32 = cases(200_000, 800);
        for tick in 0..TICKS {
            for (count, rate) in counts.iter_mut().zip(&mut rates) {
                *rate = (*rate + dice(7) - 3).clamp(-60, 60);
                *count += *rate + dice(3) - 1;
            }
            if tick % 400 == 0 {
                counts = [dice(4_000), dice(4_000), dice(4_000)];
                rates = [0; 3];
                rough.restart(counts);
                exact.restart(counts);
            }
            let pose = mechanism.pose(counts, [0; 3]);
            let checks = [&mut rough, &mut exact].map(|s| s.check(counts, &mechanism, &pose));
            assert_eq!(checks[0], checks[1], "{tick}");
            assert_eq!(rough.share.to_bits(), exact.share.to_bits(), "{tick}");
            assert_eq!(rough.too_fast, exact.too_fast, "{tick}");
            if rough.share < 1.0 {
                slowed += 1;
            } else {
                full += 1;
            }
        }
        let some = TICKS / 10;
        assert!(slowed > some && full > some, "{slowed} {full}");
    }
}
