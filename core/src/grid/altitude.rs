//! A height, exact far from zero.

/// A height: whole cells and a fraction in `[0, 1)`.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Altitude {
    cell: i32,
    frac: f32,
}

impl Altitude {
    /// Creates the altitude `cell + frac`.
    #[must_use]
    pub const fn new(cell: i32, frac: f32) -> Self {
        Self { cell, frac }
    }

    /// Returns the whole cells, rounded down.
    #[must_use]
    pub const fn cell(self) -> i32 {
        self.cell
    }

    /// Returns `height`, counted in cells from `base`, relative to this altitude.
    ///
    /// The whole cells are subtracted first, so nearby heights lose no bit.
    #[must_use]
    #[inline]
    pub fn up_to(self, base: i32, height: f32) -> f32 {
        (height - self.cell.wrapping_sub(base) as f32) - self.frac
    }

    /// Returns the height above `base` in cells. Monotonic in the altitude.
    #[must_use]
    #[inline]
    pub(crate) fn above(self, base: i32) -> f32 {
        self.cell.wrapping_sub(base) as f32 + self.frac
    }
}
