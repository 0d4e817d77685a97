//! Georeference of the image: reference system, map to the ground, units.

use geotiff_core::geokeys::{
    GEODETIC_CRS_TYPE, GEOG_CITATION, GT_CITATION, PROJ_CITATION, PROJECTED_CRS_TYPE,
    VERTICAL_CS_TYPE, VERTICAL_UNITS,
};
use tiff_reader::Ifd;

use super::geo_keys::{GeoKeys, metres_of_code, numbers};
use super::user_defined;
use crate::crs::{self, ReferenceSystem};
use crate::decoded::Decoded;
use crate::file_layout::RasterType;
use crate::ground_map::GroundMap;
use crate::input::FileBytes;

const MODEL_PIXEL_SCALE: u16 = 33550;
const MODEL_TIEPOINT: u16 = 33922;
/// Numbers of a tie point: column, row and level of a sample, and three coordinates.
const NUMBERS_OF_A_TIE: usize = 6;
const MODEL_TRANSFORMATION: u16 = 34264;

/// Sets reference system, place, cell size, units and orientation, as far as the file states them.
/// `stated` is the number of metres in a vertical unit by the file's GDAL tags. libgdal may read
/// systems that are defined by keys from `file`.
pub(super) fn apply(
    image: &Ifd,
    decoded: &mut Decoded,
    stated: Option<f64>,
    by_gdal: Option<&FileBytes>,
) {
    let keys = GeoKeys::read(image);
    let of_code = |key| keys.code(key);
    let both = [PROJECTED_CRS_TYPE, GEODETIC_CRS_TYPE];
    let beside = || {
        let mut found = (both.iter()).filter_map(|key| crs::vertical_of_compound(of_code(*key)?));
        found.next()
    };
    let system = of_code(VERTICAL_CS_TYPE)
        .and_then(crs::vertical)
        .or_else(beside);
    let stated = stated.or_else(|| of_code(VERTICAL_UNITS).and_then(metres_of_code));
    decoded.set_vertical(system, stated);
    decoded.system = reference_system(&keys, by_gdal);
    decoded.file_layout.raster_type = keys.raster_type();
    if let Some(map) = ground_map(image, &keys) {
        decoded.format = decoded.format.replacen("TIFF", "GeoTIFF", 1);
        decoded.set_layout(map, keys.unit());
        if !has_place(image) {
            decoded.place = None;
        }
    } else if let points @ 1.. = numbers(image, MODEL_TIEPOINT).len() / NUMBERS_OF_A_TIE {
        decoded.remark_control_points(points);
    }
}

/// Returns true if the place is stated; a scale alone states only the cell size.
fn has_place(image: &Ifd) -> bool {
    let placed = [MODEL_TRANSFORMATION, MODEL_TIEPOINT];
    placed.iter().any(|tag| !numbers(image, *tag).is_empty())
}

/// Returns the map from column and row to ground coordinates. A negative step of the scale is kept:
/// such files are south-up.
fn ground_map(image: &Ifd, keys: &GeoKeys) -> Option<GroundMap> {
    let numbers = |tag| numbers(image, tag);
    let (x, y) = match (
        numbers(MODEL_TRANSFORMATION).as_slice(),
        numbers(MODEL_PIXEL_SCALE).as_slice(),
        numbers(MODEL_TIEPOINT).as_slice(),
    ) {
        (&[a, b, _, x, d, e, _, y, ..], _, _) => ([x, a, b], [y, d, e]),
        (_, &[east, north, ..], &[column, row, _, x, y, ..]) => (
            [x - column * east, east, 0.0],
            [y + row * north, 0.0, -north],
        ),
        // A scale without a position.
        (_, &[east, north, ..], _) => ([0.0, east, 0.0], [0.0, 0.0, -north]),
        _ => return None,
    };
    match keys.raster_type() == Some(RasterType::Point) {
        true => GroundMap::from_centre(x, y),
        false => GroundMap::new(x, y),
    }
}

/// Returns the horizontal reference system, by its code or its name.
fn reference_system(keys: &GeoKeys, by_gdal: Option<&FileBytes>) -> Option<ReferenceSystem> {
    let code = match keys.is_projected()? {
        true => keys.epsg_code(PROJECTED_CRS_TYPE),
        false => keys.epsg_code(GEODETIC_CRS_TYPE),
    };
    let known = code.and_then(ReferenceSystem::from_code);
    if let Some(system) = known.or_else(|| system_in_text(keys)) {
        return Some(match (keys.stated_metres(), keys.stated_degrees()) {
            (Some(metres), _) if keys.is_projected() == Some(true) => system.in_units_of(metres),
            (_, Some(degrees)) => system.in_degrees_of(degrees),
            _ => system,
        });
    }
    let is_projected = keys.is_projected()?;
    let own_name = keys.text(match is_projected {
        true => PROJ_CITATION,
        false => GEOG_CITATION,
    });
    let unknown = code.map(|code| format!("EPSG:{code}, not supported"));
    let name = unknown.as_deref().or(own_name).or(keys.text(GT_CITATION));
    Some(user_defined::system(keys, is_projected, name, by_gdal))
}

/// Returns a system from Esri's text in the citation, which is used for projections without keys.
fn system_in_text(keys: &GeoKeys) -> Option<ReferenceSystem> {
    let texts = [PROJ_CITATION, GT_CITATION].map(|key| keys.whole_text(key));
    let mut texts = texts.into_iter().flatten();
    let text = texts.find_map(|text| text.strip_prefix("ESRI PE String = "))?;
    ReferenceSystem::from_wkt(text.trim_end_matches('|')).0
}
