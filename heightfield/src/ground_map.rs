//! The map from a file's columns and rows to the coordinates of its reference system.

use geotiff_core::transform::GeoTransform;

use super::georeference::GroundTransform;

/// Smaller sines are rounding, not a rotation.
const STRAIGHT: f64 = 1e-6;

/// An affine map in file order: (0, 0) is the outer corner of the cell around the
/// file's first sample, whose centre is (0.5, 0.5).
#[derive(Clone, Copy, Debug)]
pub(super) struct GroundMap(GeoTransform);

/// A rectangle along the axes of a reference system, in its units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest x, or longitude.
    pub west: f64,
    /// Smallest y, or latitude.
    pub south: f64,
    /// Largest x, or longitude.
    pub east: f64,
    /// Largest y, or latitude.
    pub north: f64,
}

impl Bounds {
    /// Returns the smallest rectangle around some points; `None` without a finite point.
    pub(super) fn around(points: impl IntoIterator<Item = (f64, f64)>) -> Option<Self> {
        let empty = Self {
            west: f64::INFINITY,
            south: f64::INFINITY,
            east: f64::NEG_INFINITY,
            north: f64::NEG_INFINITY,
        };
        let all = points.into_iter().fold(empty, |all, (x, y)| Self {
            west: all.west.min(x),
            south: all.south.min(y),
            east: all.east.max(x),
            north: all.north.max(y),
        });
        let sides = [all.west, all.south, all.east, all.north];
        sides.iter().all(|side| side.is_finite()).then_some(all)
    }
}

