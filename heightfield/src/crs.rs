//! Coordinate reference systems by EPSG code or as text: their names, their units, the length of a
//! unit on the ground, and positions on the globe.
//!
//! The codes are in `crs-definitions` and two tables, the projections in `proj4rs`, and the shifts
//! between datums in `crs-definitions`. Texts without a code, systems defined by keys and unknown
//! codes are described by libgdal's PROJ, if it is installed (`by_gdal`). Only this folder uses
//! these crates.

mod by_gdal;
mod datum;
mod definition;
mod lookup;
mod projection;
mod shift;
mod system;
mod transform;
mod unit;
mod wkt;

use super::globe::Globe;
pub(super) use datum::Datum;
pub use datum::LonLat;
pub(crate) use definition::{vertical, vertical_of_compound};
pub use system::ReferenceSystem;
pub(super) use unit::Unit;
use wkt::Node;

/// A vertical reference system.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Vertical {
    /// EPSG's code, if it is known.
    pub(super) code: Option<u16>,
    /// Name of the vertical reference system, as `NAVD88 height (ft)`.
    pub(super) name: String,
    /// Metres in a unit of its heights.
    pub(super) metres: f64,
    /// True if its numbers grow downwards.
    pub(super) is_depth: bool,
}

impl Vertical {
    /// Reads the vertical system in a text, beside a horizontal system.
    fn of_compound(root: &Node) -> Option<Self> {
        let node = root.child(&["VERT_CS", "VERTCRS", "VERTICALCRS", "VERTCS"])?;
        Self::of(node)
    }

