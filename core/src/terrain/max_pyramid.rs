//! The maxima above the level of tiles: the highest sample of 2ᵏ × 2ᵏ tiles.

use super::index::{TILE_SHIFT, wrap};

/// Maxima over 2ᵏ × 2ᵏ tiles of a torus of `D` × `D`, in whole cells.
///
/// Level 0 is a tile. A node of a higher level is valid only while all tiles under it are stored;
/// invalid nodes read as `i32::MAX`, tiles outside the field as `i32::MIN`.
///
/// The first plane is level 0; the second has levels 1 and up, one after the other, in (D² − 1)/3
/// of its entries.
pub(super) struct MaxPyramid<const D: usize>([[[i32; D]; D]; 2]);

impl<const D: usize> MaxPyramid<D> {
    /// log₂ D. If `D` is not a power of two, only the maxima of tiles are stored: the tiles under a
    /// node would not wrap around together.
    pub(super) const HEIGHT: u32 = match D.is_power_of_two() {
        true => D.trailing_zeros(),
        false => 0,
    };
    /// Side of the largest block with a maximum, as a power of two.
    pub(super) const TOP_SHIFT: u32 = TILE_SHIFT + Self::HEIGHT;

    pub(super) const fn unknown() -> Self {
        Self([[[i32::MAX; D]; D]; 2])
    }

    /// Returns the stored maximum of the node of `level` at torus place `(col, row)`.
    #[inline]
    pub(super) fn node(&self, level: u32, col: i32, row: i32) -> i32 {
        let [plane, row, col] = Self::place(level, col, row);
        self.0[plane][row][col]
    }

    /// Stores the maximum of the node of `level` at torus place `(col, row)`.
    pub(super) fn set(&mut self, level: u32, col: i32, row: i32, top: i32) {
        let [plane, row, col] = Self::place(level, col, row);
        self.0[plane][row][col] = top;
    }

    /// Returns the place of a node: level `k` of the second plane has (D/2ᵏ)² entries.
    #[inline]
    fn place(level: u32, col: i32, row: i32) -> [usize; 3] {
        if level == 0 {
            return [0, wrap::<D>(row), wrap::<D>(col)];
        }
        let side = D >> level;
        // Σ (D/2ʲ)² for 1 ≤ j < level
        let before = (D * D - 4 * side * side) / 3;
        let (col, row) = (col as usize & (side - 1), row as usize & (side - 1));
        let index = before + row * side + col;
        [1, (index / D) % D, index % D]
    }
}
