//! From millimetres to cells and back.

use hapterra_core::Vec3;
use hapterra_core::grid::{GridPoint, MAX_CELL};

/// Millimetres a cell, and a vertical unit of the heights.
///
/// Frame: x east, y north, z up, origin at the south-west sample at height zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    cell_mm: f64,
    height_mm_per_unit: f64,
}

/// A number that no terrain can be scaled with.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum BadScale {
    /// A cell that is not longer than nothing.
    #[error("a cell of {0} mm in the hand: it must be longer than zero, and finite")]
    Cell(f64),
    /// A height that is not a number.
    #[error("{0} mm in the hand for a vertical unit: it must be finite")]
    Height(f64),
}

impl Scale {
    /// `cell_mm` millimetres a cell, `height_mm_per_unit` millimetres a vertical unit of the
    /// heights. A negative height turns the relief upside down.
    ///
    /// # Errors
    /// [`BadScale`] for a cell that is not positive, or numbers that are not finite or that single
    /// precision cannot hold.
    pub fn new(cell_mm: f64, height_mm_per_unit: f64) -> Result<Self, BadScale> {
        let as_single = cell_mm as f32;
        if !(as_single.is_normal() && as_single > 0.0) {
            return Err(BadScale::Cell(cell_mm));
        }
        if !height_mm_per_unit.is_finite() {
            return Err(BadScale::Height(height_mm_per_unit));
        }
        Ok(Self {
            cell_mm,
            height_mm_per_unit,
        })
    }

    /// Millimetres a cell.
    #[must_use]
    pub const fn cell_mm(&self) -> f64 {
        self.cell_mm
    }

    /// Millimetres a vertical unit.
    #[must_use]
    pub const fn height_mm_per_unit(&self) -> f64 {
        self.height_mm_per_unit
    }

    /// A height in cells.
    #[must_use]
    pub fn height_cells(&self, height: f64) -> f64 {
        height * self.height_mm_per_unit / self.cell_mm
    }

    /// A place in millimetres on the grid; `None` when it is not a number or farther than
    /// [`MAX_CELL`] cells from the origin.
    ///
    /// Worked out in `f64`; the fraction is rounded once, to `f32`. A place that [`Self::to_mm`]
    /// gives for a whole number of cells comes back as that number.
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

    /// A place on the grid in millimetres.
    #[must_use]
    pub fn to_mm(&self, point: &GridPoint) -> [f64; 3] {
        let frac = point.frac().to_array();
        core::array::from_fn(|i| (f64::from(point.cell()[i]) + f64::from(frac[i])) * self.cell_mm)
    }
}
