//! Longitudes and latitudes for systems of every kind.

use super::*;

const DEGREE_M: f64 = 111_000.0;

/// Returns true if there is a libgdal, which describes texts without a code; reports it if there is
/// none.
pub(super) fn has_libgdal() -> bool {
    let library = heightfield_gdal::Library::load(heightfield_gdal::Settings::default());
    if let Err(why) = &library {
        println!("skipped: {why}");
    }
    library.is_ok()
}

fn off_m(found: (f64, f64), expected: (f64, f64)) -> f64 {
    let east = (found.0 - expected.0) * expected.1.to_radians().cos();
    DEGREE_M * east.hypot(found.1 - expected.1)
}

/// Against PROJ 9's best transformation without grids (pyproj's TransformerGroup), x and y
/// in the system's own units: grads, degrees from another meridian, metres, feet.
#[test]
fn longitudes_and_latitudes_are_those_of_wgs_84() {
    let cases = [
        (4807, (2.0, 53.0), (4.136_593_3, 47.699_949_9)),
        (27572, (6e5, 2.2e6), (2.336_533_6, 46.799_948_8)),
        (4267, (-100.0, 40.0), (-100.000_436_6, 40.000_072_0)),
        (26711, (386e3, 3.79e6), (-118.238_896_1, 34.246_710_1)),
        (4230, (10.0, 50.0), (9.998_864_6, 49.999_198_6)),
        (23032, (5e5, 5.5e6), (8.998_848_1, 49.650_729_7)),
        (31467, (3.5e6, 5.5e6), (8.998_963_6, 49.636_710_6)),
        (27700, (430e3, 380e3), (-1.551_153_0, 53.316_087_5)),
        (4806, (-3.0, 43.0), (9.452_000_2, 43.000_667_0)),
        (2056, (2.65e6, 1.18e6), (8.093_233_0, 46.769_304_6)),
        (4326, (10.0, 60.0), (10.0, 60.0)),
        (2229, (6.49e6, 1.87e6), (-118.236_814_3, 34.130_615_3)),
    ];
    for (code, place, expected) in cases {
        let system = ReferenceSystem::from_code(code).expect("known");
        let within_m = match system.lonlat() {
            LonLat::Wgs84 => 0.01,
            LonLat::ShiftedToWgs84 { within_m } => within_m,
            other => panic!("{code}: {other:?}"),
        };
        let found = system.to_lonlat(place).expect("in reach");
        let off = off_m(found, expected);
        assert!(off < within_m, "{code}: {off} m off, {within_m} m stated");
        let back = system.from_lonlat(found).expect("in reach");
        let off = (back.0 - place.0).hypot(back.1 - place.1);
        let tolerance = if place.0 > 1e3 { 1e-2 } else { 1e-7 };
        assert!(off < tolerance, "{code}: {back:?} for {place:?}");
    }
}

/// Esri's texts have no codes: the datum is found by its name.
#[test]
fn wkt_without_a_code_is_shifted_by_its_datum() {
    if !has_libgdal() {
        return;
    }
    let text = |datum: &str, more: &str| {
        let name = datum.replace("D_", "GCS_");
        format!(
            r#"GEOGCS["{name}",DATUM["{datum}",SPHEROID["International_1924",6378388.0,297.0]{more}],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]]"#
        )
    };
    let found = |text: &str| {
        let system = ReferenceSystem::from_wkt(text).0.expect("a system");
        let projection = match system.lonlat() {
            LonLat::ShiftedToWgs84 { within_m } => Some(within_m),
            LonLat::OfOwnDatum { .. } => None,
            other => panic!("{other:?}"),
        };
        (system.to_lonlat((10.0, 50.0)).expect("degrees"), projection)
    };
    let ed50 = (9.998_864_6, 49.999_198_6);
    for (text, error_m) in [
        (text("D_European_1950", ""), Some(45.0)),
        (
            text("D_Somewhere", ",TOWGS84[-87,-98,-121,0,0,0,0]"),
            Some(45.0),
        ),
        (
            text("D_Somewhere", ",TOWGS84[-87,-98,-121,0,0,0.1,1]"),
            Some(10.0),
        ),
    ] {
        let (place, found_error_m) = found(&text);
        assert_eq!(found_error_m, error_m, "{text}");
        assert!(off_m(place, ed50) < error_m.unwrap_or(0.0), "{place:?}");
    }
    let (place, error_m) = found(&text("D_Somewhere", ""));
    assert_eq!((place, error_m), ((10.0, 50.0), None), "nothing is made up");
}

