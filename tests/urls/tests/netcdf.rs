//! NetCDF files at URLs: every way of storing a variable is the same as on disk, in windows,
//! and of a large variable what is touched is fetched.

use std::path::{Path, PathBuf};

use hapterra::raster::{OpenOptions, Raster};
use hapterra_url_tests::http::{Fault, Server};

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

/// What a server does not hand over for a while comes later, and is no hole that stays.
#[test]
fn a_chunk_that_has_not_come_is_no_hole() {
    let server = Server::of(&data());
    let here = Raster::open(data().join("fixed_array.nc"), &OpenOptions::default());
    let there = Raster::open(server.url("fixed_array.nc"), &windows());
    let (here, there) = (here.expect("opens"), there.expect("opens"));
    there.stop_waiting();
    server.fail(Fault::Error500, usize::MAX);
    let (column, row) = (here.columns() - 1, here.rows() - 1);
    let before = there.not_yet();
    let first = there.height(column, row);
    // The file is small: what opening it fetched may hold the chunk.
    assert!(there.not_yet() > before || first == here.height(column, row));
    server.fail(Fault::None, 0);
    let comes = (0..2000).find(|_| {
        std::thread::sleep(std::time::Duration::from_millis(5));
        there.height(column, row) == here.height(column, row)
    });
    assert!(comes.is_some(), "it comes");
}
