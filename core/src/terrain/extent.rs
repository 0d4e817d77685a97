//! Sizes of fields, and boxes of cells.

use serde::{Deserialize, Serialize};

use super::index::{TILE_SHIFT, TileIndex};
use crate::grid::{Cell, MAX_CELL};

/// The size of a field in cells; it has one more sample in each direction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FieldSize {
    /// Cells from west to east.
    pub columns: i32,
    /// Cells from south to north.
    pub rows: i32,
}

impl FieldSize {
    /// Creates a size from the cells from west to east and from south to north.
    #[must_use]
    pub const fn new(columns: i32, rows: i32) -> Self {
        Self { columns, rows }
    }

    /// Returns true if a field can have this size: 1 to [`MAX_CELL`] cells in each direction.
    #[must_use]
    pub fn is_valid(self) -> bool {
        let ok = |cells| (1..=MAX_CELL).contains(&cells);
        ok(self.columns) && ok(self.rows)
    }

    /// Returns the north-east tile of the field; (-1, -1) for a field without cells.
    #[must_use]
    pub const fn last_tile(self) -> TileIndex {
        TileIndex::new(
            (self.columns - 1) >> TILE_SHIFT,
            (self.rows - 1) >> TILE_SHIFT,
        )
    }

    /// Returns the tiles of the field, row by row from the south.
    pub fn tiles(self) -> impl Iterator<Item = TileIndex> {
        let last = self.last_tile();
        (0..=last.row).flat_map(move |row| (0..=last.col).map(move |col| TileIndex::new(col, row)))
    }

    /// Returns true if the cell is in the field.
    #[must_use]
    #[inline]
    pub const fn has_cell(self, cell: Cell) -> bool {
        // One unsigned comparison per axis also excludes negative indices.
        (cell.x as u32) < self.columns as u32 && (cell.y as u32) < self.rows as u32
    }

    /// Returns true if the tile is in the field.
    #[must_use]
    pub fn has_tile(self, tile: TileIndex) -> bool {
        self.has(tile.col, tile.row, TILE_SHIFT)
    }

    /// Returns true if a cell of the field lies in a square with sides of 2ˢʰⁱᶠᵗ cells, given by
    /// its column and row among such squares.
    pub(super) fn has(self, col: i32, row: i32, shift: u32) -> bool {
        (0..=(self.columns - 1) >> shift).contains(&col)
            && (0..=(self.rows - 1) >> shift).contains(&row)
    }
}

/// A box of cells, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CellBox {
    /// South-west cell.
    pub from: Cell,
    /// North-east cell.
    pub to: Cell,
}

impl CellBox {
    /// Creates the box with these two cells at opposite corners.
    #[must_use]
    pub fn around(a: Cell, b: Cell) -> Self {
        Self {
            from: Cell::new(a.x.min(b.x), a.y.min(b.y)),
            to: Cell::new(a.x.max(b.x), a.y.max(b.y)),
        }
    }

    /// Returns the part of the box inside a field; empty if `from` exceeds `to`.
    #[must_use]
    pub(super) fn clipped(self, size: FieldSize) -> Self {
        Self {
            from: Cell::new(self.from.x.max(0), self.from.y.max(0)),
            to: Cell::new(
                self.to.x.min(size.columns - 1),
                self.to.y.min(size.rows - 1),
            ),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.from.x > self.to.x || self.from.y > self.to.y
    }

    /// Returns the side, as a power of two, of the smallest blocks that cover the box with at most
    /// two in each direction; at least `min_shift`.
    pub(super) fn cover_shift(&self, min_shift: u32) -> u32 {
        let extent = (self.to.x - self.from.x).max(self.to.y - self.from.y);
        (32 - extent.leading_zeros()).max(min_shift)
    }
}
