//! Place of decoded samples, for all formats, from the file's map from columns and rows to
//! coordinates.

use super::crs::{ReferenceSystem, Unit};
use super::decoded::Decoded;
use super::ground_map::{Bounds, GroundMap};
use super::place::Place;
use super::tangents::Tangents;
use super::{CellSize, CellUnit, Certainty, Globe, RasterError};

/// The unit of a file's coordinates, as the file states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GroundUnit {
    unit: CellUnit,
    /// Degrees in a unit, if it is an angle.
    degrees: f64,
    from: Certainty,
}

impl GroundUnit {
    /// Degrees, as stated by the file or its format.
    pub(super) const DEGREE: Self = Self::angle(1.0);

    /// Returns a stated angle in degrees.
    pub(super) const fn angle(degrees: f64) -> Self {
        Self {
            unit: CellUnit::Degree,
            degrees,
            from: Certainty::Stated,
        }
    }

    /// Returns a length in metres.
    pub(super) const fn length(metres: f64, from: Certainty) -> Self {
        Self {
            unit: CellUnit::Length { metres },
            degrees: 1.0,
            from,
        }
    }

    /// Returns the unit of a reference system.
    pub(super) fn of(system: &ReferenceSystem) -> Self {
        let from = match system.code() {
            Some(_) => Certainty::FromCode,
            None => Certainty::Stated,
        };
        match system.unit() {
            Unit::Angle(degrees) => Self::angle(degrees),
            Unit::Length(Some(metres)) => Self::length(metres, from),
            Unit::Length(None) => Self::length(1.0, Certainty::Assumed),
        }
    }
}

/// Smaller angles are rounding, degrees.
const STRAIGHT_DEGREES: f64 = 0.05;

/// Returns remarks on a rotated or sheared grid. It is rendered along its own rows; only a mirrored
/// grid is turned.
fn turned(map: &GroundMap) -> Vec<String> {
    let mut words = Vec::new();
    if map.is_straight() {
        return words;
    }
    let (rotation, leaning) = (map.rotation(), map.shear().asin().to_degrees());
    if rotation.abs() >= STRAIGHT_DEGREES {
        words.push(format!(
            "the grid is rotated by {rotation:.1}° against east: x runs along its rows, not to the east"
        ));
    }
    if leaning.abs() >= STRAIGHT_DEGREES {
        words.push(format!(
            "the grid is sheared: its columns lean by {leaning:.1}° from the perpendicular of its rows; square cells are rendered in their true shape, stored ones (--input cells=stored) as if they were rectangular"
        ));
    }
    words
}

impl Decoded {
    /// Returns the unit of the coordinates after `set_layout`; `None` if it was inferred.
    pub(super) fn ground_unit(&self) -> Option<GroundUnit> {
        let (cell, place) = (self.cell?, self.place?);
        let is_guess = cell.certainty == Certainty::Assumed && self.system.is_none();
        (!is_guess).then_some(GroundUnit {
            unit: cell.unit,
            degrees: place.degrees,
            from: cell.certainty,
        })
    }

    /// Sets orientation, cell and place. If the file states no `unit`, the unit of its reference
    /// system is used, which must be set before; without one, the unit is inferred from the
    /// numbers.
    pub(super) fn set_layout(&mut self, map: GroundMap, unit: Option<GroundUnit>) {
        self.south_up = map.is_south_up();
        self.east_first = map.is_east_first();
        let other_unit = self.system.as_ref().and_then(ReferenceSystem::other_unit);
        let new_remarks = turned(&map).into_iter().chain(other_unit);
        let new = new_remarks.filter(|line| !self.remarks.contains(line));
        self.remarks.extend(new.collect::<Vec<_>>());
        let unit = unit.or(self.system.as_ref().map(GroundUnit::of));
        let degrees = unit.map_or(1.0, |unit| unit.degrees);
        let mut cell = self.cell_of(&map, unit);
        cell.lean = map.shear();
        self.cell = Some(self.on_ground(&map, cell, degrees).unwrap_or(cell));
        self.place = Some(Place { map, degrees });
    }

    /// Adds a remark on positions of single samples, which do not define a grid.
    pub(super) fn remark_control_points(&mut self, count: usize) {
        self.remarks.push(format!(
            "it states the places of {count} samples (tie points, ground control points) and no cell size: they are not used; georeference it: gdalwarp -r bilinear IN OUT.tif"
        ));
    }

    /// Sets the side of the cells in metres to the user's value, if the file does not state it.
    ///
    /// # Errors
    /// [`RasterError::CellSizeStated`] if the file states it.
    pub(super) fn with_ground_cell(mut self, side_m: Option<f64>) -> Result<Self, RasterError> {
        let Some(side_m) = side_m else {
            return Ok(self);
        };
        if let Some(cell) = self
            .cell
            .filter(|cell| cell.certainty != Certainty::Assumed)
        {
            let (east, north) = cell.ground_metres();
            return Err(RasterError::CellSizeStated(format!(
                "{east:.3} × {north:.3} m"
            )));
        }
        let metre = CellUnit::Length { metres: 1.0 };
        let sides = match self.cell {
            // For cells that are not square, it is the shorter side.
            Some(cell) => {
                let shorter = cell.east.min(cell.north);
                (cell.east / shorter * side_m, cell.north / shorter * side_m)
            }
            None => (side_m, side_m),
        };
        self.cell = Some(CellSize {
            certainty: Certainty::Given,
            ..CellSize::stated(sides, metre, None)
        });
        // The unit of the coordinates stays unknown.
        self.place = None;
        Ok(self)
    }

