//! Coordinate reference systems by EPSG code or as text: what they are called, their
//! units, how long a unit is on the ground, and where that is on the globe.
//!
//! `epsg-utils` knows the codes, `proj4wkt` reads texts, `proj4rs` has the projections,
//! `crs-definitions` the shifts between datums; they are named in this file and its folder
//! only.

mod bound;
mod datum;
mod names;
mod projection;
mod shift;
mod system;
mod wkt;

use epsg_utils::Crs;
use epsg_utils::crs::{CoordinateSystem, Unit as EpsgUnit};

use super::globe::Globe;
pub(super) use datum::Datum;
pub use datum::LonLat;
pub(super) use shift::Shift;
pub use system::ReferenceSystem;
pub(super) use system::Unit;
use wkt::Node;

/// A vertical reference system.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Vertical {
    /// EPSG's code, where it is known.
    pub(super) code: Option<u16>,
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
        code: Some(code),
        metres: metres(&crs.coordinate_system)?,
        is_depth: axis.is_some_and(|axis| axis.direction == "down"),
        name: crs.name,
    })
}

/// Metres in the unit of the projected system with an EPSG code.
pub(super) fn metres_per_unit(code: u16) -> Option<f64> {
    match crs(code)? {
        Crs::ProjectedCrs(crs) => metres(&crs.coordinate_system),
        _ => None,
    }
}

impl Vertical {
    /// A vertical system that is described without a known code.
    fn from_node(node: &Node) -> Option<Self> {
        Some(Self {
            code: None,
            name: node.name()?.to_owned(),
            metres: node.unit()?,
            is_depth: node.has_axis("down"),
        })
    }
}

fn crs(code: u16) -> Option<Crs> {
    epsg_utils::parse_wkt2(code_wkt(code)?).ok()
}

/// The text (WKT 2) of a code.
fn code_wkt(code: u16) -> Option<&'static str> {
    epsg_utils::epsg_to_wkt2(code.into()).ok()
}

/// The unit stands with the system or with its axes.
fn metres(system: &CoordinateSystem) -> Option<f64> {
    let of_axis = system.axes.first().and_then(|axis| axis.unit.as_ref());
    let unit: Option<&EpsgUnit> = system.cs_unit.as_ref().or(of_axis);
    unit.and_then(|unit| unit.conversion_factor)
        .filter(|metres| metres.is_finite() && *metres > 0.0)
}

