//! Datums of reference systems, and the conversion of their longitudes and latitudes to WGS 84.
//!
//! The conversion is a shift of three or seven parameters, from the text or from `crs-definitions`;
//! shift grids are not used. Its error was found by comparing every geographic system of
//! `crs-definitions` with PROJ 9's best transformation in the middle of its area, plus that one's
//! stated accuracy: nine of ten systems are within 4 m without a shift, 10 m with seven and 45 m
//! with three parameters.

use std::f64::consts::{PI, TAU};

use super::shift::Shift;
use super::wkt::Node;
use crate::globe::Globe;

/// A geodetic datum, as far as the file defines it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Datum {
    name: String,
    globe: Globe,
    /// Prime meridian, degrees east of Greenwich, or of the zero of another body.
    meridian: f64,
    shift: Option<Shift>,
}

/// Meaning of a file's longitudes and latitudes in input and output. They count from Greenwich,
/// whatever the file's own prime meridian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LonLat<'r> {
    /// The file states only degrees: they are treated as WGS 84.
    Unstated,
    /// WGS 84 itself.
    Wgs84,
    /// WGS 84, shifted from another datum.
    ShiftedToWgs84 {
        /// Usual max error, m.
        within_m: f64,
    },
    /// A datum whose shift to WGS 84 is unknown.
    OfOwnDatum {
        /// The datum's name.
        name: &'r str,
    },
    /// A body other than the Earth.
    OfBody {
        /// The datum's name.
        name: &'r str,
        /// Semi-major axis of the body, m.
        radius_m: f64,
    },
}

impl Datum {
    /// Returns the datum of a globe, with a prime meridian in degrees.
    pub(super) fn new(name: String, globe: Globe, meridian: f64, shift: Option<Shift>) -> Self {
        let like_wgs84 = || globe.is_wgs84().then_some(Shift::None);
        Self {
            name,
            globe,
            meridian,
            shift: shift.or_else(like_wgs84).filter(|_| globe.is_earth()),
        }
    }

    /// Returns the datum of a globe without a known shift to WGS 84, with longitudes from its own
    /// zero.
    pub(crate) fn unplaced(name: &str, globe: Globe) -> Self {
        Self::new(name.to_owned(), globe, 0.0, None)
    }

    /// Reads the datum of a geographic system's node, with its shift.
    pub(super) fn of(base: &Node, shift: Option<Shift>) -> Option<Self> {
        let node = base.child(&["DATUM", "ENSEMBLE", "GEODETICDATUM", "TRF"])?;
        let ellipsoid = node.child(&["ELLIPSOID", "SPHEROID"])?;
        let metres = ellipsoid.unit().unwrap_or(1.0);
        let globe = Globe::new(ellipsoid.number(1)? * metres, ellipsoid.number(2)?)?;
        let meridian = base.child(&["PRIMEM"]).and_then(|node| node.number(1));
        let name = node.name()?.to_owned();
        Some(Self::new(name, globe, meridian.unwrap_or(0.0), shift))
    }

    /// Returns the body of the datum.
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

    /// Returns true if its degrees equal the reported ones, to 4 m.
    pub(super) fn counts_lonlat(&self) -> bool {
        let is_shifted = matches!(self.shift, Some(Shift::Parameters { .. }));
        self.meridian == 0.0 && !is_shifted
    }

    /// Returns the reported degrees for this datum's degrees from Greenwich. Longitudes beyond
    /// ±180° stay beyond.
    pub(super) fn to_lonlat(&self, own: (f64, f64)) -> Option<(f64, f64)> {
        match &self.shift {
            None | Some(Shift::None) => Some(own),
            Some(shift) => Some(moved(own, shift.to_wgs84(clamped(own))?)),
        }
    }

    /// Inverts [`Datum::to_lonlat`].
    pub(super) fn of_lonlat(&self, lonlat: (f64, f64)) -> Option<(f64, f64)> {
        match &self.shift {
            None | Some(Shift::None) => Some(lonlat),
            Some(shift) => Some(moved(lonlat, shift.of_wgs84(clamped(lonlat))?)),
        }
    }
}

fn is_wgs84(name: &str) -> bool {
    let plain: String = name.chars().filter(char::is_ascii_alphanumeric).collect();
    let plain = plain.to_ascii_lowercase();
    plain.contains("wgs1984") || plain.contains("wgs84") || plain.contains("geodeticsystem1984")
}

/// Limits degrees to the globe: fields of cells extend half a cell beyond the poles.
fn clamped((longitude, latitude): (f64, f64)) -> (f64, f64) {
    (wrapped(longitude), latitude.clamp(-90.0, 90.0))
}

/// Applies the shift of the limited degrees to the original ones.
fn moved(place: (f64, f64), to: (f64, f64)) -> (f64, f64) {
    let from = clamped(place);
    let east = wrapped(to.0 - from.0);
    (place.0 + east, place.1 + to.1 - from.1)
}

/// Wraps a longitude to −180° to 180°.
fn wrapped(longitude: f64) -> f64 {
    (longitude.to_radians() + PI).rem_euclid(TAU).to_degrees() - 180.0
}
