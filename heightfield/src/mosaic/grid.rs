//! The grid that files share, and the position of each file on it.

use std::path::{Path, PathBuf};

use super::super::decoded::Decoded;
use super::super::{Bounds, RasterError};

/// Max offset of a file's samples from the first file's grid, cells.
const TOLERANCE: f64 = 0.05;
/// Max size of a grid, samples per direction.
const MAX: f64 = 2_147_483_647.0;

/// The grid of the first file.
pub(super) struct Grid {
    path: PathBuf,
    /// Header of that file.
    pub(super) first: Decoded,
    /// South-west corner of that file.
    corner: [f64; 2],
    /// Size of a cell.
    pub(super) step: [f64; 2],
}

/// Position of a file on the grid: its south-western sample, counted from the first file's, and its
/// size.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Spot {
    /// Its first column, from the west.
    pub(super) column: i64,
    /// Its first row, from the south.
    pub(super) row: i64,
    /// Samples per row.
    pub(super) columns: u32,
    /// Rows.
    pub(super) rows: u32,
}

impl Grid {
    /// Returns the grid of a file.
    pub(super) fn of(path: &Path, first: Decoded) -> Result<Self, RasterError> {
        let (bounds, step) = bounds_and_step(path, &first)?;
        Ok(Self {
            path: path.to_owned(),
            first,
            corner: [bounds.west, bounds.south],
            step,
        })
    }

    /// Returns the position of a file on the grid.
    ///
    /// # Errors
    /// [`RasterError::TilesDiffer`], with the difference.
    pub(super) fn spot(&self, path: &Path, file: &Decoded) -> Result<Spot, RasterError> {
        let differs = |why: String| RasterError::TilesDiffer {
            file: path.to_owned(),
            other: self.path.clone(),
            why,
        };
        self.same_system(file).map_err(differs)?;
        let (bounds, step) = bounds_and_step(path, file)?;
        let size = [file.columns, file.rows].map(f64::from);
        let corner = [bounds.west, bounds.south];
        let mut at = [0; 2];
        for axis in 0..2 {
            let stretch = (step[axis] / self.step[axis] - 1.0).abs();
            if !(stretch < 0.5 && stretch * size[axis] <= TOLERANCE) {
                let [of_file, of_grid] = [step, self.step].map(|[x, y]| format!("{x} × {y}"));
                return Err(differs(format!(
                    "its cells are {of_file} units of its coordinates, not {of_grid}"
                )));
            }
            let cells = (corner[axis] - self.corner[axis]) / self.step[axis];
            let offset = (cells - cells.round()).abs();
            if cells.is_nan() || cells.abs() >= MAX {
                return Err(differs("it is too far away for one grid".into()));
            }
            if offset > TOLERANCE {
                return Err(differs(format!(
                    "its samples are {offset:.2} cells beside the common grid"
                )));
            }
            at[axis] = cells.round() as i64;
        }
        Ok(Spot {
            column: at[0],
            row: at[1],
            columns: file.columns,
            rows: file.rows,
        })
    }

    fn same_system(&self, file: &Decoded) -> Result<(), String> {
        let [ours, theirs] = [&self.first, file];
        let name = |decoded: &Decoded| match &decoded.system {
            Some(system) => match system.code() {
                Some(code) => format!("EPSG:{code} {}", system.name()),
                None => system.name().to_owned(),
            },
            None => "no reference system".into(),
        };
        let code = |decoded: &Decoded| decoded.system.as_ref().and_then(|system| system.code());
        let same = match (code(ours), code(theirs)) {
            (Some(a), Some(b)) => {
                let mut both = ours.system.iter().zip(&theirs.system);
                a == b && both.all(|(ours, theirs)| ours.has_unit_of(theirs))
            }
            _ => ours.system == theirs.system || same_places(ours, theirs),
        };
        if !same {
            return Err(format!("it states {}, not {}", name(theirs), name(ours)));
        }
        let unit = |decoded: &Decoded| decoded.metres_per_vertical_unit;
        if unit(ours).unwrap_or(1.0) != unit(theirs).unwrap_or(1.0) {
            return Err("its heights are in another unit".into());
        }
        let datum = |decoded: &Decoded| decoded.vertical_datum.as_ref().and_then(|it| it.code);
        match (datum(ours), datum(theirs)) {
            (Some(ours), Some(theirs)) if ours != theirs => Err(format!(
                "its heights count from EPSG:{theirs}, not EPSG:{ours}"
            )),
            _ => Ok(()),
        }
    }

    /// Returns the columns around the globe, if coordinates are angles and this is an integer.
    pub(super) fn columns_around(&self) -> Option<i64> {
        use super::super::CellUnit;
        let is_angle = self.first.cell?.unit == CellUnit::Degree;
        let degrees = self.first.place?.degrees;
        let columns = 360.0 / degrees / self.step[0];
        let whole = (columns - columns.round()).abs() <= TOLERANCE && columns < MAX;
        (is_angle && whole).then_some(columns.round() as i64)
    }

