//! Reference systems without a code: the datum and the projection that a GeoTIFF's keys
//! spell out.

use geotiff_core::geokeys::GEOG_CITATION;

use super::georef::GeoKeys;
use crate::Globe;
use crate::crs::{Datum, ReferenceSystem, Shift, Unit};

const GEODETIC_DATUM: u16 = 2050;
const SEMI_MAJOR_AXIS: u16 = 2057;
const SEMI_MINOR_AXIS: u16 = 2058;
const INVERSE_FLATTENING: u16 = 2059;
const PRIME_MERIDIAN: u16 = 2051;
const PRIME_MERIDIAN_LONGITUDE: u16 = 2061;
const TO_WGS84: u16 = 2062;
const PROJECTION: u16 = 3074;
const COORDINATE_TRANSFORMATION: u16 = 3075;
const STANDARD_PARALLELS: [u16; 2] = [3078, 3079];
/// Longitude and latitude of the natural origin, of a false origin, of the centre; each
/// file has one pair of them.
const LONGITUDES: [u16; 4] = [3080, 3084, 3088, 3095];
const LATITUDES: [u16; 3] = [3081, 3085, 3089];
const EASTINGS: [u16; 3] = [3082, 3086, 3090];
const NORTHINGS: [u16; 3] = [3083, 3087, 3091];
const SCALES: [u16; 2] = [3092, 3093];
/// Of an oblique cylinder: where its line of true scale points at the centre, and by how much
/// the map is turned.
const AZIMUTH: u16 = 3094;
const TURN: u16 = 3096;

/// EPSG's codes of prime meridians, and their degrees east of Greenwich.
const MERIDIANS: [(u16, f64); 13] = [
    (8902, -9.131_906_111_111_1),
    (8903, 2.337_229_166_666_7),
    (8904, -74.080_916_666_666_7),
    (8905, -3.687_938_888_888_9),
    (8906, 12.452_333_333_333_3),
    (8907, 7.439_583_333_333_3),
    (8908, 106.807_719_444_444_4),
    (8909, -17.666_666_666_666_7),
    (8910, 4.367_975),
    (8911, 18.058_277_777_777_8),
    (8912, 23.716_337_5),
    (8913, 10.722_916_666_666_7),
    (8914, 2.337_208_333_333_3),
];

/// The projected system that the keys describe under a name.
pub(super) fn projected(keys: &GeoKeys, name: Option<&str>, base: Option<u16>) -> ReferenceSystem {
    let datum = datum(keys, base);
    let method = keys.code(COORDINATE_TRANSFORMATION);
    let unnamed = || match method {
        Some(25) => "Van der Grinten's projection, without a name".to_owned(),
        Some(26) => "a projection as that of the New Zealand Map Grid, without a name".to_owned(),
        Some(method) => format!("a projection by method {method} of GeoTIFF, without a name"),
        None => "a projection without a name".to_owned(),
    };
    let kind = method.and_then(|method| kind(keys, method));
    let words = kind.map(|kind| projection(keys, &kind));
    let words = words.or_else(|| utm(keys));
    // GDAL calls what has no name "unknown", which tells nobody why it cannot be placed.
    let tells = |name: &&str| words.is_some() || !name.eq_ignore_ascii_case("unknown");
    let name = name.filter(tells).map_or_else(unnamed, str::to_owned);
    let named = ReferenceSystem::named(&name, Unit::Length(keys.stated_metres()), datum);
    match words.filter(|_| named.datum().is_some()) {
        Some(words) => {
            let meridian = named.meridian();
            named.with_projection(&format!("{words} +pm={meridian}"))
        }
        None => named,
    }
}

/// The geographic system that the keys describe under a name.
pub(super) fn geographic(keys: &GeoKeys, name: Option<&str>) -> ReferenceSystem {
    let name = part_of_citation(keys, "GCS Name").or(name);
    let name = name.unwrap_or("longitude and latitude of a datum without a code");
    ReferenceSystem::named(name, Unit::Angle(keys.degrees()), datum(keys, None))
}

/// The datum, by its own numbers, or that of the geographic system with a code.
fn datum(keys: &GeoKeys, base: Option<u16>) -> Option<Datum> {
    let of_code = |code| ReferenceSystem::from_code(code)?.datum().cloned();
    // A datum's code is that of the geographic system with it, and 2000.
    let of_datum = |code: u16| of_code(code.checked_sub(2000)?);
    let known = keys.code(GEODETIC_DATUM).filter(|code| *code != 32767);
    let of_keys = || {
        let datum = known.and_then(of_datum).or_else(|| own_datum(keys))?;
        Some(datum.with_meridian(meridian(keys).unwrap_or(0.0)))
    };
    base.and_then(of_code).or_else(of_keys)
}

/// Where the keys say that longitudes begin, degrees east of Greenwich.
fn meridian(keys: &GeoKeys) -> Option<f64> {
    // GDAL writes that of Paris in degrees, whatever the unit.
    let is_paris = |longitude: f64| (longitude - 2.337_229_17).abs() < 1e-7;
    let stated = keys.number(PRIME_MERIDIAN_LONGITUDE);
    let stated = stated.map(|longitude| match is_paris(longitude) {
        true => longitude,
        false => longitude * keys.degrees(),
    });
    let by_code = || {
        let code = keys.code(PRIME_MERIDIAN)?;
        let found = MERIDIANS.iter().find(|(known, _)| *known == code);
        found.map(|(_, degrees)| *degrees)
    };
    stated.or_else(by_code)
}

