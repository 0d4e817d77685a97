//! A horizontal reference system: its name, its code, and the longitude and latitude of its
//! coordinates.

use super::Globe;
use super::datum::{Datum, LonLat};
use super::projection::Projection;
use super::unit::Unit;
use crate::tangents::Tangents;

/// Valid lengths of a map's unit on the ground within the projection's area.
const SENSIBLE: std::ops::RangeInclusive<f64> = 1e-4..=1e4;

/// Units with a smaller relative difference are the same.
const SAME_UNIT: f64 = 1e-9;

/// Distance at which the scale at a position is computed, m: a projection's iterations stop at
/// 1e-10 rad, and its scale changes over kilometres.
const STEP_M: f64 = 100.0;

/// A horizontal reference system, as far as the file defines it.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceSystem {
    code: Option<u16>,
    name: String,
    unit: Unit,
    /// The projection's units in a unit of coordinates.
    scale: f64,
    /// `None` if it is unknown.
    projection: Option<Projection>,
    /// `None` if the file does not define it.
    datum: Option<Datum>,
}

impl ReferenceSystem {
    /// Returns a system with only a name, a unit and perhaps a datum.
    pub(crate) fn new(name: &str, unit: Unit, datum: Option<Datum>) -> Self {
        Self {
            code: None,
            name: name.to_owned(),
            unit,
            scale: 1.0,
            projection: None,
            datum,
        }
    }

    /// Sets the EPSG code.
    pub(super) const fn with_code(mut self, code: u16) -> Self {
        self.code = Some(code);
        self
    }

    /// Sets a projection in PROJ's syntax, if it is supported.
    pub(super) fn with_projection(mut self, projection: &str) -> Self {
        self.projection = Projection::new(projection, self.globe());
        self
    }

    /// Removes the projection.
    pub(super) fn without_projection(mut self) -> Self {
        self.projection = None;
        self
    }

    /// Sets the unit of the coordinates to `metres`, whatever the system's own unit.
    pub(crate) fn in_units_of(mut self, metres: f64) -> Self {
        if let Unit::Length(Some(own)) = self.unit
            && (metres / own - 1.0).abs() > SAME_UNIT
        {
            self.scale *= metres / own;
            self.unit = Unit::Length(Some(metres));
        }
        self
    }

    /// Sets the unit of the coordinates to `degrees`.
    pub(crate) const fn in_degrees_of(mut self, degrees: f64) -> Self {
        if let Unit::Angle(_) = self.unit {
            self.unit = Unit::Angle(degrees);
        }
        self
    }

    /// Returns a remark if coordinates are in another unit than the system's own.
    pub(crate) fn other_unit(&self) -> Option<String> {
        let Unit::Length(Some(metres)) = self.unit else {
            return None;
        };
        let own = metres / self.scale;
        (self.scale != 1.0).then(|| {
            format!(
                "{} counts in units of {own} m, and units of {metres} m are stated beside it: coordinates are read in the stated ones",
                self.name
            )
        })
    }

    /// Returns its datum, if known.
    pub(crate) const fn datum(&self) -> Option<&Datum> {
        self.datum.as_ref()
    }

    /// Returns its body; the Earth by default.
    pub(crate) fn globe(&self) -> Globe {
        self.datum.as_ref().map_or(Globe::EARTH, Datum::globe)
    }

    /// Returns EPSG's code, if the file states it or it follows from the name.
    #[must_use]
    pub const fn code(&self) -> Option<u16> {
        self.code
    }

    /// Returns its name, as `NAD83 / UTM zone 11N`.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns true if its coordinates can be converted to longitude and latitude.
    #[must_use]
    pub const fn has_lonlat(&self) -> bool {
        matches!(self.unit, Unit::Angle(_)) || self.projection.is_some()
    }

    /// Returns the unit of its coordinates.
    pub(crate) const fn unit(&self) -> Unit {
        self.unit
    }

