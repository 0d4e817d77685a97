//! From millimetres to cells and back.

use hapterra_core::Vec3;
use hapterra_core::grid::{GridPoint, MAX_CELL};

/// Millimetres of a cell and of a vertical unit of the heights.
///
/// Frame: x east, y north, z up, origin at the south-west sample at height zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    cell_mm: f64,
    height_mm_per_unit: f64,
}

/// A number that is no valid scale.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ScaleError {
    /// The side of a cell is not positive.
    #[error("a cell of {0} mm in the hand: it must be longer than zero, and finite")]
    Cell(f64),
    /// The height is not finite.
    #[error("{0} mm in the hand for a vertical unit: it must be finite")]
    Height(f64),
}

impl Scale {
    /// Creates a scale of `cell_mm` millimetres a cell and `height_mm_per_unit` millimetres a
    /// vertical unit of the heights. A negative height turns the relief upside down.
    ///
    /// # Errors
    /// [`ScaleError`] for a cell that is not positive, or numbers that are not finite or that
    /// single precision cannot represent.
    pub fn new(cell_mm: f64, height_mm_per_unit: f64) -> Result<Self, ScaleError> {
        let as_single = cell_mm as f32;
        if !(as_single.is_normal() && as_single > 0.0) {
            return Err(ScaleError::Cell(cell_mm));
        }
        if !height_mm_per_unit.is_finite() {
            return Err(ScaleError::Height(height_mm_per_unit));
        }
        Ok(Self {
            cell_mm,
            height_mm_per_unit,
        })
    }

    /// Returns the millimetres of a cell.
    #[must_use]
    pub const fn cell_mm(&self) -> f64 {
        self.cell_mm
    }

    /// Returns the millimetres of a vertical unit.
    #[must_use]
    pub const fn height_mm_per_unit(&self) -> f64 {
        self.height_mm_per_unit
    }

    /// Returns the scale of the same terrain, equally large in the hand, with every `2^level`-th
    /// sample only: its cells are larger by that factor.
    #[must_use]
    pub fn at_level(&self, level: u8) -> Self {
        Self {
            cell_mm: libm::ldexp(self.cell_mm, level.into()),
            ..*self
        }
    }

    /// Returns the scale of the same terrain, equally large in the hand, with cells divided into
    /// `parts`.
    #[must_use]
    pub fn in_parts(&self, parts: u32) -> Self {
        Self {
            cell_mm: self.cell_mm / f64::from(parts),
            ..*self
        }
    }

    /// Returns a height in cells.
    #[must_use]
    pub fn height_cells(&self, height: f64) -> f64 {
        height * self.height_mm_per_unit / self.cell_mm
    }

    /// Converts a position in millimetres to the grid; `None` if it is not a number or farther than
    /// [`MAX_CELL`] cells from the origin.
    ///
    /// Computed in `f64`; the fraction is rounded once, to `f32`. If [`Self::to_mm`] computed the
    /// position from a whole number of cells, the result is that number.
    #[must_use]
    pub fn to_grid(&self, mm: [f64; 3]) -> Option<GridPoint> {
        let cells = mm.map(|mm| {
            let (cells, whole) = (mm / self.cell_mm, libm::round(mm / self.cell_mm));
            if whole * self.cell_mm == mm {
                whole
            } else {
                cells
            }
        });
        let max = f64::from(MAX_CELL);
        if !cells.iter().all(|c| c.abs() <= max) {
            return None;
        }
        let whole = cells.map(libm::floor);
        let frac: [f32; 3] = core::array::from_fn(|i| (cells[i] - whole[i]) as f32);
        // A fraction that was rounded up to one is carried over.
        Some(GridPoint::new(
            whole.map(|w| w as i32),
            Vec3::from_array(frac),
        ))
    }

    /// Converts a position on the grid to millimetres.
    #[must_use]
    pub fn to_mm(&self, point: &GridPoint) -> [f64; 3] {
        let frac = point.frac().to_array();
        core::array::from_fn(|i| (f64::from(point.cell()[i]) + f64::from(frac[i])) * self.cell_mm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grid_points_convert_back_to_mm() {
        let scale = Scale::new(0.25, 1.0).expect("valid");
        for mm in [[0.1, -0.1, 1e6], [-1e-12, 0.25, -0.25], [1e8, -1e8, 0.0]] {
            let point = scale.to_grid(mm).expect("addressable");
            assert!(point.frac().max_element() < 1.0);
            for (back, mm) in scale.to_mm(&point).into_iter().zip(mm) {
                assert!((back - mm).abs() <= 0.25 * 2f64.powi(-24), "{back} {mm}");
            }
        }
        // Whole cells of lengths that are not exact in binary.
        let scale = Scale::new(0.7, 1.0).expect("valid");
        for cell in 0..2000 {
            let point = GridPoint::new([cell, -cell, 3], Vec3::ZERO);
            assert_eq!(scale.to_grid(scale.to_mm(&point)), Some(point));
        }
        let scale = Scale::new(0.25, 1.0).expect("valid");
        // A position just below a whole cell rounds up into the next.
        let below = scale.to_grid([-1e-12, 0.0, 0.0]).expect("addressable");
        assert_eq!((below.cell()[0], below.frac().x), (0, 0.0));
    }

    #[test]
    fn unaddressable_position_has_no_grid_point() {
        let scale = Scale::new(1.0, 1.0).expect("valid");
        for bad in [f64::NAN, f64::INFINITY, 5.4e8, -5.4e8] {
            assert_eq!(scale.to_grid([0.0, bad, 0.0]), None);
        }
        assert!(scale.to_grid([f64::from(MAX_CELL), 0.0, 0.0]).is_some());
    }

    #[test]
    fn invalid_scales_are_refused_and_a_level_keeps_the_size() {
        for cell in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-60, 1e60] {
            assert!(Scale::new(cell, 1.0).is_err(), "{cell}");
        }
        assert!(Scale::new(1.0, f64::NAN).is_err());
        let plain = Scale::new(2.0, 3.0).expect("valid");
        let scale = plain.at_level(3);
        assert_eq!(scale.in_parts(8), plain);
        assert_eq!((scale.cell_mm(), scale.height_cells(16.0)), (16.0, 3.0));
    }
}
