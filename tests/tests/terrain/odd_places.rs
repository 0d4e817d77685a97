//! Terrains with unusual georeferences: grads, other meridians and datums, other bodies, poles,
//! projections defined only by a file's own keys, sheared grids.
//!
//! `data/odd_places.py` made them with GDAL, and the table of their positions by GDAL and PROJ.

use std::path::Path;
use std::process::Command;

use hapterra::place::{Coordinates, Target};
use hapterra::terrain::{HapticCells, HapticGrid};
use hapterra_tests::reader::Reader;
use hapterra_tests::{hapterra_binary, info};
use heightfield::{OpenOptions, Raster};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/odd_places");
/// Metres in a degree of latitude, for the error of a shift.
const DEGREE_M: f64 = 110_000.0;

#[derive(Debug, serde::Deserialize)]
struct Row {
    file: String,
    lon_west: f64,
    lat_south: f64,
    lon_east: f64,
    lat_north: f64,
    lon_middle: f64,
    lat_middle: f64,
    along_row_m: f64,
    along_column_m: f64,
    lean: f64,
}

impl Row {
    fn path(&self) -> String {
        format!("{FOLDER}/{}", self.file)
    }

    fn sides(&self) -> [f64; 4] {
        [self.lon_west, self.lat_south, self.lon_east, self.lat_north]
    }

    fn raster(&self) -> Raster {
        self.raster_by(Reader::Own)
    }

    fn raster_by(&self, reader: Reader) -> Raster {
        let raster = reader.open(Path::new(&self.path()), &OpenOptions::default());
        raster.unwrap_or_else(|error| panic!("{reader:?}: {error}"))
    }
}

fn rows() -> Vec<Row> {
    let table = csv::Reader::from_path(format!("{FOLDER}/places.csv"));
    let rows: Result<Vec<Row>, _> = table.expect("the table").into_deserialize().collect();
    let rows = rows.expect("rows");
    assert!(rows.len() >= 38);
    rows
}

#[test]
fn lonlat_of_bounds_and_middle_agrees_with_proj() {
    for row in rows() {
        let report = info(Path::new(&row.path()));
        let bounds = &report["bounds_lonlat"];
        let found = ["west", "south", "east", "north"].map(|side| bounds[side].as_f64());
        let within_m = bounds["within_m"].as_f64().unwrap_or(0.0).max(0.01);
        for (found, expected) in found.iter().zip(row.sides()) {
            let found = found.unwrap_or_else(|| panic!("{}: {report:#}", row.file));
            let off_m = (found - expected).abs() * DEGREE_M;
            // A parallel is curved on most maps, so the edges are followed in steps.
            assert!(off_m < within_m, "{}: {found} for {expected}", row.file);
        }
        let raster = row.raster();
        let file = raster.georeference();
        let [west, south, east, north] = file.bounds();
        let middle = [0.5 * (west + east), 0.5 * (south + north)];
        let [longitude, latitude] = file.to_lonlat(middle).expect("on the globe");
        let east = (longitude - row.lon_middle) * row.lat_middle.to_radians().cos();
        let off_m = DEGREE_M * east.hypot(latitude - row.lat_middle);
        assert!(off_m < within_m, "{}: {off_m} m off", row.file);
    }
}

#[test]
fn lonlat_target_resolves_to_its_sample() {
    for row in rows() {
        let raster = row.raster();
        let file = raster.georeference();
        let target = Target::At([row.lon_middle, row.lat_middle], Coordinates::LonLat);
        let ground = target.middle(&file).expect(&row.file).expect("a place");
        let sample = file.transform().to_samples(ground);
        // A shift may have an error above a sample.
        let within_m = info(Path::new(&row.path()))["bounds_lonlat"]["within_m"]
            .as_f64()
            .unwrap_or(0.0);
        let samples = within_m / row.along_row_m.min(row.along_column_m) + 0.01;
        let off = (sample[0] - 3.5).hypot(sample[1] - 2.5);
        assert!(off < samples, "{}: at {sample:?}", row.file);
    }
}

#[test]
fn cell_sizes_are_those_on_the_own_body() {
    for row in rows() {
        for reader in Reader::all() {
            let raster = row.raster_by(reader);
            let cell = raster
                .cell()
                .unwrap_or_else(|| panic!("{} by {reader:?}", row.file));
            let (along_row, along_column) = cell.ground_metres();
            let off = cell.lean - row.lean;
            assert!(
                off.abs() < 1e-4,
                "{} by {reader:?}: leans by {} for {}",
                row.file,
                cell.lean,
                row.lean
            );
            for (found, expected) in [
                (along_row, row.along_row_m),
                (along_column, row.along_column_m),
            ] {
                let off = found / expected - 1.0;
                assert!(
                    off.abs() < 1e-4,
                    "{} by {reader:?}: {found} for {expected} m",
                    row.file
                );
            }
        }
    }
}

