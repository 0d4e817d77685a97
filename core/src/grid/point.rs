//! A position over the terrain.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::cell::{Cell, MAX_CELL};

/// A position in cells: `cell + frac`, with every fraction in `[0, 1)`.
///
/// Axes: x east, y north, z up. Resolution is 2⁻²⁴ cell at worst, anywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GridPoint {
    cell: [i32; 3],
    frac: [f32; 3],
}

impl GridPoint {
    /// Creates the point `offset` cells away from the lower corner of `cell`.
    ///
    /// `offset` may lie outside `[0, 1)`; whole cells are carried over. A
    /// component that is not a number counts as zero, and cells are clamped to
    /// ±[`MAX_CELL`], so that any input results in a valid point.
    #[must_use]
    pub fn new(cell: [i32; 3], offset: Vec3) -> Self {
        let (x, fx) = carry(cell[0], offset.x);
        let (y, fy) = carry(cell[1], offset.y);
        let (z, fz) = carry(cell[2], offset.z);
        Self {
            cell: [x, y, z],
            frac: [fx, fy, fz],
        }
    }

    /// Creates the point `height` cells above the cell's floor, at a place in `[0, 1)` over it:
    /// [`Self::new`] if only the height can carry over.
    #[inline]
    pub(crate) fn over([x, y, z]: [i32; 3], [u, v]: [f32; 2], height: f32) -> Self {
        let (z, fz) = if (0.0..1.0).contains(&height) {
            (z, height)
        } else {
            carry(z, height)
        };
        Self {
            cell: [x, y, z],
            frac: [u, v, fz],
        }
    }

    /// Returns a valid point for any bits, such as those of a received message.
    #[must_use]
    pub fn normalised(self) -> Self {
        Self::new(self.cell, self.frac())
    }

    /// Returns the cell that contains the point: east, north and up.
    #[must_use]
    pub const fn cell(&self) -> [i32; 3] {
        self.cell
    }

    /// Returns the cell's column and row: the patch over or under the point.
    #[must_use]
    pub const fn column(&self) -> Cell {
        Cell::new(self.cell[0], self.cell[1])
    }

    /// Returns true if the point is over or under a line of the grid, on which patches meet.
    #[must_use]
    #[inline]
    pub const fn is_on_grid_line(&self) -> bool {
        self.frac[0] == 0.0 || self.frac[1] == 0.0
    }

    /// Returns the position in the cell, each component in `[0, 1)`.
    #[must_use]
    pub const fn frac(&self) -> Vec3 {
        Vec3::from_array(self.frac)
    }

    /// Returns the displacement in cells from this point to `other`.
    ///
    /// Exact to 2⁻²⁴ cell, or to half an ulp of the result if that is more.
    #[must_use]
    pub fn to(&self, other: &Self) -> Vec3 {
        let part = other.frac() - self.frac();
        Vec3::new(
            other.cell[0].wrapping_sub(self.cell[0]) as f32 + part.x,
            other.cell[1].wrapping_sub(self.cell[1]) as f32 + part.y,
            other.cell[2].wrapping_sub(self.cell[2]) as f32 + part.z,
        )
    }

    /// Returns the point in cells relative to the lower corner of `cell`.
    #[must_use]
    pub fn relative_to(&self, cell: [i32; 3]) -> Vec3 {
        Vec3::new(
            self.cell[0].wrapping_sub(cell[0]) as f32 + self.frac[0],
            self.cell[1].wrapping_sub(cell[1]) as f32 + self.frac[1],
            self.cell[2].wrapping_sub(cell[2]) as f32 + self.frac[2],
        )
    }

    /// Returns the point half-way to `other`, exact to 2⁻²⁴ cell at any distance.
    #[must_use]
    pub fn midpoint(&self, other: &Self) -> Self {
        let (x, fx) = half(self.cell[0], other.cell[0], self.frac[0] + other.frac[0]);
        let (y, fy) = half(self.cell[1], other.cell[1], self.frac[1] + other.frac[1]);
        let (z, fz) = half(self.cell[2], other.cell[2], self.frac[2] + other.frac[2]);
        Self::new([x, y, z], Vec3::new(fx, fy, fz))
    }

    /// Returns true if this point is lower than `other`.
    #[must_use]
    #[inline]
    pub fn is_below(&self, other: &Self) -> bool {
        let (here, there) = (self.cell[2], other.cell[2]);
        here < there || (here == there && self.frac[2] < other.frac[2])
    }

    /// Returns true if both points have the same bits.
    ///
    /// Every tick of a HIP at rest calls it, so it avoids a call of `memcmp`.
    #[must_use]
    #[inline]
    pub fn is_same(&self, other: &Self) -> bool {
        let bits = |point: &Self| {
            let [x, y, z] = point.cell.map(|cell| cell as u32);
            let [u, v, w] = point.frac.map(f32::to_bits);
            [x, y, z, u, v, w]
        };
        let ([a, b, c, d, e, f], [g, h, i, j, k, l]) = (bits(self), bits(other));
        if cfg!(target_pointer_width = "64") {
            // In pairs: a register holds two words.
            let pair = |low: u32, high: u32| u64::from(high) << 32 | u64::from(low);
            (pair(a, b) ^ pair(g, h)) | (pair(c, d) ^ pair(i, j)) | (pair(e, f) ^ pair(k, l)) == 0
        } else {
            (a ^ g) | (b ^ h) | (c ^ i) | (d ^ j) | (e ^ k) | (f ^ l) == 0
        }
    }
}

