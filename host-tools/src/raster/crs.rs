//! Coordinate reference systems by EPSG code: what they are called, their units, and
//! how long a unit is on the ground.
//!
//! `epsg-utils` knows the codes, `proj4rs` the projections; both are named in this
//! file only.

use std::f64::consts::{PI, TAU};

use epsg_utils::Crs;
use epsg_utils::crs::{CoordinateSystem, Unit};
use proj4rs::Proj;
use proj4rs::transform::transform;

/// Semi-major axis, m, and eccentricity squared of WGS 84.
const WGS_84: (f64, f64) = (6_378_137.0, 0.006_694_379_990_141_3);
/// Where a map's units are shorter or longer than this on the ground, the place is
/// outside of what the projection is for.
const SENSIBLE: std::ops::RangeInclusive<f64> = 1e-4..=1e4;

/// A place that a projection gives back this much off is not one of its own, radians:
/// 60 m on the ground.
const SAME_RADIANS: f64 = 1e-5;

/// A vertical unit that follows from a code.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Vertical {
    /// Name of the vertical reference system, as `NAVD88 height (ft)`.
    pub(super) name: String,
    /// Metres in its unit.
    pub(super) metres: f64,
    /// Whether its numbers grow downwards.
    pub(super) is_depth: bool,
}

/// The vertical reference system with an EPSG code.
pub(super) fn vertical(code: u16) -> Option<Vertical> {
    let Crs::VertCrs(crs) = crs(code)? else {
        return None;
    };
    let axis = crs.coordinate_system.axes.first();
    Some(Vertical {
        metres: metres(&crs.coordinate_system)?,
        is_depth: axis.is_some_and(|axis| axis.direction == "down"),
        name: crs.name,
    })
}

/// Name of the reference system with an EPSG code.
pub(super) fn name(code: u16) -> Option<String> {
    Some(match crs(code)? {
        Crs::ProjectedCrs(crs) => crs.name,
        Crs::GeogCrs(crs) => crs.name,
        Crs::GeodCrs(crs) => crs.name,
        Crs::VertCrs(crs) => crs.name,
        Crs::CompoundCrs(crs) => crs.name,
    })
}

/// Metres in the unit of the projected system with an EPSG code.
pub(super) fn metres_per_unit(code: u16) -> Option<f64> {
    match crs(code)? {
        Crs::ProjectedCrs(crs) => metres(&crs.coordinate_system),
        _ => None,
    }
}

/// Ground metres in a unit of the map, towards its x and its y, at a place in the
/// units of the projected system with an EPSG code: a map's scale is true in few
/// places.
pub(super) fn local_metres(code: u16, (x, y): (f64, f64)) -> Option<(f64, f64)> {
    const STEP: f64 = 1.0;
    let map = Proj::from_epsg_code(code).ok()?;
    let globe = globe()?;
    let radians = |x: f64, y: f64| between(&map, &globe, [x, y]).map(|[x, y]| (x, y));
    let here = radians(x, y)?;
    let length = |there: (f64, f64)| {
        let [east, north] = metres_per_radian(here.1);
        let length = (east * (there.0 - here.0)).hypot(north * (there.1 - here.1)) / STEP;
        SENSIBLE.contains(&length).then_some(length)
    };
    Some((
        length(radians(x + STEP, y)?)?,
        length(radians(x, y + STEP)?)?,
    ))
}

/// Metres in a radian of longitude and of latitude at a latitude in radians: the radii
/// of curvature of the ellipsoid.
fn metres_per_radian(latitude: f64) -> [f64; 2] {
    let (a, e2) = WGS_84;
    let (sin, cos) = latitude.sin_cos();
    let w = (1.0 - e2 * sin * sin).sqrt();
    [a * cos / w, a * (1.0 - e2) / (w * w * w)]
}

/// Longitude and latitude (WGS 84, degrees) of a place on the map with an EPSG code.
pub(super) fn to_lonlat(code: u16, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    between(&Proj::from_epsg_code(code).ok()?, &globe()?, [x, y])
        .map(|radians| radians.map(f64::to_degrees))
}