/// A map that is not conformal shears the ground, and a turned grid of degrees is itself sheared:
/// still, haptic cells are square on the ground, in every direction.
#[test]
fn sheared_map_is_rendered_in_its_true_shape() {
    let mut sheared = 0;
    for row in rows() {
        let raster = row.raster();
        let grid = HapticGrid::new(&raster, HapticCells::Square);
        let worst = |grid: &HapticGrid<'_>| {
            let [u, v] = [grid.columns(), grid.rows()].map(|count| 0.5 * (f64::from(count) - 1.0));
            grid.worst_in([u, v, u, v])
                .expect("a cell of known size")
                .share
        };
        assert!(worst(&grid) < 1e-3, "{}: {}", row.file, worst(&grid));
        if row.lean.abs() > 2e-3 {
            sheared += 1;
            let stored = HapticGrid::new(&raster, HapticCells::Stored);
            let off = worst(&stored);
            // The longest and the shortest direction deviate by half of the shear.
            assert!(off > 0.4 * row.lean.abs(), "{}: {off}", row.file);
            assert!(stored.is_distorted() && grid.is_resampled(), "{}", row.file);
        }
    }
    assert!(sheared >= 5, "{sheared}");
}

fn output_of(file: &str) -> String {
    let output = Command::new(hapterra_binary())
        .args(["info", &format!("{FOLDER}/{file}.tif")])
        .output()
        .expect("it runs");
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn info_states_unit_datum_and_accuracy_of_lonlat() {
    for (file, parts) in [
        (
            "ntf_paris_grads",
            ["(grad, stated)", "WGS 84, usually within 45 m"],
        ),
        ("nad27", ["(degree, stated)", "WGS 84, usually within 45 m"]),
        (
            "south_pole",
            ["lon/lat   west -180.000000, south -90", "WGS 84)"],
        ),
        (
            "moon",
            ["Moon 2000", "on a body of 1737.4 km radius, not the Earth"],
        ),
        ("modis", ["west 1111950.500", "of its own datum, "]),
        ("feet", ["unit of 0.304", "WGS 84, usually within 4 m"]),
    ] {
        let output = output_of(file);
        for part in parts {
            assert!(output.contains(part), "{part} in:\n{output}");
        }
    }
}

/// A sheared grid is rendered in its true shape, with a note.
#[test]
fn sheared_grid_is_resampled_to_true_shape_with_a_note() {
    let path = format!("{FOLDER}/sheared.tif");
    let raster = Raster::open(&path, &OpenOptions::default()).expect("a terrain");
    let grid = HapticGrid::new(&raster, HapticCells::Square);
    assert!(grid.is_resampled() && !grid.is_distorted());
    // 5 cells along a column of the haptic grid are straight north on the map.
    let [from, to] = [[2.0, 0.0], [2.0, 4.0]].map(|cell| grid.to_ground(cell));
    assert!(
        (to[0] - from[0]).abs() < 1e-6 && to[1] > from[1],
        "{from:?} {to:?}"
    );
    let output = output_of("sheared");
    assert!(output.contains("the grid is sheared"), "{output}");
    assert!(
        output.contains("by -16.7°") || output.contains("by 16.7°"),
        "{output}"
    );
    assert!(!output.contains("rotated"), "{output}");
}

/// A map in feet whose heights have no unit is rendered 3.28 times too steep if they are in feet as
/// well: every command reports it until the unit is stated.
#[test]
fn assumed_height_unit_is_reported_until_stated() {
    let reported = |file: &str, more: &[&str]| {
        let output = Command::new(hapterra_binary())
            .args(["info", "--json", &format!("{FOLDER}/{file}")])
            .args(more)
            .output()
            .expect("it runs");
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let unit = report["vertical"]["metres_per_unit"].as_f64();
        let from = report["vertical"]["unit_from"].as_str().map(str::to_owned);
        let output = String::from_utf8(output.stderr).expect("text");
        (output, unit.expect("a unit"), from.expect("a source"))
    };
    let (output, unit, from) = reported("feet.tif", &[]);
    assert!(
        output.contains("3.28 times too steep: --input height-unit=us-ft"),
        "{output}"
    );
    assert_eq!((unit, from.as_str()), (1.0, "assumed"));
    let (output, unit, from) = reported("feet.tif", &["--input", "height-unit=us-ft"]);
    assert_eq!((output.as_str(), from.as_str()), ("", "option"));
    assert!((unit - 1200.0 / 3937.0).abs() < 1e-12, "{unit}");
    let (output, ..) = reported("nad27.tif", &[]);
    assert!(output.contains("--input height-unit="), "{output}");
    // Metres on the ground, or a unit stated in the file, need no note.
    let (output, ..) = reported("rotated.tif", &[]);
    assert_eq!(output, "");
}

/// Unknown projections are named, with a remedy.
#[test]
fn unsupported_projection_is_named_with_a_remedy() {
    for (file, name) in [
        ("new_zealand.tif", "New Zealand Map Grid"),
        ("grinten.tif", "VanDerGrinten"),
    ] {
        let path = format!("{FOLDER}/{file}");
        let report = info(Path::new(&path));
        assert!(report["bounds_lonlat"].is_null(), "{report:#}");
        assert!(report["bounds"].is_object(), "{report:#}");
        let output = Command::new(hapterra_binary())
            .args([
                "demo", "--device", "native", "--at", "174,-41", "--crs", "lonlat", &path,
            ])
            .output()
            .expect("it runs");
        assert!(!output.status.success());
        let output = String::from_utf8(output.stderr).expect("text");
        for part in [name, "--at X,Y", "gdalwarp -t_srs EPSG:4326"] {
            assert!(output.contains(part), "{part} in:\n{output}");
        }
    }
}
