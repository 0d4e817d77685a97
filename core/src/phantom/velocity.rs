//! Joint velocities from counts: first-order adaptive windowing
//! (FOAW) with the best-fit slope (Janabi-Sharifi, Hayward & Chen 2000).
//!
//! A difference of two readings has an error of up to one count at any speed: 29 mm/s at the tip at
//! 1 kHz. Over a window of n readings the same error is spread over n ticks, but a long window
//! lags. So the window is the longest one in which a straight line through the newest reading stays
//! within the encoder's error of *every* reading: long in a uniform motion, short during
//! acceleration.
//!
//! The paper tries each length and tests all readings in it, 120 tests at worst for a window of 15.
//! Here the slopes that each reading permits are one interval that only shrinks, so each reading is
//! processed once: at most [`WINDOW`] steps per axis, for any signal.

use glam::Vec3;

use crate::scalar::{larger, smaller};

/// Maximum window: readings before the newest.
pub const WINDOW: usize = 15;
/// Maximum error of two readings together, counts: half a count each.
const NOISE: f32 = 1.0;
/// Number of stored readings, a power of two.
const STORED: usize = WINDOW + 1;

/// 1/i for the reading i ticks ago, starting with 1.
const RECIPROCAL: [f32; WINDOW] = {
    let mut values = [0.0; WINDOW];
    let mut i = 0;
    while i < WINDOW {
        values[i] = 1.0 / (i + 1) as f32;
        i += 1;
    }
    values
};
/// 6/(n(n+1)(n+2)) for a window of n, the factor of the best-fit slope.
const FIT: [f32; STORED] = {
    let mut values = [0.0; STORED];
    let mut n = 1;
    while n < STORED {
        values[n] = 6.0 / (n * (n + 1) * (n + 2)) as f32;
        n += 1;
    }
    values
};

/// The last readings of the three encoders, equally spaced in time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Readings {
    /// Readings from `newest` on, the newest first. Each is stored twice, so that they are
    /// contiguous from every `newest`.
    counts: [[i32; 3]; 2 * STORED],
    newest: usize,
    /// Number of readings before the newest, at most [`WINDOW`].
    before: usize,
}

impl Readings {
    /// Adds the next reading.
    pub fn push(&mut self, counts: [i32; 3]) {
        self.newest = self.newest.wrapping_sub(1) % STORED;
        self.counts[self.newest % STORED] = counts;
        self.counts[self.newest % STORED + STORED] = counts;
        self.before = (self.before + 1).min(WINDOW);
    }

    /// Clears all readings except this one.
    pub fn restart(&mut self, counts: [i32; 3]) {
        self.push(counts);
        self.before = 0;
    }

    /// Returns the counts moved between the last two readings.
    #[must_use]
    pub fn moved(&self) -> [i32; 3] {
        if self.before == 0 {
            return [0; 3];
        }
        let newest = self.newest % STORED;
        let (newest, before) = (&self.counts[newest], &self.counts[newest + 1]);
        core::array::from_fn(|axis| newest[axis].wrapping_sub(before[axis]))
    }

    /// Returns the velocity of each axis, counts per reading.
    ///
    /// The error in a uniform motion is at most 0.11 counts at any speed, after 15 readings (tested
    /// by a sweep); that of raw differences is up to 1.
    #[must_use]
    pub fn velocity(&self) -> Vec3 {
        let newest = self.newest % STORED;
        let stored = newest..newest + 1 + self.before.min(WINDOW);
        let readings = self.counts.get(stored).unwrap_or_default();
        Vec3::new(
            slope(readings, |counts| counts[0]),
            slope(readings, |counts| counts[1]),
            slope(readings, |counts| counts[2]),
        )
    }
}

/// Returns the slope of an axis in these readings, the newest first.
#[inline(never)]
fn slope(readings: &[[i32; 3]], axis: impl Fn(&[i32; 3]) -> i32) -> f32 {
    let Some((newest, before)) = readings.split_first() else {
        return 0.0;
    };
    let (mut low, mut high) = (f32::MIN, f32::MAX);
    let (mut window, mut sum, mut sums) = (0, 0.0, 0.0);
    for (counts, reciprocal) in before.iter().zip(&RECIPROCAL) {
        let fallen = axis(newest).wrapping_sub(axis(counts)) as f32;
        let lower = larger((fallen - NOISE) * reciprocal, low);
        let upper = smaller((fallen + NOISE) * reciprocal, high);
        if lower > upper {
            break;
        }
        (low, high) = (lower, upper);
        window += 1;
        sum += fallen;
        sums += sum;
    }
    // The least-squares line of the window's readings, clamped to the slopes that the window
    // permits. The reading i ticks ago is in all but i - 1 of the `sums`.
    let fit = FIT.get(window).copied().unwrap_or(0.0);
    let slope = ((window + 2) as f32 * sum - 2.0 * sums) * fit;
    if slope < low {
        low
    } else if slope > high {
        high
    } else {
        slope
    }
}

#[cfg(test)]
#[path = "velocity_tests.rs"]
mod tests;
