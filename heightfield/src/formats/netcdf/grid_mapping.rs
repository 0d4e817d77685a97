//! The reference system that a grid mapping spells out in attributes (CF conventions,
//! appendix F), where it has no text.

use netcdf_reader::NcVariable;

use super::attributes::{number, numbers, text};
use crate::Globe;
use crate::crs::{Datum, ReferenceSystem, Shift, Unit};

/// The system of a mapping, whose coordinates on a map count so many metres.
pub(super) fn system(mapping: &NcVariable, metres: Option<f64>) -> Option<ReferenceSystem> {
    let method = text(mapping, "grid_mapping_name")?;
    let datum = datum(mapping);
    let stated = ["projected_crs_name", "geographic_crs_name", "long_name"];
    let name = stated.iter().find_map(|name| text(mapping, name));
    let name = name.unwrap_or_else(|| method.replace('_', " "));
    if method == "latitude_longitude" {
        // Without a size of the globe it tells no more than the axes do.
        let datum = Some(datum?);
        return Some(ReferenceSystem::named(&name, Unit::Angle(1.0), datum));
    }
    let named = ReferenceSystem::named(&name, Unit::Length(metres), datum);
    let meridian = named.meridian();
    Some(match projection(mapping, &method, metres.unwrap_or(1.0)) {
        Some(words) => named.with_projection(&format!("{words} +pm={meridian}")),
        None => named,
    })
}

fn datum(mapping: &NcVariable) -> Option<Datum> {
    let number = |name| number(mapping, name);
    let by_axes = || {
        let major = number("semi_major_axis")?;
        match (number("inverse_flattening"), number("semi_minor_axis")) {
            (Some(inverse), _) => Globe::new(major, inverse),
            (None, Some(minor)) => Globe::from_axes(major, minor),
            (None, None) => None,
        }
    };
    let globe = by_axes().or_else(|| Globe::new(number("earth_radius")?, 0.0))?;
    let meridian = number("longitude_of_prime_meridian").unwrap_or(0.0);
    let names = ["horizontal_datum_name", "reference_ellipsoid_name"];
    let name = names.iter().find_map(|name| text(mapping, name));
    let name = name.unwrap_or_else(|| "without a name".to_owned());
    let shift = Shift::by_numbers(&globe, &numbers(mapping, "towgs84"));
    let shift = shift.or_else(|| Shift::of(&name, None));
    Some(Datum::new(name, globe, meridian, shift))
}

/// The projection as PROJ writes it, for the mappings that maps of terrain use; `metres` are
/// those in a unit of the coordinates.
fn projection(mapping: &NcVariable, method: &str, metres: f64) -> Option<String> {
    let number = |name: &str| number(mapping, name);
    let of = |names: &[&str]| names.iter().find_map(|name| number(name)).unwrap_or(0.0);
    let longitude = of(&[
        "longitude_of_projection_origin",
        "longitude_of_central_meridian",
        "straight_vertical_longitude_from_pole",
    ]);
    let latitude = of(&["latitude_of_projection_origin"]);
    let parallels = numbers(mapping, "standard_parallel");
    let first = parallels.first().copied();
    let second = parallels.get(1).or(parallels.first()).copied();
    let (one, two) = (first.unwrap_or(latitude), second.unwrap_or(latitude));
    let scales = [
        "scale_factor_at_projection_origin",
        "scale_factor_at_central_meridian",
    ];
    let scale = scales.iter().find_map(|name| number(name)).unwrap_or(1.0);
    let at = format!("+lat_0={latitude} +lon_0={longitude}");
    let kind = match method {
        "albers_conical_equal_area" => format!("+proj=aea {at} +lat_1={one} +lat_2={two}"),
        "azimuthal_equidistant" => format!("+proj=aeqd {at}"),
        "lambert_azimuthal_equal_area" => format!("+proj=laea {at}"),
        "lambert_conformal_conic" => format!("+proj=lcc {at} +lat_1={one} +lat_2={two}"),
        "lambert_cylindrical_equal_area" => format!("+proj=cea +lon_0={longitude} +lat_ts={one}"),
        "mercator" => match first {
            Some(parallel) => format!("+proj=merc +lon_0={longitude} +lat_ts={parallel}"),
            None => format!("+proj=merc +lon_0={longitude} +k={scale}"),
        },
        "polar_stereographic" => {
            let pole = 90.0_f64.copysign(if latitude == 0.0 { one } else { latitude });
            match first {
                Some(parallel) => {
                    format!("+proj=stere +lat_0={pole} +lon_0={longitude} +lat_ts={parallel}")
                }
                None => format!("+proj=stere +lat_0={pole} +lon_0={longitude} +k={scale}"),
            }
        }
        "sinusoidal" => format!("+proj=sinu +lon_0={longitude}"),
        "stereographic" => format!("+proj=stere {at} +k={scale}"),
        "transverse_mercator" => format!("+proj=tmerc {at} +k={scale}"),
        _ => return None,
    };
    let shift = |name| number(name).unwrap_or(0.0) * metres;
    Some(format!(
        "{kind} +x_0={} +y_0={} +to_meter={metres}",
        shift("false_easting"),
        shift("false_northing")
    ))
}