#[cfg(test)]
mod lonlat_tests;

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
        let named = ReferenceSystem::from_code(26911);
        let named = named.as_ref().map(ReferenceSystem::name);
        assert_eq!(named, Some("NAD83 / UTM zone 11N"));
    }

    fn wkt_of(code: u16) -> &'static str {
        code_wkt(code).expect("a known code")
    }

    /// Against PROJ's own scale factors (`proj -S`).
    #[test]
    fn a_unit_of_the_map_is_as_long_as_it_is_on_the_ground() {
        let cases = [
            (26911, (386_000.0, 3_790_000.0), 1.000_240),
            (2056, (2_600_000.0, 1_200_000.0), 0.999_992),
            (3857, (0.0, 8_399_737.889_8), 0.500_8),
            // NAD27 needs no grid of shifts for that.
            (26711, (386_000.0, 3_790_000.0), 1.000_240),
        ];
        for (code, place, wanted) in cases {
            let system = ReferenceSystem::from_code(code).expect("known");
            let tangents = system.tangents(place).expect("in reach");
            for lead in [tangents.x, tangents.y] {
                let length = lead.iter().map(|part| part * part).sum::<f64>().sqrt();
                assert!((length / wanted - 1.0).abs() < 1e-3, "{code}: {length}");
            }
            assert_eq!(system.tangents((1e12, 1e12)), None);
        }
    }

    /// Against PROJ 9 (pyproj, to the system's own `geodetic_crs`).
    #[test]
    fn places_on_the_globe_and_back() {
        let cases = [
            (26911, (386000.0, 3790000.0), (-118.237991257, 34.244866903)),
            (2056, (2650000.0, 1180000.0), (8.094280924, 46.770599962)),
            (
                3857,
                (-13000000.0, 4000000.0),
                (-116.780986936, 33.785230070),
            ),
            (26710, (562200.0, 5115400.0), (-122.193958766, 46.191297822)),
            (2229, (6490000.0, 1870000.0), (-118.236814274, 34.130615306)),
            (27700, (430000.0, 380000.0), (-1.549637734, 53.315809912)),
            (
                5070,
                (-1500000.0, 1800000.0),
                (-113.341029800, 37.999457522),
            ),
            (3031, (500000.0, -1200000.0), (157.380135052, -78.076720143)),
            (28992, (120000.0, 480000.0), (4.874374687, 52.307857227)),
            (31370, (150000.0, 170000.0), (4.367486482, 50.840956191)),
            (32733, (480000.0, 7200000.0), (14.801291350, -25.316419444)),
            (2154, (700000.0, 6600000.0), (3.000000000, 46.500000000)),
            (3413, (-300000.0, -1500000.0), (-56.309932474, 75.946884614)),
            (2193, (1600000.0, 5400000.0), (173.000000000, -41.551664523)),
            (3577, (900000.0, -3600000.0), (141.682619704, -32.702404944)),
        ];
        for (code, place, wanted) in cases {
            let by_code = ReferenceSystem::from_code(code).expect("known");
            let (by_text, _) = ReferenceSystem::from_wkt(wkt_of(code));
            assert_eq!(Some(&by_code), by_text.as_ref(), "the text names its code");
            let found = by_code.own_degrees(place).expect("in reach");
            let off = (found.0 - wanted.0).abs().max((found.1 - wanted.1).abs());
            assert!(off < 1e-7, "{code}: {found:?} for {wanted:?}");
            let found = by_code.to_lonlat(place).expect("in reach");
            let back = by_code.from_lonlat(found).expect("in reach");
            let off = (back.0 - place.0).abs().max((back.1 - place.1).abs());
            assert!(off < 1e-2, "{code}: {back:?} for {place:?}");
        }
    }

    #[test]
    fn angles_of_a_text_may_be_grads() {
        let text = r#"GEOGCS["old Paris",DATUM["NTF",SPHEROID["Clarke 1880 (IGN)",6378249.2,293.4660212936269]],PRIMEM["Greenwich",0],UNIT["grad",0.01570796326794897]]"#;
        let (system, _) = ReferenceSystem::from_wkt(text);
        let place = system
            .expect("a system")
            .own_degrees((100.0, -50.0))
            .expect("degrees");
        assert!(
            (place.0 - 90.0).abs() < 1e-9 && (place.1 + 45.0).abs() < 1e-9,
            "{place:?}"
        );
    }

    #[test]
    fn a_text_without_a_code_has_its_own_numbers() {
        let text = r#"PROJCS["my feet",GEOGCS["GCS_North_American_1983",DATUM["D_North_American_1983",SPHEROID["GRS_1980",6378137.0,298.257222101]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["False_Easting",1640416.6666666667],PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",-117.0],PARAMETER["Scale_Factor",0.9996],PARAMETER["Latitude_Of_Origin",0.0],UNIT["Foot_US",0.3048006096012192]]"#;
        let (system, vertical) = ReferenceSystem::from_wkt(text);
        let system = system.expect("a system");
        assert_eq!((system.code(), system.name()), (None, "my feet"));
        assert_eq!(system.unit(), Unit::Length(Some(0.304_800_609_601_219_2)));
        assert_eq!(vertical, None);
        let (longitude, latitude) = system
            .to_lonlat((1_640_416.666_666_666_7, 0.0))
            .expect("in reach");
        assert!((longitude + 117.0).abs() < 1e-9 && latitude.abs() < 1e-9);
        let compound = format!(
            r#"COMPD_CS["both",{text},VERT_CS["NAVD88 height (ftUS)",VERT_DATUM["North American Vertical Datum 1988",2005],UNIT["US survey foot",0.304800609601219],AXIS["Gravity-related height",UP]]]"#
        );
        let (across, up) = ReferenceSystem::from_wkt(&compound);
        assert_eq!(across.map(|system| system.unit()), Some(system.unit()));
        let up = up.expect("a vertical system");
        assert_eq!(
            (up.name.as_str(), up.is_depth),
            ("NAVD88 height (ftUS)", false)
        );
        assert!((up.metres - 1200.0 / 3937.0).abs() < 1e-9);
        assert_eq!(
            ReferenceSystem::from_wkt("LOCAL_CS[\"here\",UNIT[\"m\",1]]").0,
            None
        );
    }
}