    /// Returns true if both systems have the same unit.
    pub(crate) fn has_unit_of(&self, other: &Self) -> bool {
        match (self.unit, other.unit) {
            (Unit::Length(Some(own)), Unit::Length(Some(other)))
            | (Unit::Angle(own), Unit::Angle(other)) => (own / other - 1.0).abs() < SAME_UNIT,
            (own, other) => own == other,
        }
    }

    /// Returns the meaning of the longitudes and latitudes.
    #[must_use]
    pub fn lonlat(&self) -> LonLat<'_> {
        self.datum
            .as_ref()
            .map_or(LonLat::Unstated, |datum| datum.lonlat())
    }

    /// Returns true if its coordinates are the reported longitudes and latitudes, to 4 m.
    #[must_use]
    pub fn counts_lonlat(&self) -> bool {
        let datum = self.datum.as_ref();
        self.unit == Unit::Angle(1.0) && datum.is_none_or(Datum::counts_lonlat)
    }

    /// Converts a position in the system's units to longitude and latitude in degrees, see
    /// [`ReferenceSystem::lonlat`]. Longitudes count from Greenwich. `None` if the projection is
    /// unknown, or the position is outside it.
    #[must_use]
    pub fn to_lonlat(&self, place: (f64, f64)) -> Option<(f64, f64)> {
        let own = self.own_degrees(place)?;
        match &self.datum {
            Some(datum) => datum.to_lonlat(own),
            None => Some(own),
        }
    }

    /// Returns the degrees in the system's own datum, from Greenwich.
    pub(super) fn own_degrees(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        match self.unit {
            Unit::Angle(degrees) => Some((x * degrees + self.meridian(), y * degrees)),
            Unit::Length(_) => self.projected((x, y)),
        }
    }

    /// Converts longitude and latitude in degrees to the system's units: inverts
    /// [`ReferenceSystem::to_lonlat`].
    #[must_use]
    pub fn from_lonlat(&self, lonlat: (f64, f64)) -> Option<(f64, f64)> {
        let own = match &self.datum {
            Some(datum) => datum.of_lonlat(lonlat)?,
            None => lonlat,
        };
        match self.unit {
            Unit::Angle(degrees) => Some(((own.0 - self.meridian()) / degrees, own.1 / degrees)),
            Unit::Length(_) => {
                let own = (own.0 - self.meridian(), own.1);
                let (x, y) = self.projection.as_ref()?.of_degrees(own)?;
                Some((x / self.scale, y / self.scale))
            }
        }
    }

    /// Returns the degrees in the system's own datum, from Greenwich, of a position on its map.
    fn projected(&self, (x, y): (f64, f64)) -> Option<(f64, f64)> {
        let place = (x * self.scale, y * self.scale);
        let (longitude, latitude) = self.projection.as_ref()?.degrees(place)?;
        Some((longitude + self.meridian(), latitude))
    }

    /// Returns the prime meridian, degrees east of Greenwich.
    pub(crate) fn meridian(&self) -> f64 {
        self.datum.as_ref().map_or(0.0, Datum::meridian)
    }

    /// Returns the vectors on the ground of a unit of a projected system's x and y at a position in
    /// its units: a map's scale and angles vary. They are differences over [`STEP_M`] to both
    /// sides.
    pub(crate) fn tangents(&self, (x, y): (f64, f64)) -> Option<Tangents> {
        let Unit::Length(metres) = self.unit else {
            return None;
        };
        let step = STEP_M / metres.unwrap_or(1.0);
        let globe = self.globe();
        let place = |x: f64, y: f64| Some(globe.surface(self.projected((x, y))?));
        let between = |from: [f64; 3], to: [f64; 3]| {
            let lead = [0, 1, 2].map(|axis| (to[axis] - from[axis]) / (2.0 * step));
            let length = lead.iter().map(|part| part * part).sum::<f64>().sqrt();
            SENSIBLE.contains(&length).then_some(lead)
        };
        Some(Tangents {
            x: between(place(x - step, y)?, place(x + step, y)?)?,
            y: between(place(x, y - step)?, place(x, y + step)?)?,
        })
    }
}