#[test]
fn wkt_meridian_and_grads_are_used() {
    if !has_libgdal() {
        return;
    }
    let text = r#"GEOGCS["NTF (Paris)",DATUM["Nouvelle_Triangulation_Francaise_Paris",SPHEROID["Clarke 1880 (IGN)",6378249.2,293.4660212936269]],PRIMEM["Paris",2.33722917],UNIT["grad",0.01570796326794897]]"#;
    let system = ReferenceSystem::from_wkt(text).0.expect("a system");
    assert_eq!(system.unit(), Unit::Angle(0.9));
    let found = system.to_lonlat((2.0, 53.0)).expect("degrees");
    let off = off_m(found, (4.136_593_3, 47.699_949_9));
    assert!(off < 10.0, "{off} m off: {found:?}");
    assert!(!system.counts_lonlat());
    let plain = ReferenceSystem::from_code(4269).expect("known");
    assert!(plain.counts_lonlat(), "NAD83 is within 4 m");
}

#[test]
fn moon_has_its_own_longitudes() {
    if !has_libgdal() {
        return;
    }
    let text = r#"PROJCS["Moon",GEOGCS["GCS_Moon_2000",DATUM["D_Moon_2000",SPHEROID["Moon_2000_IAU_IAG",1737400.0,0.0]],PRIMEM["Reference_Meridian",0.0],UNIT["Degree",0.0174532925199433]],PROJECTION["Polar_Stereographic"],PARAMETER["False_Easting",0],PARAMETER["False_Northing",0],PARAMETER["Central_Meridian",0],PARAMETER["Scale_Factor",1],PARAMETER["latitude_of_origin",-90],UNIT["Meter",1]]"#;
    let system = ReferenceSystem::from_wkt(text).0.expect("a system");
    let name = "D_Moon_2000";
    let radius_m = 1_737_400.0;
    assert_eq!(system.lonlat(), LonLat::OfBody { name, radius_m });
    let degree_m = radius_m.to_radians();
    let place = system.from_lonlat((0.0, -89.0)).expect("in reach");
    assert!((place.1 / degree_m - 1.0).abs() < 1e-3, "{place:?}");
    let tangents = system.tangents(place).expect("in reach");
    for lead in [tangents.x, tangents.y] {
        let length = lead.iter().map(|part| part * part).sum::<f64>().sqrt();
        assert!((length - 1.0).abs() < 1e-3, "{lead:?}");
    }
}

/// At a pole, all longitudes are the same position.
#[test]
fn poles_of_polar_maps_are_valid_positions() {
    for (code, latitude, expected) in [
        (3031, -90.0, (0.0, 0.0)),
        (3413, 90.0, (0.0, 0.0)),
        (32661, 90.0, (2e6, 2e6)),
        (3995, 90.0, (0.0, 0.0)),
        (3571, 90.0, (0.0, 0.0)),
    ] {
        let system = ReferenceSystem::from_code(code).expect("known");
        for longitude in [0.0, 45.0, -123.4, 180.0] {
            let found = system.from_lonlat((longitude, latitude));
            let found = found.unwrap_or_else(|| panic!("{code}: the pole at {longitude}°"));
            let off = (found.0 - expected.0).hypot(found.1 - expected.1);
            assert!(off < 1e-3, "{code}: {found:?}");
        }
        assert_eq!(system.from_lonlat((0.0, -latitude)), None, "{code}");
    }
}