    /// Returns the south-west corner of the sample at a column and row.
    pub(super) fn corner_of(&self, column: i64, row: i64) -> [f64; 2] {
        let along = |axis: usize, index: i64| self.corner[axis] + index as f64 * self.step[axis];
        [along(0, column), along(1, row)]
    }
}

/// Returns true if both systems convert the corners of the second file to the same positions: the
/// same system can have different texts.
fn same_places(ours: &Decoded, theirs: &Decoded) -> bool {
    const DEGREES: f64 = 1e-7;
    let (Some(first), Some(second)) = (&ours.system, &theirs.system) else {
        return false;
    };
    let Some(bounds) = theirs.bounds() else {
        return false;
    };
    let corners = [(bounds.west, bounds.south), (bounds.east, bounds.north)];
    corners.into_iter().all(|corner| {
        let places = first.to_lonlat(corner).zip(second.to_lonlat(corner));
        places.is_some_and(|((x, y), (other_x, other_y))| {
            (x - other_x).abs() < DEGREES && (y - other_y).abs() < DEGREES
        })
    })
}

/// Returns bounds and cell size of a file whose rows and columns are along its coordinates.
fn bounds_and_step(path: &Path, file: &Decoded) -> Result<(Bounds, [f64; 2]), RasterError> {
    let in_tile = |fault| RasterError::in_tile(path, fault);
    let map = file
        .place
        .map(|place| place.map)
        .ok_or_else(|| in_tile(RasterError::NoPlace("it does not state its place".into())))?;
    if !map.is_straight() {
        let why = "its rows are not along its coordinates".into();
        return Err(in_tile(RasterError::NoPlace(why)));
    }
    let bounds = map.bounds((file.columns, file.rows));
    let bounds = bounds.ok_or_else(|| in_tile(RasterError::damaged("its place is invalid")))?;
    let (east, north) = map.steps();
    Ok((bounds, [east, north]))
}

/// Moves files by full turns around the globe, so that files on both sides of the 180th meridian
/// are neighbours, if that makes the terrain narrower.
pub(super) fn unwrap_turns(spots: &mut [Spot], around: i64) {
    let width = |spots: &[Spot], start: &dyn Fn(&Spot) -> i64| {
        let ends = spots
            .iter()
            .map(|spot| start(spot) + i64::from(spot.columns));
        let starts = spots.iter().map(start);
        ends.max().unwrap_or(0) - starts.min().unwrap_or(0)
    };
    let Some(from) = after_widest_gap(spots, around) else {
        return;
    };
    let turned = |spot: &Spot| from + (spot.column - from).rem_euclid(around);
    if width(spots, &turned) < width(spots, &|spot| spot.column) {
        // The first file is not moved.
        let back = spots
            .first()
            .map_or(0, |first| first.column - turned(first));
        for spot in spots {
            spot.column = turned(spot) + back;
        }
    }
}

/// Returns the first column after the widest gap between files on the circle of longitudes.
fn after_widest_gap(spots: &[Spot], around: i64) -> Option<i64> {
    let mut arcs: Vec<(i64, i64)> = spots
        .iter()
        .map(|spot| (spot.column.rem_euclid(around), i64::from(spot.columns)))
        .collect();
    arcs.sort_unstable();
    let first = arcs.first()?.0;
    let mut end = first;
    let (mut from, mut widest) = (first, i64::MIN);
    for (start, columns) in arcs {
        if start - end > widest && start != first {
            (from, widest) = (start, start - end);
        }
        end = end.max(start + columns);
    }
    let last_gap = first + around - end;
    Some(if last_gap >= widest { first } else { from })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spot(column: i64, columns: u32) -> Spot {
        Spot {
            column,
            row: 0,
            columns,
            rows: 1,
        }
    }

    fn unwrapped(spots: &[(i64, u32)]) -> Vec<i64> {
        let mut spots: Vec<_> = spots.iter().map(|(at, count)| spot(*at, *count)).collect();
        unwrap_turns(&mut spots, 360);
        spots.iter().map(|spot| spot.column).collect()
    }

    #[test]
    fn files_on_both_sides_of_180_degrees_become_neighbours() {
        // 179° E and 180° W, counted from the first.
        assert_eq!(unwrapped(&[(0, 2), (-359, 2)]), [0, 1]);
        assert_eq!(
            unwrapped(&[(-359, 1), (0, 1), (-350, 1)]),
            [-359, -360, -350]
        );
        assert_eq!(unwrapped(&[(10, 1), (-20, 1), (300, 1)]), [10, -20, -60]);
        // The terrain would not be narrower, so they are not moved.
        assert_eq!(unwrapped(&[(0, 1), (5, 1)]), [0, 5]);
        let all: Vec<_> = (0..360).map(|column| (column, 2)).collect();
        let stays: Vec<_> = (0..360).collect();
        assert_eq!(unwrapped(&all), stays);
    }
}
