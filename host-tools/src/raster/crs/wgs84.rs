//! From the coordinates of a reference system to longitude and latitude of WGS 84, and
//! back: what receivers and maps on the web show.
//!
//! The shift between datums is that of `proj4rs` for the system's code. Where it has none (a
//! system without a code, or a datum whose shift is a grid), the datum counts as WGS 84,
//! which is some 100 m off at most.

use std::f64::consts::{PI, TAU};

use proj4rs::Proj;
use proj4rs::transform::transform;

use super::ReferenceSystem;

/// A place that a projection gives back this much off is not one of its own, radians:
/// 60 m on the ground.
const SAME_RADIANS: f64 = 1e-5;

/// Longitude and latitude (WGS 84, degrees) of a place on the map of a projected system.
pub(in crate::raster) fn to_lonlat(system: &ReferenceSystem, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let shifted = || {
        let map = Proj::from_epsg_code(system.code()?).ok()?;
        between(&map, &globe()?, [x, y]).map(degrees)
    };
    shifted().or_else(|| system.lonlat((x, y)).map(<[f64; 2]>::from))
}

/// The place on the map of a projected system at a longitude and latitude (WGS 84, degrees).
pub(in crate::raster) fn of_lonlat(system: &ReferenceSystem, lonlat: [f64; 2]) -> Option<[f64; 2]> {
    let shifted = || {
        let map = Proj::from_epsg_code(system.code()?).ok()?;
        between(&globe()?, &map, lonlat.map(f64::to_radians))
    };
    let place = shifted().or_else(|| system.from_lonlat(lonlat.into()).map(<[f64; 2]>::from))?;
    // Far outside of what a projection is for its formulas give numbers all the same.
    let back = to_lonlat(system, place)?;
    let off = [0, 1].map(|axis| {
        let off = (back[axis] - lonlat[axis]).to_radians();
        (off + PI).rem_euclid(TAU) - PI
    });
    let is_there = off.iter().all(|angle| angle.abs() < SAME_RADIANS);
    is_there.then_some(place)
}

/// Longitude and latitude (WGS 84, degrees) of those of a geographic system.
pub(in crate::raster) fn of_own_degrees(
    system: &ReferenceSystem,
    own: [f64; 2],
) -> Option<[f64; 2]> {
    let own = own.map(f64::to_radians);
    between(&geographic(system)?, &globe()?, own).map(degrees)
}

/// Longitude and latitude (degrees) in a geographic system of those of WGS 84.
pub(in crate::raster) fn to_own_degrees(
    system: &ReferenceSystem,
    lonlat: [f64; 2],
) -> Option<[f64; 2]> {
    let lonlat = lonlat.map(f64::to_radians);
    between(&globe()?, &geographic(system)?, lonlat).map(degrees)
}

fn geographic(system: &ReferenceSystem) -> Option<Proj> {
    let system = Proj::from_epsg_code(system.code()?).ok()?;
    system.is_latlong().then_some(system)
}

fn globe() -> Option<Proj> {
    Proj::from_proj_string("+proj=longlat +datum=WGS84 +no_defs").ok()
}

fn degrees(radians: [f64; 2]) -> [f64; 2] {
    radians.map(f64::to_degrees)
}

/// A place of one system in another; angles in radians.
fn between(from: &Proj, to: &Proj, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let mut place = (x, y, 0.0);
    transform(from, to, &mut place).ok()?;
    let found = [place.0, place.1];
    let finite = found.iter().all(|number| number.is_finite());
    finite.then_some(found)
}
