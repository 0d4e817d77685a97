//! Range of the heights and number of no-data samples.

/// Range of the heights and number of no-data samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeightSummary {
    /// Lowest height in the file's vertical unit.
    pub lowest: f64,
    /// Highest height in the file's vertical unit.
    pub highest: f64,
    /// Samples without a height.
    pub no_data: u64,
    /// Samples read for the summary: all, or for a raster that stays in its file, those of a
    /// coarser image or of some parts.
    pub examined: u64,
}

impl HeightSummary {
    /// Summary of no samples.
    pub(super) const EMPTY: Self = Self {
        lowest: f64::INFINITY,
        highest: f64::NEG_INFINITY,
        no_data: 0,
        examined: 0,
    };

    /// Counts a height; NaN is no-data.
    pub(super) fn add(&mut self, height: f64) {
        self.examined += 1;
        if height.is_nan() {
            self.no_data += 1;
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