    /// Reads the vertical system that a node describes.
    fn of(node: &Node) -> Option<Self> {
        let described = || {
            Some(Self {
                code: None,
                name: node.name()?.to_owned(),
                metres: node.unit()?,
                is_depth: node.has_axis("down"),
            })
        };
        node.epsg().and_then(vertical).or_else(described)
    }
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
        let feet = ReferenceSystem::from_code(2229).map(|system| system.unit());
        let Some(Unit::Length(Some(feet))) = feet else {
            panic!("California zone 5: {feet:?}");
        };
        assert!((feet - 1200.0 / 3937.0).abs() < 1e-12);
        let named = ReferenceSystem::from_code(26911);
        let named = named.as_ref().map(ReferenceSystem::name);
        assert_eq!(named, Some("NAD83 / UTM zone 11N"));
    }

    /// Against PROJ's own scale factors (`proj -S`).
    #[test]
    fn map_unit_has_its_length_on_the_ground() {
        let cases = [
            (26911, (386_000.0, 3_790_000.0), 1.000_240),
            (2056, (2_600_000.0, 1_200_000.0), 0.999_992),
            (3857, (0.0, 8_399_737.889_8), 0.500_8),
            // NAD27 needs no shift grid for that.
            (26711, (386_000.0, 3_790_000.0), 1.000_240),
        ];
        for (code, place, expected) in cases {
            let system = ReferenceSystem::from_code(code).expect("known");
            let tangents = system.tangents(place).expect("in reach");
            for lead in [tangents.x, tangents.y] {
                let length = lead.iter().map(|part| part * part).sum::<f64>().sqrt();
                assert!((length / expected - 1.0).abs() < 1e-3, "{code}: {length}");
            }
            assert_eq!(system.tangents((1e12, 1e12)), None);
        }
    }

    /// Against PROJ 9 (pyproj, to the system's own `geodetic_crs`).
    #[test]
    fn positions_round_trip_through_longitude_and_latitude() {
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
        for (code, place, expected) in cases {
            let by_code = ReferenceSystem::from_code(code).expect("known");
            let wkt = crs_definitions::from_code(code).expect("known").wkt;
            let (by_text, _) = ReferenceSystem::from_wkt(wkt);
            assert_eq!(Some(&by_code), by_text.as_ref(), "the text names its code");
            let found = by_code.own_degrees(place).expect("in reach");
            let error = (found.0 - expected.0)
                .abs()
                .max((found.1 - expected.1).abs());
            assert!(error < 1e-7, "{code}: {found:?} for {expected:?}");
            let found = by_code.to_lonlat(place).expect("in reach");
            let back = by_code.from_lonlat(found).expect("in reach");
            let error = (back.0 - place.0).abs().max((back.1 - place.1).abs());
            assert!(error < 1e-2, "{code}: {back:?} for {place:?}");
        }
    }

    #[test]
    fn wkt_angles_may_be_grads() {
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
    fn wkt_without_a_code_uses_its_own_parameters() {
        if !lonlat_tests::has_libgdal() {
            return;
        }
        let text = r#"PROJCS["my feet",GEOGCS["GCS_North_American_1983",DATUM["D_North_American_1983",SPHEROID["GRS_1980",6378137.0,298.257222101]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],PARAMETER["False_Easting",1640416.6666666667],PARAMETER["False_Northing",0.0],PARAMETER["Central_Meridian",-117.0],PARAMETER["Scale_Factor",0.9996],PARAMETER["Latitude_Of_Origin",0.0],UNIT["Foot_US",0.3048006096012192]]"#;
        let (system, vertical) = ReferenceSystem::from_wkt(text);
        let system = system.expect("a system");
        assert_eq!((system.code(), system.name()), (None, "my feet"));
        let Unit::Length(Some(metres)) = system.unit() else {
            panic!("{:?}", system.unit());
        };
        assert!((metres - 1200.0 / 3937.0).abs() < 1e-15);
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

    /// Against PROJ 9.5 (pyproj), from the datum's own degrees, by `tests/data/epsg_places.py`: a
    /// place of every twentieth projected system.
    #[test]
    fn codes_have_the_positions_of_proj() {
        let places = include_str!("crs/places.txt").lines().skip(1);
        let mut unplaced = vec![];
        for line in places {
            let numbers: Vec<f64> = line
                .split(' ')
                .map(|n| n.parse().expect("a number"))
                .collect();
            let &[code, longitude, latitude, x, y] = &numbers[..] else {
                panic!("{line}");
            };
            let system = ReferenceSystem::from_code(code as u16);
            let Some(found) = system.and_then(|system| system.own_degrees((x, y))) else {
                unplaced.push(code);
                continue;
            };
            let east = (found.0 - longitude) * latitude.to_radians().cos();
            let error_m = 111_000.0 * east.hypot(found.1 - latitude);
            assert!(error_m < 1.0, "{code}: {error_m} m off");
        }
        // Two urban grids of Colombia, whose projection no other system uses.
        assert_eq!(unplaced, [6255.0, 6275.0]);
    }

    /// A unit beside a code overrides the code's unit, in a text as in keys.
    #[test]
    fn wkt_unit_has_priority_over_its_code() {
        let text = |unit: &str| {
            format!(r#"PROJCS["here",GEOGCS["NAD83"],{unit},AUTHORITY["EPSG","26945"]]"#)
        };
        let metres = text(r#"UNIT["metre",1]"#);
        let feet = text(r#"UNIT["US survey foot",0.304800609601219]"#);
        let [metres, feet] = [metres, feet].map(|text| {
            let system = ReferenceSystem::from_wkt(&text).0.expect("a system");
            assert_eq!(system.code(), Some(26945));
            system
        });
        let place = (1_981_540.0, 566_554.0);
        let same = (place.0 * 3937.0 / 1200.0, place.1 * 3937.0 / 1200.0);
        let (a, b) = (metres.to_lonlat(place), feet.to_lonlat(same));
        let (a, b) = (a.expect("in reach"), b.expect("in reach"));
        assert!(
            (a.0 - b.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-9,
            "{a:?} {b:?}"
        );
        let remark = feet.other_unit().expect("reported");
        assert!(
            remark.contains("0.3048006") && metres.other_unit().is_none(),
            "{remark}"
        );
        assert!(!metres.has_unit_of(&feet));
    }
}
