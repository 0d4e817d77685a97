//! Datums of reference systems, and how their longitudes and latitudes become
//! those of WGS 84.
//!
//! The way is a shift of three or seven parameters, by the text's own numbers or by
//! `crs-definitions`; no grids of shifts are read. How far such a way may be off was found by
//! comparing every geographic system of `crs-definitions` with the best transformation of
//! PROJ 9 in the middle of its area, its stated accuracy added: nine of ten systems are
//! within 4 m where there is no shift, 10 m by seven and 45 m by three parameters.

use std::f64::consts::{PI, TAU};

use super::shift::Shift;
use super::wkt::Node;
use crate::globe::Globe;

/// A geodetic datum, as far as a file tells it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Datum {
    name: String,
    globe: Globe,
    /// Degrees east of Greenwich (of another body: of its own zero) at which longitudes begin.
    meridian: f64,
    shift: Option<Shift>,
}

/// Meaning of a file's longitudes and latitudes in input and output. They
/// always count from Greenwich, whatever the file's own prime meridian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LonLat<'r> {
    /// The file states degrees, and no more: they count as WGS 84's.
    Unstated,
    /// Those of WGS 84 itself.
    Wgs84,
    /// Those of WGS 84, from another datum.
    ShiftedToWgs84 {
        /// Usually not farther off than this, m.
        within_m: f64,
    },
    /// Those of a datum whose way to WGS 84 is not known here.
    OfOwnDatum {
        /// The datum's name.
        name: &'r str,
    },
    /// Those of another body than the Earth.
    OfBody {
        /// The datum's name.
        name: &'r str,
        /// Semi-major axis of the body, m.
        radius_m: f64,
    },
}

impl Datum {
    /// Of a globe, with longitudes that begin at a meridian in degrees.
    pub(super) fn new(name: String, globe: Globe, meridian: f64, shift: Option<Shift>) -> Self {
        let like_wgs84 = || globe.is_wgs84().then_some(Shift::None);
        Self {
            name,
            globe,
            meridian,
            shift: shift.or_else(like_wgs84).filter(|_| globe.is_earth()),
        }
    }

    /// Of a globe whose way to WGS 84 is not known, with longitudes from its own zero.
    pub(crate) fn unplaced(name: &str, globe: Globe) -> Self {
        Self::new(name.to_owned(), globe, 0.0, None)
    }

    /// Of a node of a geographic system, and its shift.
    pub(super) fn of(base: &Node, shift: Option<Shift>) -> Option<Self> {
        let node = base.child(&["DATUM", "ENSEMBLE", "GEODETICDATUM", "TRF"])?;
        let ellipsoid = node.child(&["ELLIPSOID", "SPHEROID"])?;
        let metres = ellipsoid.unit().unwrap_or(1.0);
        let globe = Globe::new(ellipsoid.number(1)? * metres, ellipsoid.number(2)?)?;
        let meridian = base.child(&["PRIMEM"]).and_then(|node| node.number(1));
        let name = node.name()?.to_owned();
        Some(Self::new(name, globe, meridian.unwrap_or(0.0), shift))
    }

    /// The body that it is a datum of.
    pub(crate) const fn globe(&self) -> Globe {
        self.globe
    }

    /// Returns the prime meridian, degrees east of Greenwich.
    pub(super) const fn meridian(&self) -> f64 {
        self.meridian
    }

    /// Returns the kind of longitudes and latitudes.
    pub(super) fn lonlat(&self) -> LonLat<'_> {
        let name = self.name.as_str();
        match &self.shift {
            _ if !self.globe.is_earth() => LonLat::OfBody {
                name,
                radius_m: self.globe.radius_m(),
            },
            Some(Shift::None) if is_wgs84(name) => LonLat::Wgs84,
            Some(shift) => LonLat::ShiftedToWgs84 {
                within_m: shift.within_m(),
            },
            None => LonLat::OfOwnDatum { name },
        }
    }

    /// Returns true if its own degrees are the reported ones, to 4 m.
    pub(super) fn counts_lonlat(&self) -> bool {
        let is_shifted = matches!(self.shift, Some(Shift::Parameters { .. }));
        self.meridian == 0.0 && !is_shifted
    }

    /// Reported degrees, of degrees of this datum from Greenwich. Longitudes beyond
    /// ±180° stay in their turn.
    pub(super) fn to_lonlat(&self, own: (f64, f64)) -> Option<(f64, f64)> {
        match &self.shift {
            None | Some(Shift::None) => Some(own),
            Some(shift) => Some(moved(own, shift.to_wgs84(sensible(own))?)),
        }
    }

    /// The inverse of [`Datum::to_lonlat`].
    pub(super) fn of_lonlat(&self, lonlat: (f64, f64)) -> Option<(f64, f64)> {
        match &self.shift {
            None | Some(Shift::None) => Some(lonlat),
            Some(shift) => Some(moved(lonlat, shift.of_wgs84(sensible(lonlat))?)),
        }
    }
}

fn is_wgs84(name: &str) -> bool {
    let plain: String = name.chars().filter(char::is_ascii_alphanumeric).collect();
    let plain = plain.to_ascii_lowercase();
    plain.contains("wgs1984") || plain.contains("wgs84") || plain.contains("geodeticsystem1984")
}

/// A place on the globe: fields of cells reach half a cell beyond the poles.
fn sensible((longitude, latitude): (f64, f64)) -> (f64, f64) {
    (wrapped(longitude), latitude.clamp(-90.0, 90.0))
}

/// A place moved as far as a place on the globe was.
fn moved(place: (f64, f64), to: (f64, f64)) -> (f64, f64) {
    let from = sensible(place);
    let east = wrapped(to.0 - from.0);
    (place.0 + east, place.1 + to.1 - from.1)
}

/// A longitude from −180 to 180.
fn wrapped(longitude: f64) -> f64 {
    (longitude.to_radians() + PI).rem_euclid(TAU).to_degrees() - 180.0
}
