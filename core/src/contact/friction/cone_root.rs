//! The first place on a straight path where the cone holds: the first root of the excess pull.

use super::cone::Excess;

/// The search: Newton steps until the cone holds, then false position (Illinois: an end that stays
/// twice counts half).
pub(super) struct ConeRoot {
    /// The last place where the pull exceeded friction, and the excess there.
    low: (f32, f32),
    /// The first place where friction held, and the excess there, below zero.
    high: Option<(f32, f32)>,
    /// Decrease of the excess over the whole path on a plane.
    plane_rate: f32,
    /// Next place to evaluate.
    next: f32,
    /// Evaluations in a row that moved the same end: positive for the lower end.
    stayed: i32,
}

impl ConeRoot {
    /// Creates a search from the start of a path, where the pull exceeds friction; on a plane the
    /// foot of the HIP is at 1.
    pub(super) fn new(start: Excess, drag: f32) -> Self {
        let plane_rate = (1.0 + drag) * start.pull;
        Self {
            low: (0.0, start.over),
            high: None,
            plane_rate,
            next: start.over / plane_rate,
            stayed: 0,
        }
    }

    /// Returns the next place to evaluate.
    pub(super) const fn next(&self) -> f32 {
        self.next
    }

    /// Returns the end of a path after the last evaluation: the farthest place where the pull still
    /// exceeds friction, from which the next path continues. If that is the start, returns the
    /// nearest place where the cone holds.
    pub(super) fn path_end(&self) -> Option<f32> {
        let (low, _) = self.low;
        let high = self.high.map(|(t, _)| t);
        if low > 0.0 { Some(low) } else { high }
    }

    /// Updates the search with the evaluation at `t`.
    pub(super) fn update(&mut self, t: f32, excess: &Excess) {
        let over = excess.over;
        if over > 0.0 {
            let measured = (self.low.1 - over) / (t - self.low.0);
            self.low = (t, over);
            let Some((_, at_high)) = &mut self.high else {
                // The rate comes from the last two evaluations, or from a plane if those differ too
                // little.
                let rate = if measured > 0.25 * self.plane_rate {
                    measured
                } else {
                    self.plane_rate
                };
                self.next = t + over / rate;
                return;
            };
            *at_high *= if self.stayed > 0 { 0.5 } else { 1.0 };
            self.stayed = 1;
        } else {
            self.low.1 *= if self.stayed < 0 { 0.5 } else { 1.0 };
            self.high = Some((t, over));
            self.stayed = -1;
        }
        if let Some((high, at_high)) = self.high {
            let (low, at_low) = self.low;
            self.next = low + (high - low) * (at_low / (at_low - at_high));
        }
    }
}
