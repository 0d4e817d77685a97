//! A height, exact far from zero.

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
    pub(crate) fn above(self, base: i32) -> f32 {
        self.cell.wrapping_sub(base) as f32 + self.frac
    }
}
