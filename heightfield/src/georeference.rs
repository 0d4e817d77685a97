//! Georeference of samples in the file's reference system, and the meaning of its coordinates.
//!
//! Coordinates are always (x, y), which is (east, north) or (longitude, latitude), whatever the
//! order in the reference system's own definition.

use super::crs::{LonLat, ReferenceSystem};
use super::geometry::{CellSize, CellUnit, Certainty};
use super::tangents::Tangents;

/// Valid longitudes and latitudes, degrees.
const LONGITUDES: std::ops::RangeInclusive<f64> = -360.0..=360.0;
const LATITUDES: std::ops::RangeInclusive<f64> = -90.0..=90.0;

/// The affine map from a sample's column and row to its coordinates:
/// `origin + column · column_step + row · row_step`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundTransform {
    origin: [f64; 2],
    column_step: [f64; 2],
    row_step: [f64; 2],
}

impl GroundTransform {
    /// Identity: x is the column, y is the row.
    const CELLS: Self = Self {
        origin: [0.0; 2],
        column_step: [1.0, 0.0],
        row_step: [0.0, 1.0],
    };

    /// Returns the map from the coordinates of the sample at column 0 and row 0, and the steps to
    /// the next column and row; `None` if a number is not finite or all samples lie on a line.
    #[must_use]
    pub fn new(origin: [f64; 2], column_step: [f64; 2], row_step: [f64; 2]) -> Option<Self> {
        let map = Self {
            origin,
            column_step,
            row_step,
        };
        let numbers = [origin, column_step, row_step];
        let finite = numbers.iter().flatten().all(|number| number.is_finite());
        let area = map.determinant().abs() / (length(column_step) * length(row_step));
        (finite && area > 1e-6).then_some(map)
    }

    /// Returns the coordinates of a position in samples, which may be fractional.
    #[must_use]
    pub fn to_ground(&self, [column, row]: [f64; 2]) -> [f64; 2] {
        let along = |axis: usize| {
            self.origin[axis] + column * self.column_step[axis] + row * self.row_step[axis]
        };
        [along(0), along(1)]
    }

    /// Returns the column and row of coordinates, which may lie outside the field.
    #[must_use]
    pub fn to_samples(&self, ground: [f64; 2]) -> [f64; 2] {
        let [x, y] = [ground[0] - self.origin[0], ground[1] - self.origin[1]];
        let ([a, b], [c, d]) = (self.column_step, self.row_step);
        let area = self.determinant();
        [(x * d - y * c) / area, (y * a - x * b) / area]
    }

    /// Returns the step to the next column, in coordinates.
    #[must_use]
    pub const fn column_step(&self) -> [f64; 2] {
        self.column_step
    }

    /// Returns the step to the next row, in coordinates.
    #[must_use]
    pub const fn row_step(&self) -> [f64; 2] {
        self.row_step
    }

    /// Returns the same samples with columns counted from the other side.
    pub(super) fn with_columns_from(self, last: f64) -> Self {
        Self {
            origin: self.to_ground([last, 0.0]),
            column_step: self.column_step.map(|step| -step),
            ..self
        }
    }

    /// Returns the same samples with rows counted from the other side.
    pub(super) fn with_rows_from(self, last: f64) -> Self {
        Self {
            origin: self.to_ground([0.0, last]),
            row_step: self.row_step.map(|step| -step),
            ..self
        }
    }

    /// Returns true if columns are along x and rows along y.
    fn is_straight(&self) -> bool {
        self.column_step[1] == 0.0 && self.row_step[0] == 0.0
    }

    fn determinant(&self) -> f64 {
        self.column_step[0] * self.row_step[1] - self.column_step[1] * self.row_step[0]
    }
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

/// Kind of a file's coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum System {
    /// The file states no place: coordinates are sample columns and rows, counted from the
    /// south-west sample.
    Cells,
    /// Lengths or angles of a reference system that is not stated or whose projection is not
    /// supported.
    Unstated,
    /// Longitude and latitude.
    Geographic {
        /// Degrees in a unit of the coordinates.
        degrees: f64,
    },
    /// East and north on a map.
    Projected,
}

/// Georeference of a raster's samples: column 0 the westernmost, row 0 the southernmost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Georeference<'r> {
    transform: GroundTransform,
    system: System,
    /// The reference system, if the file states it.
    reference: Option<&'r ReferenceSystem>,
    cell: Option<CellSize>,
    /// Columns and rows less one.
    last: [f64; 2],
}

/// A rectangle in coordinates: west, south, east, north.
pub type Sides = [f64; 4];

impl<'r> Georeference<'r> {
    pub(super) fn new(
        transform: Option<GroundTransform>,
        reference: Option<&'r ReferenceSystem>,
        cell: Option<CellSize>,
        last: [f64; 2],
    ) -> Self {
        let system = transform.map_or(System::Cells, |map| system(&map, reference, cell));
        Self {
            transform: transform.unwrap_or(GroundTransform::CELLS),
            system,
            reference,
            cell,
            last,
        }
    }

    /// Returns the kind of the coordinates.
    #[must_use]
    pub const fn system(&self) -> System {
        self.system
    }

