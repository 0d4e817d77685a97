//! Distortion of haptic cells away from the place where they were measured.
//!
//! All haptic cells have the size of the file's cells at one place. The file's own cells vary:
//! cells in degrees get narrower towards the poles, and a map's scale changes.

use super::haptic_grid::HapticGrid;
use heightfield::{CellSize, Sides};

/// Places checked along each side of a rectangle, ends included: the size of cells changes
/// smoothly.
const PLACES: u32 = 17;

/// The most distorted haptic cell of a rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    /// Relative error of lengths, and so of slopes, in the worst direction: 0.01 is one hundredth.
    pub share: f64,
    /// Its place, in the file's coordinates.
    pub ground: [f64; 2],
}

impl Distortion {
    /// Max distortion of a surface that counts as true, as a share.
    pub const MAX_TRUE_SHARE: f64 = 1e-3;

    /// Returns true if the distortion exceeds 0.1 % somewhere in the rectangle.
    #[must_use]
    pub fn is_noticeable(&self) -> bool {
        self.share > Self::MAX_TRUE_SHARE
    }
}

impl HapticGrid<'_> {
    /// Returns the most distorted haptic cell of a rectangle (west, south, east, north, in haptic
    /// cells), among 17 × 17 places of the part inside the raster. `None` if the file does not
    /// state its cell size, or the rectangle lies outside the raster.
    #[must_use]
    pub fn worst_in(&self, [west, south, east, north]: Sides) -> Option<Distortion> {
        let last = [self.columns(), self.rows()].map(|count| f64::from(count) - 1.0);
        let (low, high) = (
            [west.max(0.0), south.max(0.0)],
            [east.min(last[0]), north.min(last[1])],
        );
        if low[0] > high[0] || low[1] > high[1] {
            return None;
        }
        let share = |place: u32| f64::from(place) / f64::from(PLACES - 1);
        let places = (0..PLACES).flat_map(|row| (0..PLACES).map(move |column| [column, row]));
        let distortion = places.filter_map(|place| {
            let along = |axis: usize| low[axis] + share(place[axis]) * (high[axis] - low[axis]);
            let ground = self.to_ground([along(0), along(1)]);
            let cell = self.raster().georeference().cell_at(ground)?;
            let share = self.distortion_of(&cell)?;
            Some(Distortion { share, ground })
        });
        distortion.max_by(|one, other| one.share.total_cmp(&other.share))
    }

    /// Returns the deviation of the longest and the shortest side of a haptic cell in any
    /// direction, as a share, for file cells of a size.
    fn distortion_of(&self, cell: &CellSize) -> Option<f64> {
        let side = self.side_m()?;
        let ((long, high), cosine) = (cell.ground_metres(), cell.lean);
        let sine = (1.0 - cosine * cosine).sqrt();
        let on_ground = |[columns, rows]: [f64; 2]| {
            let (along, up) = (columns * long / side, rows * high / side);
            [along + up * cosine, up * sine]
        };
        let [east, north] = self.steps_in_file().map(on_ground);
        // The singular values of the matrix with these columns.
        let sum = 0.5 * (dot(east, east) + dot(north, north));
        let apart = (0.5 * (dot(east, east) - dot(north, north))).hypot(dot(east, north));
        let lengths = [sum + apart, sum - apart].map(|square| square.max(0.0).sqrt());
        Some(
            lengths
                .map(|length| (length - 1.0).abs())
                .into_iter()
                .fold(0.0, f64::max),
        )
    }
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::HapticCells;
    use crate::terrain::haptic_grid::tests::cell;
    use heightfield::Raster;

    fn grid_distortion(lean: f64, (east, north): (f64, f64), cells: HapticCells) -> f64 {
        let raster = Raster::from_fn(9, 9, |_, _| 0.0)
            .expect("a raster")
            .with_cell(cell(east, north, lean));
        let grid = HapticGrid::new(&raster, cells);
        grid.worst_in([-5.0, 2.0, 3.0, 90.0]).expect("known").share
    }

    /// A cell of 40 × 10 is rendered as one of 20 × 20: half as long in one direction, twice in the
    /// other. The error of a cell that leans by 60° follows from the eigenvalues of its metric, 1 ±
    /// cos 60°, and its area, sin 60°.
    #[test]
    fn stored_cell_distortion_is_that_of_the_worst_direction() {
        for (lean, sides, expected) in [
            (0.0, (40.0, 10.0), 1.0),
            (0.5, (10.0, 10.0), (1.5 / 0.75_f64.sqrt()).sqrt() - 1.0),
            (0.0, (10.0, 10.0), 0.0),
        ] {
            let distortion = grid_distortion(lean, sides, HapticCells::Stored);
            assert!(
                (distortion - expected).abs() < 1e-9,
                "{distortion} for {expected}"
            );
            assert!(grid_distortion(lean, sides, HapticCells::Square) < 1e-9);
        }
    }

    #[test]
    fn rectangle_beside_the_field_has_no_distortion() {
        let raster = Raster::from_fn(9, 9, |_, _| 0.0).expect("a raster");
        let grid = HapticGrid::new(&raster, HapticCells::Square);
        assert_eq!(grid.worst_in([9.0, 0.0, 12.0, 5.0]), None);
        assert_eq!(grid.worst_in([0.0, -7.0, 3.0, -1.0]), None);
    }
}
