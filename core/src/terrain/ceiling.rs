//! The maxima above the tiles, and the question they answer: is this box clear?

use super::tile::TILE_SHIFT;

/// A height: whole cells and a fraction in `[0, 1)`.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Altitude {
    cell: i32,
    frac: f32,
}

impl Altitude {
    /// `cell + frac`.
    #[must_use]
    pub const fn new(cell: i32, frac: f32) -> Self {
        Self { cell, frac }
    }

    /// Whole cells, rounded down.
    #[must_use]
    pub const fn cell(self) -> i32 {
        self.cell
    }

    /// The altitude so many cells higher, to within the rounding of `by`.
    #[must_use]
    #[inline]
    pub(crate) fn raised(self, by: f32) -> Self {
        Self {
            cell: self.cell,
            frac: self.frac + by,
        }
    }

    /// `height`, counted in cells from `base`, as seen from this altitude.
    ///
    /// The whole cells are taken off first, so nearby heights lose no bit.
    #[must_use]
    #[inline]
    pub fn up_to(self, base: i32, height: f32) -> f32 {
        (height - self.cell.wrapping_sub(base) as f32) - self.frac
    }

    /// Height above `base` in cells. Monotonic in the altitude.
    #[must_use]
    #[inline]
    pub(super) fn above(self, base: i32) -> f32 {
        self.cell.wrapping_sub(base) as f32 + self.frac
    }
}

/// A box of patches, both ends included: `[column, row]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Box2 {
    /// South-west patch.
    pub from: [i32; 2],
    /// North-east patch.
    pub to: [i32; 2],
}

impl Box2 {
    /// The box with these two patches at opposite corners.
    #[must_use]
    pub fn around(a: [i32; 2], b: [i32; 2]) -> Self {
        Self {
            from: [a[0].min(b[0]), a[1].min(b[1])],
            to: [a[0].max(b[0]), a[1].max(b[1])],
        }
    }

    /// The part of it inside `[0, size)`; empty when `from` exceeds `to`.
    #[must_use]
    pub(super) fn clipped(self, size: [i32; 2]) -> Self {
        Self {
            from: [self.from[0].max(0), self.from[1].max(0)],
            to: [self.to[0].min(size[0] - 1), self.to[1].min(size[1] - 1)],
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.from[0] > self.to[0] || self.from[1] > self.to[1]
    }

    /// Side, as a power of two, of the smallest block of which at most two in
    /// each direction cover the box; at least `least`.
    pub(super) fn cover_shift(&self, least: u32) -> u32 {
        let extent = (self.to[0] - self.from[0]).max(self.to[1] - self.from[1]);
        (32 - extent.leading_zeros()).max(least)
    }
}

/// Maxima over 2ᵏ × 2ᵏ tiles of a torus of `D` × `D`, in whole cells.
///
/// Level 0 is a tile. A node of a higher level is known only while all the
/// tiles under it are held; unknown nodes read as `i32::MAX`, tiles outside
/// the field as `i32::MIN`.
pub(super) struct Pyramid<const D: usize> {
    tiles: [[i32; D]; D],
    /// Levels 1 and up, one after the other; (D² − 1)/3 entries are used.
    upper: [[i32; D]; D],
}

impl<const D: usize> Pyramid<D> {
    /// log₂ D; a torus that is not a power of two does not compile.
    const HEIGHT: u32 = {
        assert!(D.is_power_of_two(), "a window's side is a power of two");
        D.trailing_zeros()
    };

    pub(super) const fn unknown() -> Self {
        Self {
            tiles: [[i32::MAX; D]; D],
            upper: [[i32::MAX; D]; D],
        }
    }

    /// Side of the largest block there is a maximum of, as a power of two.
    pub(super) const fn top_shift() -> u32 {
        TILE_SHIFT + Self::HEIGHT
    }

    /// The stored maximum of the node of `level` in torus place `(col, row)`.
    #[inline]
    pub(super) fn node(&self, level: u32, col: i32, row: i32) -> i32 {
        if level == 0 {
            self.tiles[wrap::<D>(row)][wrap::<D>(col)]
        } else {
            let index = Self::index(level, col, row);
            self.upper[(index / D) % D][index % D]
        }
    }

    /// Stores the maximum of the node of `level` in torus place `(col, row)`.
    pub(super) fn set(&mut self, level: u32, col: i32, row: i32, top: i32) {
        if level == 0 {
            self.tiles[wrap::<D>(row)][wrap::<D>(col)] = top;
        } else {
            let index = Self::index(level, col, row);
            self.upper[(index / D) % D][index % D] = top;
        }
    }

    pub(super) fn height() -> u32 {
        Self::HEIGHT
    }

    /// Place of a node of level ≥ 1 in `upper`: levels are stored one after
    /// the other, level `k` being (D/2ᵏ)² long.
    fn index(level: u32, col: i32, row: i32) -> usize {
        let side = D >> level;
        // Σ (D/2ʲ)² for 1 ≤ j < level
        let before = (D * D - 4 * side * side) / 3;
        let (col, row) = (col as usize & (side - 1), row as usize & (side - 1));
        before + row * side + col
    }
}

/// A tile column or row, wrapped onto the torus.
#[inline]
pub(super) const fn wrap<const D: usize>(index: i32) -> usize {
    index as usize % D
}
