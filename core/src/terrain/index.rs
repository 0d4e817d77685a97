//! Indices of tiles, and sizes of their blocks.

use serde::{Deserialize, Serialize};

use crate::grid::Cell;

/// Cells along a tile's side, as a power of two.
pub const TILE_SHIFT: u32 = 5;
/// Cells along a tile's side.
pub const TILE_CELLS: usize = 1 << TILE_SHIFT;
/// Samples along a tile's side; the last row and column are shared with the
/// next tile, so that a patch never needs two tiles.
pub const TILE_SAMPLES: usize = TILE_CELLS + 1;

/// Side of the smallest block with a stored maximum, as a power of two.
///
/// 8 cells: 21 maxima per tile, 0.08 byte per sample.
pub(crate) const BLOCK_SHIFT: u32 = 3;

/// The column and row of a tile of 32 × 32 cells, at any level.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TileIndex {
    /// Column, counted eastward from the south-west tile of the field.
    pub col: i32,
    /// Row, counted northward from the south-west tile of the field.
    pub row: i32,
}

impl TileIndex {
    /// Creates the index of the tile in this column and row.
    #[must_use]
    pub const fn new(col: i32, row: i32) -> Self {
        Self { col, row }
    }

    /// Returns the index of the tile that contains the patch over `cell`.
    #[must_use]
    #[inline]
    pub const fn containing(cell: Cell) -> Self {
        Self::new(cell.x >> TILE_SHIFT, cell.y >> TILE_SHIFT)
    }

    /// Returns the index `east` columns east and `north` rows north.
    #[must_use]
    pub(super) const fn offset(self, east: i32, north: i32) -> Self {
        Self::new(
            self.col.saturating_add(east),
            self.row.saturating_add(north),
        )
    }

    /// Returns true if the tiles are the same, or neighbours along a side or at a corner.
    #[must_use]
    pub(crate) fn is_beside(self, other: Self) -> bool {
        self.col
            .abs_diff(other.col)
            .max(self.row.abs_diff(other.row))
            <= 1
    }

    /// Returns the tile's south-west cell.
    #[must_use]
    pub const fn first_cell(self) -> Cell {
        Cell::new(
            self.col.saturating_mul(TILE_CELLS as i32),
            self.row.saturating_mul(TILE_CELLS as i32),
        )
    }
}

/// Level and index of a tile.
///
/// Level `L` is the field with every 2ᴸ-th sample; at every level, a tile has 32 × 32 cells of that
/// level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TileKey {
    /// Decimation level, 0 the finest.
    pub level: u8,
    /// Column and row among the tiles of the level.
    pub index: TileIndex,
}

impl TileKey {
    /// Creates the key of the tile of `level` in this column and row.
    #[must_use]
    pub const fn new(level: u8, col: i32, row: i32) -> Self {
        Self {
            level,
            index: TileIndex::new(col, row),
        }
    }

    /// Returns the key of the tile of `level` that contains the patch over `cell`.
    #[must_use]
    pub const fn containing(level: u8, cell: Cell) -> Self {
        Self {
            level,
            index: TileIndex::containing(cell),
        }
    }
}

/// Returns a tile's column or row, wrapped onto a torus of `D` × `D` tiles.
#[inline]
pub(super) const fn wrap<const D: usize>(index: i32) -> usize {
    index as usize % D
}