/// The place on the map with an EPSG code at a longitude and latitude (WGS 84, degrees).
pub(super) fn of_lonlat(code: u16, lonlat: [f64; 2]) -> Option<[f64; 2]> {
    let radians = lonlat.map(f64::to_radians);
    let map = Proj::from_epsg_code(code).ok()?;
    let place = between(&globe()?, &map, radians)?;
    // Far outside of what a projection is for its formulas give numbers all the same.
    let back = between(&map, &globe()?, place)?;
    let off = [0, 1].map(|axis| (back[axis] - radians[axis] + PI).rem_euclid(TAU) - PI);
    let is_there = off.iter().all(|angle| angle.abs() < SAME_RADIANS);
    is_there.then_some(place)
}

/// Longitude and latitude (WGS 84, degrees) of those of the geographic system with an
/// EPSG code.
pub(super) fn geographic_to_lonlat(code: u16, own: [f64; 2]) -> Option<[f64; 2]> {
    let own = own.map(f64::to_radians);
    between(&geographic(code)?, &globe()?, own).map(|radians| radians.map(f64::to_degrees))
}

/// Longitude and latitude (degrees) in the geographic system with an EPSG code of those
/// of WGS 84.
pub(super) fn geographic_of_lonlat(code: u16, lonlat: [f64; 2]) -> Option<[f64; 2]> {
    let lonlat = lonlat.map(f64::to_radians);
    between(&globe()?, &geographic(code)?, lonlat).map(|radians| radians.map(f64::to_degrees))
}

fn geographic(code: u16) -> Option<Proj> {
    let system = Proj::from_epsg_code(code).ok()?;
    system.is_latlong().then_some(system)
}

fn globe() -> Option<Proj> {
    Proj::from_proj_string("+proj=longlat +datum=WGS84 +no_defs").ok()
}

/// A place of one system in another; angles in radians.
fn between(from: &Proj, to: &Proj, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    let mut place = (x, y, 0.0);
    transform(from, to, &mut place).ok()?;
    let found = [place.0, place.1];
    found
        .iter()
        .all(|number| number.is_finite())
        .then_some(found)
}

fn crs(code: u16) -> Option<Crs> {
    let text = epsg_utils::epsg_to_wkt2(code.into()).ok()?;
    epsg_utils::parse_wkt2(text).ok()
}

/// The unit stands with the system or with its axes.
fn metres(system: &CoordinateSystem) -> Option<f64> {
    let of_axis = system.axes.first().and_then(|axis| axis.unit.as_ref());
    let unit: Option<&Unit> = system.cs_unit.as_ref().or(of_axis);
    unit.and_then(|unit| unit.conversion_factor)
        .filter(|metres| metres.is_finite() && *metres > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_vertical_and_projected_codes() {
        let vertical = |code| vertical(code).map(|v| (v.metres, v.is_depth));
        assert_eq!(vertical(8228), Some((0.3048, false)));
        assert_eq!(vertical(5773), Some((1.0, false)));
        assert_eq!(vertical(6357), Some((1.0, true)));
        assert_eq!(vertical(26911), None);
        let feet = metres_per_unit(2229).expect("California zone 5");
        assert!((feet - 1200.0 / 3937.0).abs() < 1e-12);
        assert_eq!(metres_per_unit(32767), None);
        assert_eq!(name(26911).as_deref(), Some("NAD83 / UTM zone 11N"));
    }

    /// Against PROJ's own scale factors (`proj -S`).
    #[test]
    fn a_unit_of_the_map_is_as_long_as_it_is_on_the_ground() {
        let cases = [
            (26911, (386_000.0, 3_790_000.0), 1.000_240),
            (2056, (2_600_000.0, 1_200_000.0), 0.999_992),
            (3857, (0.0, 8_399_737.889_8), 0.500_8),
        ];
        for (code, place, wanted) in cases {
            let (east, north) = local_metres(code, place).expect("known");
            assert!((east / wanted - 1.0).abs() < 1e-3, "{code}: {east}");
            assert!((north / wanted - 1.0).abs() < 1e-3, "{code}: {north}");
        }
        assert_eq!(local_metres(26911, (1e12, 1e12)), None);
    }
}
