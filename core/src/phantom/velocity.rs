//! How fast the joints turn, from their counts: first-order adaptive windowing
//! (FOAW) with the best-fit slope (Janabi-Sharifi, Hayward & Chen 2000).
//!
//! A difference of two readings is off by up to one count, however slow the
//! arm: at 1 kHz, 29 mm/s at the tip. Over a window of n readings the same
//! error is spread over n ticks, but a long window lags behind. So the window
//! is as long as a straight line through the newest reading stays within the
//! encoder's error of *every* reading in it, and no longer: long where the arm
//! moves evenly, short where it speeds up.
//!
//! The paper tries each length and tests all readings in it, 120 tests at worst
//! for a window of 15. Here the slopes that each reading allows are kept as one
//! interval that only shrinks, so each reading is looked at once: at most
//! [`WINDOW`] steps an axis, whatever the signal.

use glam::Vec3;

/// Longest window: readings before the newest.
pub const WINDOW: usize = 15;
/// What two readings can be off by together, counts: half a count each.
const NOISE: f32 = 1.0;
/// Readings kept, a power of two.
const KEPT: usize = WINDOW + 1;

/// 1/i, and 6/(n(n+1)(n+2)), the factor of the best-fit slope.
const RECIPROCAL: [f32; KEPT] = table(1.0, 0, 0);
const FIT: [f32; KEPT] = table(6.0, 1, 2);

const fn table(over: f32, a: usize, b: usize) -> [f32; KEPT] {
    let mut values = [0.0; KEPT];
    let mut n = 1;
    while n < KEPT {
        let rest = if b == 0 { 1 } else { (n + a) * (n + b) };
        values[n] = over / (n * rest) as f32;
        n += 1;
    }
    values
}

/// The last readings of the three encoders, evenly spaced in time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Readings {
    counts: [[i32; 3]; KEPT],
    newest: usize,
    /// Readings before the newest, at most [`WINDOW`].
    before: usize,
}

impl Readings {
    /// Takes the next reading.
    pub fn take(&mut self, counts: [i32; 3]) {
        self.newest = (self.newest + 1) % KEPT;
        if let Some(place) = self.counts.get_mut(self.newest) {
            *place = counts;
        }
        self.before = (self.before + 1).min(WINDOW);
    }

    /// Forgets everything but this reading.
    pub fn restart(&mut self, counts: [i32; 3]) {
        self.take(counts);
        self.before = 0;
    }

    /// Counts moved between the last two readings.
    #[must_use]
    pub fn moved(&self) -> [i32; 3] {
        if self.before == 0 {
            return [0; 3];
        }
        core::array::from_fn(|axis| self.ago(0, axis).wrapping_sub(self.ago(1, axis)))
    }

    /// Velocity of each axis, counts from one reading to the next.
    ///
    /// Even motion at any speed is met within 0.11 counts once 15 readings are
    /// in (swept in the tests); raw differences are off by up to 1.
    #[must_use]
    pub fn velocity(&self) -> Vec3 {
        Vec3::new(self.slope(0), self.slope(1), self.slope(2))
    }

    fn ago(&self, readings: usize, axis: usize) -> i32 {
        let place = self.newest.wrapping_sub(readings) % KEPT;
        self.counts
            .get(place)
            .and_then(|counts| counts.get(axis))
            .copied()
            .unwrap_or(0)
    }

    fn slope(&self, axis: usize) -> f32 {
        let newest = self.ago(0, axis);
        let (mut low, mut high) = (f32::MIN, f32::MAX);
        let (mut sum, mut moment) = (0.0, 0.0);
        let mut window = 0;
        for i in 1..=self.before.min(WINDOW) {
            let reciprocal = RECIPROCAL.get(i).copied().unwrap_or(0.0);
            let fallen = newest.wrapping_sub(self.ago(i, axis)) as f32;
            // Compared here: `max` and `min` are calls on this processor.
            let lower = (fallen - NOISE) * reciprocal;
            let lower = if lower > low { lower } else { low };
            let upper = (fallen + NOISE) * reciprocal;
            let upper = if upper < high { upper } else { high };
            if lower > upper {
                break;
            }
            (low, high) = (lower, upper);
            sum += fallen;
            moment += i as f32 * fallen;
            window = i;
        }
        // The least-squares line of the window's readings, kept to the slopes
        // for which the window was chosen.
        let fit = FIT.get(window).copied().unwrap_or(0.0);
        let slope = (2.0 * moment - window as f32 * sum) * fit;
        if slope < low {
            low
        } else if slope > high {
            high
        } else {
            slope
        }
    }
}

#[cfg(test)]
#[path = "velocity_tests.rs"]
mod tests;
