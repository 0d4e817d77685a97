//! Reference systems without a code, defined by a GeoTIFF's keys: read by libgdal, if it is
//! installed; otherwise only name, unit and ellipsoid are read.

use geotiff_core::geokeys::{GEODETIC_CRS_TYPE, GEOG_CITATION};

use super::geo_keys::GeoKeys;
use crate::Globe;
use crate::crs::{Datum, ReferenceSystem, Unit};
use crate::formats::gdal;
use crate::input::FileBytes;

const SEMI_MAJOR_AXIS: u16 = 2057;
const SEMI_MINOR_AXIS: u16 = 2058;
const INVERSE_FLATTENING: u16 = 2059;

/// Returns the system that a file's keys define under a name.
pub(super) fn system(
    keys: &GeoKeys,
    is_projected: bool,
    name: Option<&str>,
    by_gdal: Option<&FileBytes>,
) -> ReferenceSystem {
    if let Some(system) = by_gdal.and_then(gdal::system_of) {
        return system;
    }
    let (unit, otherwise) = match is_projected {
        true => (
            Unit::Length(keys.stated_metres()),
            "a projection without a name",
        ),
        false => (
            Unit::Angle(keys.degrees()),
            "longitude and latitude of a datum without a code",
        ),
    };
    let named = part_of_citation(keys, "GCS Name").filter(|_| !is_projected);
    ReferenceSystem::new(named.or(name).unwrap_or(otherwise), unit, datum(keys))
}

/// Returns the datum of the keys' geographic system, by its code or by the keys' own ellipsoid.
fn datum(keys: &GeoKeys) -> Option<Datum> {
    let base = keys.epsg_code(GEODETIC_CRS_TYPE);
    if let Some(system) = base.and_then(ReferenceSystem::from_code) {
        return system.datum().cloned();
    }
    let major = keys.number(SEMI_MAJOR_AXIS)?;
    let by_flattening = || Globe::new(major, keys.number(INVERSE_FLATTENING)?);
    let by_axes = || Globe::from_axes(major, keys.number(SEMI_MINOR_AXIS)?);
    let globe = by_flattening().or_else(by_axes)?;
    let name = part_of_citation(keys, "Datum").or_else(|| keys.text(GEOG_CITATION));
    Some(Datum::unplaced(name.unwrap_or("without a name"), globe))
}

/// Returns a named part of a citation in GDAL's format, `GCS Name = Moon 2000|Datum =
/// D_Moon_2000|…`.
fn part_of_citation<'k>(keys: &'k GeoKeys, name: &str) -> Option<&'k str> {
    let parts = keys.whole_text(GEOG_CITATION)?.split('|');
    let mut found = parts.filter_map(|part| part.split_once(" = "));
    found
        .find(|(key, _)| *key == name)
        .map(|(_, value)| value.trim())
}
