//! Projections without a code: the parameters that a GeoTIFF's keys spell out.

use super::georef::GeoKeys;
use crate::raster::crs::{ReferenceSystem, Unit};

const COORDINATE_TRANSFORMATION: u16 = 3075;
const SEMI_MAJOR_AXIS: u16 = 2057;
const INVERSE_FLATTENING: u16 = 2059;
const STANDARD_PARALLELS: [u16; 2] = [3078, 3079];
/// Longitude and latitude of the natural origin, of a false origin, of the centre; each
/// file has one pair of them.
const LONGITUDES: [u16; 4] = [3080, 3084, 3088, 3095];
const LATITUDES: [u16; 3] = [3081, 3085, 3089];
const EASTINGS: [u16; 3] = [3082, 3086, 3090];
const NORTHINGS: [u16; 3] = [3083, 3087, 3091];
const SCALES: [u16; 2] = [3092, 3093];

/// The reference system that the keys describe under a name.
pub(super) fn system(keys: &GeoKeys, name: &str, base: Option<u16>) -> ReferenceSystem {
    let named = ReferenceSystem::named(name, Unit::Length(keys.stated_metres()));
    match projection(keys, base) {
        Some(projection) => named.with_projection(projection),
        None => named,
    }
}

/// The projection as PROJ writes it, for the transformations that maps of terrain use.
fn projection(keys: &GeoKeys, base: Option<u16>) -> Option<String> {
    let first = |of: &[u16]| of.iter().find_map(|key| keys.number(*key));
    let angle = |of: &[u16]| first(of).unwrap_or(0.0) * keys.degrees();
    let (longitude, latitude) = (angle(&LONGITUDES), angle(&LATITUDES));
    let parallels = STANDARD_PARALLELS.map(|key| angle(&[key]));
    let scale = first(&SCALES).unwrap_or(1.0);
    let parallels = || format!("+lat_1={} +lat_2={}", parallels[0], parallels[1]);
    let at = format!("+lat_0={latitude} +lon_0={longitude}");
    let kind = match keys.code(COORDINATE_TRANSFORMATION)? {
        1 => format!("+proj=tmerc {at} +k={scale}"),
        7 => format!("+proj=merc +lon_0={longitude} +k={scale}"),
        8 => format!("+proj=lcc {at} {}", parallels()),
        9 => format!("+proj=lcc {at} +lat_1={latitude} +k={scale}"),
        10 => format!("+proj=laea {at}"),
        11 => format!("+proj=aea {at} {}", parallels()),
        15 => format!(
            "+proj=stere +lat_0={} +lat_ts={latitude} +lon_0={longitude}",
            90.0_f64.copysign(latitude)
        ),
        _ => return None,
    };
    let metres = keys.stated_metres().unwrap_or(1.0);
    let shift = |of: &[u16]| first(of).unwrap_or(0.0) * metres;
    let ellipsoid = ellipsoid(keys, base)?;
    Some(format!(
        "{kind} +x_0={} +y_0={} +to_meter={metres} {ellipsoid}",
        shift(&EASTINGS),
        shift(&NORTHINGS)
    ))
}

/// By its own numbers, or that of the geographic system with a code.
fn ellipsoid(keys: &GeoKeys, base: Option<u16>) -> Option<String> {
    let own = keys
        .number(SEMI_MAJOR_AXIS)
        .zip(keys.number(INVERSE_FLATTENING));
    match own {
        Some((a, rf)) => Some(format!("+a={a} +rf={rf}")),
        None => ReferenceSystem::from_code(base?)?.ellipsoid(),
    }
}
