//! Length and direction on the ground of a step in coordinates.

use super::geometry::CellSize;
use super::globe::Globe;

/// Smaller cosines are rounding in the projection's formulas: a shear of a millionth is not
/// noticeable.
const STRAIGHT: f64 = 1e-6;
/// Cells whose columns lean more than this towards their rows are invalid.
const FLATTENED: f64 = 0.999;

/// Vectors on the ground of a unit of x and of y at a position, metres: tangents of the globe, both
/// in the same frame.
///
/// They may differ in length and need not be perpendicular: most projections that are not conformal
/// shear the ground, more so far from their centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tangents {
    pub(super) x: [f64; 3],
    pub(super) y: [f64; 3],
}

impl Tangents {
    /// Returns the tangents of longitude and latitude in units of `degrees`.
    pub(super) fn of_angles(globe: &Globe, latitude: f64, degrees: f64) -> Self {
        let [east, north] = globe.metres_per_degree(latitude);
        Self {
            x: [east * degrees, 0.0, 0.0],
            y: [0.0, north * degrees, 0.0],
        }
    }

    /// Returns the size of a cell at the position, from the steps of its columns and rows in
    /// coordinates; `None` if it has no area there.
    pub(super) fn cell(
        &self,
        cell: CellSize,
        column_step: [f64; 2],
        row_step: [f64; 2],
    ) -> Option<CellSize> {
        let (along, up) = (self.displacement(column_step), self.displacement(row_step));
        let (long, high) = (dot(along, along).sqrt(), dot(up, up).sqrt());
        let (east, north) = cell.metres();
        let lean = dot(along, up) / (long * high);
        (lean.abs() < FLATTENED).then_some(CellSize {
            map_scale: (long / east, high / north),
            lean: if lean.abs() < STRAIGHT { 0.0 } else { lean },
            ..cell
        })
    }

    fn displacement(&self, [dx, dy]: [f64; 2]) -> [f64; 3] {
        [0, 1, 2].map(|axis| dx * self.x[axis] + dy * self.y[axis])
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
