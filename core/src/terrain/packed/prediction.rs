//! Prediction of a sample's number from earlier samples.

use crate::terrain::TILE_SAMPLES;

/// The numbers of the last row, and of the decoded part of the present row.
pub(super) struct Prediction {
    /// Numbers of the present row, west of the next sample; east of it, of the last row.
    row: [i32; TILE_SAMPLES],
    west: i32,
    corner: i32,
}

impl Prediction {
    /// Creates the state before the first sample, with its predicted number.
    pub(super) const fn new(first: i32) -> Self {
        Self {
            row: [first; TILE_SAMPLES],
            west: first,
            corner: first,
        }
    }

    /// Returns the number of the sample in a column, computed by `number` from its prediction and
    /// from the number to the west. Columns must be in order, row by row.
    #[inline]
    pub(super) fn next(&mut self, col: usize, number: impl FnOnce(i32, i32) -> i32) -> i32 {
        let Some(place) = self.row.get_mut(col) else {
            return 0;
        };
        let before = *place;
        if col == 0 {
            (self.west, self.corner) = (before, before);
        }
        let predicted = self.west.wrapping_add(before).wrapping_sub(self.corner);
        let number = number(predicted, self.west);
        (self.corner, self.west, *place) = (before, number, number);
        number
    }
}