/// Maximum offset of the fast path, cells: far too small to bring an out-of-range cell back into
/// range.
const MAX_FAST_OFFSET: f32 = 1e6;

/// `cell + offset` with the whole cells of `offset` carried over.
///
/// Truncation with two corrections replaces `floor`, for which the Cortex-M4F has no instruction.
#[inline]
fn carry(cell: i32, offset: f32) -> (i32, f32) {
    // The usual case: a place in its own patch.
    if (0.0..1.0).contains(&offset) {
        return (cell.clamp(-MAX_CELL, MAX_CELL), offset);
    }
    // The next most frequent case: a few cells away, where nothing has to saturate.
    if offset.abs() < MAX_FAST_OFFSET {
        let whole = offset as i32;
        let floor = whole - i32::from(offset < whole as f32);
        let frac = offset - floor as f32;
        let cell = cell.wrapping_add(floor);
        // -1e-9 + 1 rounds to 1.
        if frac < 1.0 && cell.unsigned_abs() <= MAX_CELL as u32 {
            return (cell, frac);
        }
    }
    carry_any(cell, offset)
}

/// Carries any offset over.
#[cold]
fn carry_any(cell: i32, offset: f32) -> (i32, f32) {
    let whole = offset as i32;
    let mut cell = cell.saturating_add(whole);
    let mut frac = offset - whole as f32;
    if frac < 0.0 {
        frac += 1.0;
        cell = cell.saturating_sub(1);
    }
    // -1e-9 + 1 rounds to 1; infinities and NaN are in no range at all.
    if !(0.0..1.0).contains(&frac) {
        cell = cell.saturating_add(i32::from(frac == 1.0));
        frac = 0.0;
    }
    (cell.clamp(-MAX_CELL, MAX_CELL), frac)
}

fn half(a: i32, b: i32, frac_sum: f32) -> (i32, f32) {
    let sum = a + b; // both within ±MAX_CELL
    (sum >> 1, 0.5 * ((sum & 1) as f32 + frac_sum))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fast_paths_of_carry_return_the_same_bits() {
        let mut offsets = std::vec![
            0.0,
            1.0,
            1e-9,
            0.5,
            MAX_FAST_OFFSET,
            1e9,
            f32::MAX,
            f32::INFINITY
        ];
        let mut x = 1e-12_f32;
        while x < 3e6 {
            let whole = (x as i32) as f32;
            offsets.extend([x, whole, whole.next_up(), whole.next_down()]);
            x *= if cfg!(miri) { 1.37 } else { 1.003_7 };
        }
        let cells = [
            0,
            7,
            -7,
            MAX_CELL - 1,
            MAX_CELL,
            -MAX_CELL,
            i32::MAX,
            i32::MIN,
        ];
        for offset in offsets.into_iter().flat_map(|x| [x, -x]) {
            for cell in cells {
                let (fast, any) = (carry(cell, offset), carry_any(cell, offset));
                let bits = |(cell, frac): (i32, f32)| (cell, frac.to_bits());
                assert_eq!(bits(fast), bits(any), "{cell} + {offset:e}");
            }
        }
    }

    #[test]
    fn points_are_same_only_if_every_word_is() {
        let point = GridPoint {
            cell: [5, -6, 7],
            frac: [0.25, 0.5, 0.75],
        };
        assert!(point.is_same(&point));
        for i in 0..3 {
            let (mut moved, mut nudged) = (point, point);
            moved.cell[i] ^= 1;
            nudged.frac[i] = nudged.frac[i].next_up();
            for other in [moved, nudged] {
                assert!(
                    !point.is_same(&other) && !other.is_same(&point),
                    "{other:?}"
                );
            }
        }
    }

    #[test]
    fn whole_cells_are_carried_in_both_directions() {
        let p = GridPoint::new([5, 5, 5], Vec3::new(2.25, -0.25, -3.0));
        assert_eq!(p.cell(), [7, 4, 2]);
        assert_eq!(p.frac(), Vec3::new(0.25, 0.75, 0.0));
    }

    #[test]
    fn fraction_never_reaches_one() {
        let p = GridPoint::new([0; 3], Vec3::new(-1e-9, -f32::MIN_POSITIVE, 0.999_999_97));
        assert_eq!(p.cell(), [0, 0, 0]);
        assert!(p.frac().max_element() < 1.0);
    }

    #[test]
    fn point_is_valid_for_non_finite_or_huge_input() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30, -1e30] {
            let p = GridPoint::new([i32::MAX, i32::MIN, 0], Vec3::splat(bad));
            assert!(p.cell().iter().all(|c| c.abs() <= MAX_CELL));
            assert!(p.frac().is_finite() && p.frac().min_element() >= 0.0);
        }
    }

    #[test]
    fn midpoint_is_exact_at_the_largest_cells() {
        let a = GridPoint::new([-MAX_CELL, MAX_CELL, 3], Vec3::new(0.5, 0.0, 0.25));
        let b = GridPoint::new([-MAX_CELL + 5, MAX_CELL - 1, 4], Vec3::new(0.0, 0.0, 0.25));
        let m = a.midpoint(&b);
        assert_eq!(a.to(&m), Vec3::new(2.25, -0.5, 0.5));
        assert_eq!(m.to(&b), Vec3::new(2.25, -0.5, 0.5));
    }
}