fn own_datum(keys: &GeoKeys) -> Option<Datum> {
    let major = keys.number(SEMI_MAJOR_AXIS)?;
    let by_flattening = || Globe::new(major, keys.number(INVERSE_FLATTENING)?);
    let by_axes = || Globe::from_axes(major, keys.number(SEMI_MINOR_AXIS)?);
    let globe = by_flattening().or_else(by_axes)?;
    let name = part_of_citation(keys, "Datum").or_else(|| keys.text(GEOG_CITATION));
    let name = name.unwrap_or("without a name");
    let shift = keys.numbers(TO_WGS84);
    let shift = Shift::by_numbers(&globe, shift).or_else(|| Shift::of(name, None));
    Some(Datum::new(name.to_owned(), globe, 0.0, shift))
}

/// Of `GCS Name = Moon 2000|Datum = D_Moon_2000|…`, as GDAL writes it, the part with a
/// name.
fn part_of_citation<'k>(keys: &'k GeoKeys, name: &str) -> Option<&'k str> {
    let parts = keys.whole_text(GEOG_CITATION)?.split('|');
    let mut found = parts.filter_map(|part| part.split_once(" = "));
    found
        .find(|(key, _)| *key == name)
        .map(|(_, value)| value.trim())
}

/// A zone of UTM on a datum or in a unit of its own, by EPSG's code of the projection alone.
fn utm(keys: &GeoKeys) -> Option<String> {
    let (zone, south) = match keys.code(PROJECTION)? {
        north @ 16001..=16060 => (north - 16000, ""),
        south @ 16101..=16160 => (south - 16100, " +south"),
        _ => return None,
    };
    let metres = keys.stated_metres().unwrap_or(1.0);
    Some(format!("+proj=utm +zone={zone}{south} +to_meter={metres}"))
}

/// The transformation as PROJ writes it, for those that maps of terrain use.
fn kind(keys: &GeoKeys, method: u16) -> Option<String> {
    let first = |of: &[u16]| of.iter().find_map(|key| keys.number(*key));
    let angle = |of: &[u16]| first(of).map(|angle| angle * keys.degrees());
    let longitude = angle(&LONGITUDES).unwrap_or(0.0);
    let latitude = angle(&LATITUDES).unwrap_or(0.0);
    let scale = first(&SCALES).unwrap_or(1.0);
    let parallel = |index: usize| angle(&STANDARD_PARALLELS[index..=index]);
    let [one, two] = [0, 1].map(|index| parallel(index).unwrap_or(0.0));
    let at = format!("+lat_0={latitude} +lon_0={longitude}");
    Some(match method {
        1 => format!("+proj=tmerc {at} +k={scale}"),
        // Easting and northing count from where the line crosses the equator of the cylinder, or
        // from the centre.
        3 => format!("{} +no_uoff", oblique(keys, longitude, latitude, scale)?),
        9815 => oblique(keys, longitude, latitude, scale)?,
        7 => match parallel(0) {
            Some(parallel) => format!("+proj=merc +lon_0={longitude} +lat_ts={parallel}"),
            None => format!("+proj=merc +lon_0={longitude} +k={scale}"),
        },
        8 => format!("+proj=lcc {at} +lat_1={one} +lat_2={two}"),
        9 => format!("+proj=lcc {at} +lat_1={latitude} +k={scale}"),
        10 => format!("+proj=laea {at}"),
        11 => format!("+proj=aea {at} +lat_1={one} +lat_2={two}"),
        12 => format!("+proj=aeqd {at}"),
        13 => format!("+proj=eqdc {at} +lat_1={one} +lat_2={two}"),
        14 => format!("+proj=stere {at} +k={scale}"),
        15 => polar_stereographic(longitude, latitude, scale),
        16 => format!("+proj=sterea {at} +k={scale}"),
        17 => format!("+proj=eqc {at} +lat_ts={one}"),
        18 => format!("+proj=cass {at}"),
        19 => format!("+proj=gnom {at}"),
        20 => format!("+proj=mill +lon_0={longitude}"),
        21 => format!("+proj=ortho {at}"),
        22 => format!("+proj=poly {at}"),
        23 => format!("+proj=robin +lon_0={longitude}"),
        24 => format!("+proj=sinu +lon_0={longitude}"),
        28 => format!("+proj=cea +lon_0={longitude} +lat_ts={one}"),
        _ => return None,
    })
}

/// Oblique Mercator by a centre and an azimuth (Hotine).
fn oblique(keys: &GeoKeys, longitude: f64, latitude: f64, scale: f64) -> Option<String> {
    let angle = |key| keys.number(key).map(|angle| angle * keys.degrees());
    let azimuth = angle(AZIMUTH)?;
    let turn = angle(TURN).unwrap_or(azimuth);
    Some(format!(
        "+proj=omerc +lat_0={latitude} +lonc={longitude} +alpha={azimuth} +gamma={turn} +k={scale}"
    ))
}

/// A transformation with its origin and its unit, as PROJ writes it.
fn projection(keys: &GeoKeys, kind: &str) -> String {
    let metres = keys.stated_metres().unwrap_or(1.0);
    let shift = |of: &[u16]| {
        let shift = of.iter().find_map(|key| keys.number(*key));
        shift.unwrap_or(0.0) * metres
    };
    format!(
        "{kind} +x_0={} +y_0={} +to_meter={metres}",
        shift(&EASTINGS),
        shift(&NORTHINGS)
    )
}

/// The latitude is that of the true scale, or the pole with a scale at it.
fn polar_stereographic(longitude: f64, latitude: f64, scale: f64) -> String {
    let pole = 90.0_f64.copysign(latitude);
    match latitude == pole {
        true => format!("+proj=stere +lat_0={pole} +lon_0={longitude} +k={scale}"),
        false => format!("+proj=stere +lat_0={pole} +lat_ts={latitude} +lon_0={longitude}"),
    }
}
