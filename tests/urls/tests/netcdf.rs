//! NetCDF files at URLs: every way of storing a variable is the same as on disk, in windows,
//! and of a large variable what is touched is fetched.

use std::path::{Path, PathBuf};

use hapterra_tests::timeouts::wait_until;
use hapterra_url_tests::http::{Fault, Server};
use heightfield::{OpenOptions, Raster};

fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../data/netcdf")
}

fn windows() -> OpenOptions {
    OpenOptions {
        most_in_memory_bytes: 0,
        ..OpenOptions::default()
    }
}

/// All samples of a level, bit for bit.
fn bits(raster: &Raster, level: u8) -> Vec<u64> {
    let step = 1 << level;
    let (columns, rows) = (
        raster.columns().div_ceil(step),
        raster.rows().div_ceil(step),
    );
    let row = |row| {
        let mut heights = vec![0.0; columns as usize];
        raster.copy_row(level, row, 0, &mut heights);
        heights
    };
    (0..rows).flat_map(row).map(f64::to_bits).collect()
}

#[test]
fn every_storage_is_the_same_from_a_server() {
    let server = Server::of(&data());
    let mut compared = 0;
    for entry in std::fs::read_dir(data()).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy();
        if !name.ends_with(".nc") {
            continue;
        }
        let here = Raster::open(&path, &OpenOptions::default());
        let here = here.unwrap_or_else(|error| panic!("{name}: {error}"));
        let there = Raster::open(server.url(&name), &windows());
        let there = there.unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(there.samples().is_none(), "{name} stays where it is");
        assert_eq!(here.cell(), there.cell(), "{name}");
        for level in [0, 2] {
            assert_eq!(bits(&here, level), bits(&there, level), "{name} {level}");
        }
        compared += 1;
    }
    assert!(compared >= 20, "{compared} files");
}

/// Samples of a large variable each way.
const SIDE: u32 = 1500;

/// A file of the classic format with one variable of floats, row by row from the north. Its header
/// is the one of the format's specification: dimensions, no attributes, three variables.
fn classic(height: impl Fn(u32, u32) -> f32) -> Vec<u8> {
    let [dimension_tag, variable_tag, attribute_tag] = [10, 11, 12];
    let [char, float, double] = [2, 5, 6];
    let words = |bytes: &mut Vec<u8>, words: &[u32]| {
        bytes.extend(words.iter().flat_map(|word| word.to_be_bytes()));
    };
    // Of four letters at most, filled up to four.
    let name = |bytes: &mut Vec<u8>, name: &str| {
        words(bytes, &[name.len() as u32]);
        bytes.extend(name.bytes().chain([0; 4]).take(4));
    };
    let header = |begins: [u32; 3]| {
        let mut bytes = b"CDF\x01".to_vec();
        words(&mut bytes, &[0, dimension_tag, 2]);
        for dimension in ["lat", "lon"] {
            name(&mut bytes, dimension);
            words(&mut bytes, &[SIDE]);
        }
        words(&mut bytes, &[0, 0, variable_tag, 3]);
        for (axis, units, begin) in [
            ("lat", "degrees_north", begins[0]),
            ("lon", "degrees_east", begins[1]),
        ] {
            name(&mut bytes, axis);
            words(
                &mut bytes,
                &[1, u32::from(axis == "lon"), attribute_tag, 1, 5],
            );
            bytes.extend(b"units\0\0\0");
            words(&mut bytes, &[char, units.len() as u32]);
            bytes.extend(
                units
                    .bytes()
                    .chain([0; 3])
                    .take(units.len().next_multiple_of(4)),
            );
            words(&mut bytes, &[double, 8 * SIDE, begin]);
        }
        name(&mut bytes, "z");
        words(
            &mut bytes,
            &[2, 0, 1, 0, 0, float, 4 * SIDE * SIDE, begins[2]],
        );
        bytes
    };
    let first = header([0; 3]).len() as u32;
    let mut bytes = header([first, first + 8 * SIDE, first + 16 * SIDE]);
    let axis = |from: f64, step: f64| (0..SIDE).map(move |i| from + step * f64::from(i));
    let axes = axis(50.0, -0.001).chain(axis(8.0, 0.001));
    bytes.extend(axes.flat_map(f64::to_be_bytes));
    let places = (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| (column, row)));
    bytes.extend(places.flat_map(|(column, row)| height(column, row).to_be_bytes()));
    bytes
}

/// What is touched at places that opening the file has not looked at, while the server has
/// failed and afterwards.
fn comes_late(
    server: &Server,
    raster: &Raster,
    places: &[(u32, u32)],
    wanted: impl Fn(u32, u32) -> f64,
) {
    let has_come = || {
        places
            .iter()
            .all(|(column, row)| raster.height(*column, *row) == wanted(*column, *row))
    };
    raster.stop_waiting();
    server.fail(Fault::Error500, usize::MAX);
    let before = raster.not_yet();
    assert!(!has_come(), "opening the file fetched none of it");
    assert!(raster.not_yet() > before);
    server.fail(Fault::None, 0);
    wait_until("what is no hole that stays", has_come);
}

#[test]
fn of_a_large_classic_variable_what_is_touched_is_fetched() {
    let height = |column: u32, row: u32| (column * 7 % 1000) as f32 + 0.25 * (row % 400) as f32;
    let folder = tempfile::tempdir().expect("a folder");
    let bytes = classic(height);
    std::fs::write(folder.path().join("large.nc"), &bytes).expect("written");
    let server = Server::of(folder.path());
    let raster = Raster::open(server.url("large.nc"), &windows()).expect("opens");
    assert!(3 * server.seen().1 < bytes.len(), "{:?}", server.seen());
    let wanted = |column: u32, row: u32| f64::from(height(column, SIDE - 1 - row));
    for place in [(0, 0), (700, 777), (SIDE - 1, SIDE - 1)] {
        assert_eq!(raster.height(place.0, place.1), wanted(place.0, place.1));
    }
    let places = [57, 68, 797, 808, 1470].map(|row| (SIDE - 1, row));
    comes_late(&server, &raster, &places, wanted);
}

#[test]
fn of_many_chunks_those_that_are_touched_are_fetched() {
    const COLUMNS: u32 = 20_000;
    const ROWS: u32 = 40;
    let folder = tempfile::tempdir().expect("a folder");
    let packed = std::fs::File::open(data().join("long.nc.gz")).expect("there");
    let mut file = std::fs::File::create(folder.path().join("long.nc")).expect("made");
    let size = std::io::copy(&mut flate2::read::GzDecoder::new(packed), &mut file);
    let server = Server::of(folder.path());
    let raster = Raster::open(server.url("long.nc"), &windows()).expect("opens");
    let size = size.expect("unpacked") as usize;
    assert!(3 * server.seen().1 < 2 * size, "{:?}", server.seen());
    let wanted = |column: u32, row: u32| f64::from(column / 50 + 3 * (ROWS - 1 - row));
    let every_chunk: Vec<_> = (0..COLUMNS)
        .step_by(500)
        .map(|column| (column, 7))
        .collect();
    comes_late(&server, &raster, &every_chunk, wanted);
}
