//! Georeferences of terrain files: reference systems and bounds as GDAL reads them, and the output
//! of `hapterra info` for each.
//!
//! `data/places_by_gdal.csv` was made once by `data/places_by_gdal.py`, which has its command.

use hapterra_tests::reader::Reader;
use hapterra_tests::{info, shared};
use heightfield::{Bounds, OpenOptions, Raster};

const TABLE: &str = include_str!("../../data/places_by_gdal.csv");
/// Tolerance in metres or degrees: the table has full bounds, degrees to 9 digits.
const SAME_PLACE: f64 = 1e-6;

#[derive(Debug, serde::Deserialize)]
struct Row {
    file: String,
    columns: u32,
    rows: u32,
    epsg: String,
    west: f64,
    south: f64,
    east: f64,
    north: f64,
    lon_west: Option<f64>,
    lat_south: Option<f64>,
    lon_east: Option<f64>,
    lat_north: Option<f64>,
}

impl Row {
    fn bounds(&self) -> [f64; 4] {
        [self.west, self.south, self.east, self.north]
    }

    fn lonlat(&self) -> Option<[f64; 4]> {
        Some([
            self.lon_west?,
            self.lat_south?,
            self.lon_east?,
            self.lat_north?,
        ])
    }

    fn is_a_surface(&self) -> bool {
        self.columns > 1 && self.rows > 1
    }
}

fn sides(bounds: Bounds) -> [f64; 4] {
    [bounds.west, bounds.south, bounds.east, bounds.north]
}

fn assert_same(found: Option<Bounds>, expected: [f64; 4], file: &str) {
    let found = sides(found.unwrap_or_else(|| panic!("{file}: no bounds")));
    for (found, expected) in found.iter().zip(expected) {
        assert!(
            (found - expected).abs() < SAME_PLACE * expected.abs().clamp(1.0, 1e3),
            "{file}: {found} for {expected}"
        );
    }
}

#[test]
fn files_are_placed_as_by_gdal() {
    let Some(folder) = shared("dem") else {
        return;
    };
    let mut table = csv::Reader::from_reader(TABLE.as_bytes());
    let mut checked = 0;
    for row in table.deserialize() {
        let row: Row = row.expect("a row of the table");
        let path = folder.join(&row.file);
        if !row.is_a_surface() || !path.is_file() {
            continue;
        }
        for reader in Reader::all()
            .iter()
            .filter(|reader| reader.supports(&row.file))
        {
            let raster = match reader.open(&path, &OpenOptions::default()) {
                Ok(raster) => raster,
                // Colours, or only no-data.
                Err(_) if is_foreign(&row) => continue,
                Err(error) => panic!("{reader:?}: {error}"),
            };
            compare(&raster, &row, *reader);
            checked += 1;
        }
    }
    println!("{checked} files lie where GDAL sees them");
    assert!(checked >= 30, "only {checked} files were there");
}

/// Returns true for files in the collection of other projects' TIFFs that are not terrain.
fn is_foreign(row: &Row) -> bool {
    row.file.starts_with("tiff_ok/")
}

fn compare(raster: &Raster, row: &Row, reader: Reader) {
    let file = &row.file;
    let system = raster.reference_system();
    let code = system.and_then(|system| system.code());
    // GDAL's text may have lost its code: the longitudes are compared below.
    let has_lost_code = reader != Reader::Own && code.is_none() && system.is_some();
    if let (Ok(epsg), false) = (row.epsg.parse::<u16>(), has_lost_code) {
        assert_eq!(code, Some(epsg), "{file} by {reader:?}");
    } else if row.epsg.is_empty() {
        assert_eq!(system, None, "{file} by {reader:?}");
    } else {
        assert!(system.is_some() && code.is_none(), "{file}: {system:?}");
    }
    assert_eq!(
        [raster.columns(), raster.rows()],
        [row.columns, row.rows],
        "{file}"
    );
    assert_same(raster.bounds(), row.bounds(), file);
    let Some(degrees) = row.lonlat() else {
        return;
    };
    if !has_lost_code {
        return assert_same(raster.bounds_lonlat(), degrees, file);
    }
    // Without the code, the shift to WGS 84 is that of the datum's name: usually within 45 m.
    let found = sides(raster.bounds_lonlat().expect("a known projection"));
    for (found, expected) in found.iter().zip(degrees) {
        assert!(
            (found - expected).abs() * 110_000.0 < 45.0,
            "{file}: {found}"
        );
    }
}

/// For each: reference system, bounds, transformation to longitudes, cell's unit, vertical unit and
/// datum, and their source.
#[test]
fn info_names_the_source_of_each_georeference_value() {
    let Some(folder) = shared("dem/real") else {
        return;
    };
    let cases = [
        (
            "bigtujunga.tif",
            ["file", "file", "code", "file", "assumed", ""],
        ),
        (
            "N44W072.hgt",
            ["file", "file", "file", "file", "file", "file"],
        ),
        (
            "SRTMGL3_boulder.asc",
            ["", "assumed", "assumed", "assumed", "assumed", ""],
        ),
        (
            "hugo_site.asc",
            ["", "assumed", "", "assumed", "assumed", ""],
        ),
    ];
    for (file, expected) in cases {
        let report = info(&folder.join(file));
        let found = [
            &report["crs_from"],
            &report["bounds"]["from"],
            &report["bounds_lonlat"]["from"],
            &report["cell"]["unit_from"],
            &report["vertical"]["unit_from"],
            &report["vertical"]["datum_from"],
        ];
        let found = found.map(|from| from.as_str().unwrap_or_default());
        assert_eq!(found, expected, "{file}: {report:#}");
    }
    let report = info(&folder.join("bigtujunga.tif"));
    assert_eq!(report["crs"], "EPSG:32611");
    assert_eq!(report["crs_name"], "WGS 84 / UTM zone 11N");
    // 106 km west of the zone's middle, UTM's scale is 0.99974: a metre of the map is more than a
    // metre on the ground.
    let east = report["cell"]["east_m"].as_f64().expect("a length");
    assert!((east / 30.0 - 1.000_26).abs() < 1e-5, "{east}");
    let report = info(&folder.join("N44W072.hgt"));
    assert_eq!(report["vertical"]["datum_code"], "EPSG:5773");
}
