//! Range of the heights and number of holes.

/// Range of the heights and number of holes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightSummary {
    /// Lowest height in the file's vertical unit.
    pub lowest: f64,
    /// Highest height in the file's vertical unit.
    pub highest: f64,
    /// Samples without a height.
    pub holes: u64,
    /// Samples that were looked at: all, or those of a coarser image or of some places
    /// where the raster stays in its file.
    pub looked_at: u64,
}

impl HeightSummary {
    /// Of no sample.
    pub(super) const EMPTY: Self = Self {
        lowest: f64::INFINITY,
        highest: f64::NEG_INFINITY,
        holes: 0,
        looked_at: 0,
    };

    /// Counts a height; NaN is a hole.
    pub(super) fn add(&mut self, height: f64) {
        self.looked_at += 1;
        if height.is_nan() {
            self.holes += 1;
        } else {
            self.lowest = self.lowest.min(height);
            self.highest = self.highest.max(height);
        }
    }

    /// Returns true if no sample has a height.
    pub(super) const fn has_none(&self) -> bool {
        self.lowest > self.highest
    }
}
