//! The column and row of a cell.

use serde::{Deserialize, Serialize};

/// Maximum cell index, in any direction, of a [`GridPoint`].
///
/// A quarter of the `i32` range, so that the difference and the sum of any two
/// indices are still exact. [`GridPoint::new`] clamps to it.
///
/// [`GridPoint`]: super::GridPoint
/// [`GridPoint::new`]: super::GridPoint::new
pub const MAX_CELL: i32 = 1 << 29;

/// The column and row of a cell, and of the patch over it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Cell {
    /// Column, counted eastward from the south-west corner of the field.
    pub x: i32,
    /// Row, counted northward from the south-west corner of the field.
    pub y: i32,
}

impl Cell {
    /// Creates the cell in this column and row.
    #[must_use]
    pub const fn new(x: i32, y: i32) -> Self {
        Self { x, y }
    }

    /// Returns the cell `east` columns east and `north` rows north, saturating at the ends of the
    /// `i32` range.
    #[must_use]
    #[inline]
    pub const fn offset(self, east: i32, north: i32) -> Self {
        Self {
            x: self.x.saturating_add(east),
            y: self.y.saturating_add(north),
        }
    }
}