impl GroundMap {
    /// Returns true if both maps place samples at the same coordinates, to a hundredth of a cell.
    pub(super) fn is_near(&self, other: &Self) -> bool {
        let steps = self.steps();
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)];
        corners.into_iter().all(|(column, row)| {
            let (own, theirs) = (self.at(column, row), other.at(column, row));
            let is_near =
                |own: f64, theirs: f64, step: f64| (own - theirs).abs() <= 0.01 * step.abs();
            is_near(own.0, theirs.0, steps.0) && is_near(own.1, theirs.1, steps.1)
        })
    }

    /// Returns the map from, for x and y each: the value at the outer corner of the first sample's
    /// cell, the step per column and the step per row. `None` unless these form a grid.
    pub(super) fn new(x: [f64; 3], y: [f64; 3]) -> Option<Self> {
        let map = Self(GeoTransform {
            origin_x: x[0],
            pixel_width: x[1],
            skew_x: x[2],
            origin_y: y[0],
            skew_y: y[1],
            pixel_height: y[2],
        });
        let (corner, steps) = (map.at(0.0, 0.0), map.steps());
        let finite = [corner, steps]
            .iter()
            .all(|(x, y)| x.is_finite() && y.is_finite());
        (finite && steps.0 > 0.0 && steps.1 > 0.0).then_some(map)
    }

    /// Returns the same map from the centre of the first sample.
    pub(super) fn from_centre(x: [f64; 3], y: [f64; 3]) -> Option<Self> {
        let corner = |[at, column, row]: [f64; 3]| [at - (column + row) / 2.0, column, row];
        Self::new(corner(x), corner(y))
    }

    /// Returns the map of samples that lie at `ground`.
    pub(super) fn of_samples(ground: &GroundTransform) -> Option<Self> {
        let ([x, y], along, up) = (
            ground.to_ground([0.0; 2]),
            ground.column_step(),
            ground.row_step(),
        );
        Self::from_centre([x, along[0], up[0]], [y, along[1], up[1]])
    }

    /// Returns the map of the samples themselves, which are in the middle of their cells; `None` if
    /// all of them lie on a line.
    pub(super) fn of_centres(&self) -> Option<GroundTransform> {
        let map = &self.0;
        GroundTransform::new(
            self.at(0.5, 0.5).into(),
            [map.pixel_width, map.skew_y],
            [map.skew_x, map.pixel_height],
        )
    }

    /// Returns the map of north-up cells from the south-west corner of the field.
    pub(super) fn from_south_west(
        (west, south): (f64, f64),
        (east, north): (f64, f64),
        rows: u32,
    ) -> Option<Self> {
        let top = south + north * f64::from(rows);
        Self::new([west, east, 0.0], [top, 0.0, -north])
    }

    /// Returns the coordinates of a position in columns and rows.
    pub(super) fn at(&self, column: f64, row: f64) -> (f64, f64) {
        self.0.pixel_to_geo(column, row)
    }

    /// Returns the distance between columns, and between rows.
    pub(super) fn steps(&self) -> (f64, f64) {
        let map = &self.0;
        (
            map.pixel_width.hypot(map.skew_y),
            map.skew_x.hypot(map.pixel_height),
        )
    }

    /// Returns true if rows run along x and columns along y.
    pub(super) fn is_straight(&self) -> bool {
        let (east, south) = self.steps();
        self.0.skew_y.abs() <= STRAIGHT * east && self.0.skew_x.abs() <= STRAIGHT * south
    }

    /// Returns true if the first row is the southernmost; for a rotated grid, if it is mirrored.
    pub(super) fn is_south_up(&self) -> bool {
        let map = &self.0;
        match self.is_straight() {
            true => map.pixel_height > 0.0,
            false => map.pixel_width * map.pixel_height - map.skew_x * map.skew_y > 0.0,
        }
    }

    /// Returns true if the first column is the easternmost.
    pub(super) fn is_east_first(&self) -> bool {
        self.is_straight() && self.0.pixel_width < 0.0
    }

    /// Returns the angle of the rows against x, counter-clockwise, in degrees.
    pub(super) fn rotation(&self) -> f64 {
        self.0.skew_y.atan2(self.0.pixel_width).to_degrees()
    }

    /// Returns the cosine of the angle between a row and a northward column.
    pub(super) fn shear(&self) -> f64 {
        let (map, (east, south)) = (&self.0, self.steps());
        let along = map.pixel_width * map.skew_x + map.skew_y * map.pixel_height;
        match self.is_straight() {
            true => 0.0,
            false if self.is_south_up() => along / (east * south),
            false => -along / (east * south),
        }
    }

    /// Returns the steps in coordinates to the next sample eastwards along a row and northwards
    /// along a column, whatever the order of the file.
    pub(super) fn steps_east_and_north(&self) -> ([f64; 2], [f64; 2]) {
        let map = &self.0;
        let turned = |step: [f64; 2], is_turned: bool| match is_turned {
            true => step.map(|part| -part),
            false => step,
        };
        (
            turned([map.pixel_width, map.skew_y], self.is_east_first()),
            turned([map.skew_x, map.pixel_height], !self.is_south_up()),
        )
    }

    /// Returns the outer edges of all cells of a field of columns and rows.
    pub(super) fn bounds(&self, (columns, rows): (u32, u32)) -> Option<Bounds> {
        let (columns, rows) = (f64::from(columns), f64::from(rows));
        let corners = [(0.0, 0.0), (columns, 0.0), (0.0, rows), (columns, rows)];
        Bounds::around(corners.map(|(column, row)| self.at(column, row)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_the_outer_edges_of_the_cells() {
        let north_up = GroundMap::from_south_west((500.0, 100.0), (10.0, 20.0), 3);
        let by_centre = GroundMap::from_centre([505.0, 10.0, 0.0], [150.0, 0.0, -20.0]);
        for map in [north_up, by_centre] {
            let map = map.expect("a grid");
            let bounds = map.bounds((4, 3)).expect("finite");
            let sides = [bounds.west, bounds.south, bounds.east, bounds.north];
            assert_eq!(sides, [500.0, 100.0, 540.0, 160.0]);
            assert!(!map.is_south_up() && !map.is_east_first());
        }
        let mirrored = GroundMap::new([540.0, -10.0, 0.0], [100.0, 0.0, 20.0]).expect("a grid");
        assert!(mirrored.is_south_up() && mirrored.is_east_first());
        assert_eq!(mirrored.bounds((4, 3)).expect("finite").west, 500.0);
    }

    #[test]
    fn degenerate_or_non_finite_grid_is_rejected() {
        assert!(GroundMap::new([0.0, 0.0, 0.0], [0.0, 0.0, -1.0]).is_none());
        assert!(GroundMap::new([f64::NAN, 1.0, 0.0], [0.0, 0.0, -1.0]).is_none());
        assert!(GroundMap::new([0.0, f64::INFINITY, 0.0], [0.0, 0.0, -1.0]).is_none());
    }
}
