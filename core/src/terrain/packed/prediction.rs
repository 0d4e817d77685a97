//! Prediction of a sample's number from those before it.

use crate::terrain::TILE_SAMPLES;

/// The numbers of the row before, and of the present one as far as it is known.
pub(super) struct Prediction {
    /// West of the next sample: of its row; from there on, of the row before.
    row: [i32; TILE_SAMPLES],
    west: i32,
    corner: i32,
}

impl Prediction {
    /// With the number that the first sample is to have.
    pub(super) const fn new(first: i32) -> Self {
        Self {
            row: [first; TILE_SAMPLES],
            west: first,
            corner: first,
        }
    }

    /// Tells the number of the sample in a column, which `number` makes of the number that is
    /// predicted for it and the one to its west. Columns come in turn, row by row.
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