    fn cell_of(&self, map: &GroundMap, unit: Option<GroundUnit>) -> CellSize {
        let (east, north) = map.steps();
        let (columns, rows) = (f64::from(self.columns), f64::from(self.rows));
        let Some(GroundUnit {
            unit,
            degrees,
            from,
        }) = unit
        else {
            let bounds = map.bounds((self.columns, self.rows));
            let corner = bounds.map(|bounds| (bounds.west, bounds.south));
            return CellSize::guessed((east, north), corner, (east * columns, north * rows));
        };
        let latitude =
            (unit == CellUnit::Degree).then(|| map.at(columns / 2.0, rows / 2.0).1 * degrees);
        CellSize {
            certainty: from,
            globe: (self.system.as_ref()).map_or(Globe::EARTH, ReferenceSystem::globe),
            ..CellSize::stated((east * degrees, north * degrees), unit, latitude)
        }
    }

    /// Returns the cell with its scale on the ground in the middle of the field, if that is known.
    fn on_ground(&self, map: &GroundMap, cell: CellSize, degrees: f64) -> Option<CellSize> {
        let middle = map.at(f64::from(self.columns) / 2.0, f64::from(self.rows) / 2.0);
        let tangents = match cell.unit {
            // Along meridians and parallels, the latitude determines the cell.
            CellUnit::Degree if map.is_straight() => return None,
            CellUnit::Degree => Tangents::of_angles(&cell.globe, cell.latitude?, degrees),
            CellUnit::Length { .. } => self.system.as_ref()?.tangents(middle)?,
        };
        let (along, up) = map.steps_east_and_north();
        tangents.cell(cell, along, up)
    }

    /// Returns the outer edges of all cells in the file's units.
    pub(super) fn bounds(&self) -> Option<Bounds> {
        self.place?.map.bounds((self.columns, self.rows))
    }

    /// Returns the outer edges of all cells in degrees of longitude and latitude. Longitudes
    /// continue beyond 180° if the field does. The edges of a projected field are curved: each is
    /// sampled in `STEPS` steps.
    pub(super) fn bounds_lonlat(&self) -> Option<Bounds> {
        const STEPS: u32 = 32;
        let (columns, rows) = (f64::from(self.columns), f64::from(self.rows));
        let along = |step: u32| f64::from(step) / f64::from(STEPS);
        let edges = (0..=STEPS).map(along).flat_map(|share| {
            let (column, row) = (share * columns, share * rows);
            [(column, 0.0), (column, rows), (0.0, row), (columns, row)]
        });
        let first = self.lonlat(0.0, 0.0)?.0;
        let places = edges.map(|(column, row)| {
            let (longitude, latitude) = self.lonlat(column, row)?;
            let around = ((longitude - first) / 360.0).round() * 360.0;
            Some((longitude - around, latitude))
        });
        let is_angle = self.cell.is_some_and(|cell| cell.unit == CellUnit::Degree);
        if is_angle {
            let corners = [(0.0, 0.0), (columns, 0.0), (0.0, rows), (columns, rows)];
            let corners = corners.map(|(column, row)| self.lonlat(column, row));
            return Bounds::around(corners.into_iter().flatten());
        }
        let bounds = Bounds::around(places.collect::<Option<Vec<_>>>()?)?;
        Some(self.with_poles(bounds))
    }

    /// Extends the bounds of a field around a pole: it covers all longitudes, and the pole is not
    /// on its edges.
    fn with_poles(&self, mut lonlat: Bounds) -> Bounds {
        let centres = self.place.and_then(|place| place.map.of_centres());
        let (Some(centres), Some(system)) = (centres, self.system.as_ref()) else {
            return lonlat;
        };
        let size = [self.columns, self.rows].map(f64::from);
        for pole in [-90.0, 90.0] {
            let Some((x, y)) = system.from_lonlat((0.0, pole)) else {
                continue;
            };
            // A rotated field does not fill its bounds. Cells extend half a sample outwards.
            let at = centres.to_samples([x, y]).map(|sample| sample + 0.5);
            let inside = (0..2).all(|axis| (0.0..=size[axis]).contains(&at[axis]));
            // Other projections map a pole to a line, or nowhere.
            if inside
                && system
                    .to_lonlat((x, y))
                    .is_some_and(|(_, y)| (y - pole).abs() < 1e-6)
            {
                (lonlat.west, lonlat.east) = (-180.0, 180.0);
                lonlat.south = lonlat.south.min(pole);
                lonlat.north = lonlat.north.max(pole);
            }
        }
        lonlat
    }

    /// Returns the longitude and latitude of a position in columns and rows, file order.
    pub(super) fn lonlat(&self, column: f64, row: f64) -> Option<(f64, f64)> {
        let place = self.place?;
        let (x, y) = place.map.at(column, row);
        match (self.cell?.unit, &self.system) {
            (_, Some(system)) => system.to_lonlat((x, y)),
            (CellUnit::Degree, None) => Some((x * place.degrees, y * place.degrees)),
            (CellUnit::Length { .. }, None) => None,
        }
    }
}