    /// Returns the reference system, if the file states it.
    #[must_use]
    pub const fn reference(&self) -> Option<&'r ReferenceSystem> {
        self.reference
    }

    /// Returns the map from the raster's columns and rows to coordinates.
    #[must_use]
    pub const fn transform(&self) -> &GroundTransform {
        &self.transform
    }

    /// Returns the smallest rectangle of coordinates around all samples, without the outer half of
    /// their cells.
    #[must_use]
    pub fn bounds(&self) -> Sides {
        let [columns, rows] = self.last;
        around(
            [[0.0, 0.0], [columns, 0.0], [0.0, rows], [columns, rows]]
                .map(|sample| self.transform.to_ground(sample)),
        )
    }

    /// Returns the meaning of this file's longitudes and latitudes.
    #[must_use]
    pub fn lonlat(&self) -> LonLat<'r> {
        self.reference
            .map_or(LonLat::Unstated, ReferenceSystem::lonlat)
    }

    /// Returns true if the coordinates themselves are the longitudes and latitudes of
    /// [`Georeference::lonlat`], to 4 m.
    #[must_use]
    pub fn counts_lonlat(&self) -> bool {
        let System::Geographic { degrees } = self.system else {
            return false;
        };
        degrees == 1.0 && self.reference.is_none_or(ReferenceSystem::counts_lonlat)
    }

    /// Returns the longitude and latitude (degrees, see [`Georeference::lonlat`]) of coordinates;
    /// `None` if the reference system is unknown or its projection has no such position.
    #[must_use]
    pub fn to_lonlat(&self, ground: [f64; 2]) -> Option<[f64; 2]> {
        let (longitude, latitude) = match (self.system, self.reference) {
            (System::Cells | System::Unstated, _) => None,
            (_, Some(reference)) => reference.to_lonlat(ground.into()),
            (System::Geographic { degrees }, None) => {
                Some((ground[0] * degrees, ground[1] * degrees))
            }
            (System::Projected, None) => None,
        }?;
        // Files count longitudes from −180° or from 0°: this is the range that users expect.
        Some([wrapped(longitude), latitude])
    }

    /// Returns the coordinates of a longitude and latitude (degrees, see [`Georeference::lonlat`]).
    /// The longitude is shifted by full turns into the field, or nearest to it. `None` if the
    /// reference system is unknown, or its projection has no such position.
    #[must_use]
    pub fn of_lonlat(&self, [longitude, latitude]: [f64; 2]) -> Option<[f64; 2]> {
        if !(LONGITUDES.contains(&longitude) && LATITUDES.contains(&latitude)) {
            return None;
        }
        let lonlat = (wrapped(longitude), latitude);
        let place = match (self.system, self.reference) {
            (System::Cells | System::Unstated, _) => None,
            (_, Some(reference)) => reference.from_lonlat(lonlat),
            (System::Geographic { degrees }, None) => {
                Some((lonlat.0 / degrees, lonlat.1 / degrees))
            }
            (System::Projected, None) => None,
        };
        place.map(|(x, y)| self.nearest_turn([x, y]))
    }

    /// Returns the coordinates with the longitude shifted by full turns to be nearest to the middle
    /// of the field; coordinates that are not angles are unchanged.
    #[must_use]
    pub fn nearest_turn(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let System::Geographic { degrees } = self.system else {
            return [x, y];
        };
        let [west, _, east, _] = self.bounds();
        let (turn, middle) = (360.0 / degrees, 0.5 * (west + east));
        [x + ((middle - x) / turn).round() * turn, y]
    }

    /// Returns the size of a cell at a position. For angles and projected maps, size and lean
    /// depend on the position.
    #[must_use]
    pub fn cell_at(&self, ground: [f64; 2]) -> Option<CellSize> {
        let mut cell = self.cell?;
        let tangents = match self.system {
            System::Cells | System::Unstated => None,
            System::Geographic { degrees } => {
                let latitude = (ground[1] * degrees).clamp(-90.0, 90.0);
                cell.latitude = Some(latitude);
                let turned = || Tangents::of_angles(&cell.globe, latitude, degrees);
                (!self.transform.is_straight()).then(turned)
            }
            System::Projected => (self.reference).and_then(|map| map.tangents(ground.into())),
        };
        let (along, up) = (self.transform.column_step, self.transform.row_step);
        let there = tangents.and_then(|tangents| tangents.cell(cell, along, up));
        Some(there.unwrap_or(cell))
    }
}

/// Returns the smallest rectangle around positions.
pub fn around(places: impl IntoIterator<Item = [f64; 2]>) -> Sides {
    let empty = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
    places
        .into_iter()
        .fold(empty, |[west, south, east, north], [x, y]| {
            [west.min(x), south.min(y), east.max(x), north.max(y)]
        })
}

fn system(
    map: &GroundTransform,
    reference: Option<&ReferenceSystem>,
    cell: Option<CellSize>,
) -> System {
    let degree = cell.filter(|cell| cell.unit == CellUnit::Degree);
    match (degree, reference) {
        // Degrees that are only assumed are no reliable longitudes.
        (Some(cell), None) if cell.certainty == Certainty::Assumed => System::Unstated,
        (Some(cell), _) => System::Geographic {
            degrees: whole(cell.east / length(map.column_step)),
        },
        (None, Some(reference)) if reference.has_lonlat() => System::Projected,
        (None, _) => System::Unstated,
    }
}

/// Rounds the ratio to 1, or to the degrees in a grad, if only rounding separates them.
fn whole(ratio: f64) -> f64 {
    let whole = |part: f64| (ratio / part - 1.0).abs() < 1e-9;
    [1.0, 0.9]
        .into_iter()
        .find(|part| whole(*part))
        .unwrap_or(ratio)
}

/// Wraps a longitude to −180° to 180°.
fn wrapped(longitude: f64) -> f64 {
    longitude - 360.0 * (longitude / 360.0).round()
}

#[cfg(test)]
#[path = "georeference_tests.rs"]
mod tests;
