//! Files of real ground for several tests.

use hapterra::terrain::{HapticCells, HapticGrid, Terrain};
use heightfield::{OpenOptions, Raster};

use crate::shared;

/// Returns three of them by name: mountains, a volcano with sharp ridges, a city. Returns none,
/// with a message, if they are not on this machine.
///
/// # Panics
/// If one of them does not open.
#[must_use]
pub fn files() -> Vec<(&'static str, Raster)> {
    named(&[
        "mt_rainier_90m.tif",
        "SainteHelens.dem",
        "LisbonElevation.tif",
    ])
}

/// Returns five of them, with a lidar scan of a city; none if they are not on this machine.
///
/// # Panics
/// If one of them does not open.
#[must_use]
pub fn more_files() -> Vec<(&'static str, Raster)> {
    named(&[
        "mt_rainier_90m.tif",
        "mt_everest_90m.tif",
        "bigtujunga.tif",
        "LisbonElevation.tif",
        "dom1_32_356_5699_1_nw_2020.tif",
    ])
}

fn named(names: &[&'static str]) -> Vec<(&'static str, Raster)> {
    let paths = names
        .iter()
        .map(|name| (*name, shared(&format!("dem/real/{name}"))));
    let there = paths.filter_map(|(name, path)| Some((name, path?)));
    let open = |path| Raster::open(path, &OpenOptions::default()).expect("opens");
    there.map(|(name, path)| (name, open(path))).collect()
}

/// Returns all that open, in the order of their names. Returns none if they are not on this
/// machine, which is reported, as is a file that does not open.
///
/// # Panics
/// If their folder cannot be read.
#[must_use]
pub fn all_files() -> Vec<(String, Raster)> {
    let folder = shared("dem/real");
    let entries = folder
        .iter()
        .flat_map(|folder| folder.read_dir().expect("a folder"));
    let mut paths: Vec<_> = entries
        .map(|entry| entry.expect("readable").path())
        .collect();
    paths.sort();
    let opened = paths.into_iter().filter_map(|path| {
        let name = path.file_name()?.to_string_lossy().into_owned();
        match Raster::open(&path, &OpenOptions::default()) {
            Ok(raster) => Some((name, raster)),
            Err(why) => {
                println!("{name} is left out: {why}");
                None
            }
        }
    });
    opened.collect()
}

/// Returns a raster true to scale, with cells of a millimetre.
///
/// # Panics
/// If it cannot be rendered at this scale.
#[must_use]
pub fn terrain(raster: &Raster) -> Terrain<'_> {
    let grid = HapticGrid::new(raster, HapticCells::Square);
    let scale = grid.true_scale(1.0).expect("scale");
    Terrain::over(grid, scale, 0).expect("terrain")
}
