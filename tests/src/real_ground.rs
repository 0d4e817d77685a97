//! Files of real ground that several tests slide over.

use hapterra::terrain::{HapticCells, HapticGrid, Terrain};
use heightfield::{OpenOptions, Raster};

use crate::shared;

/// Three of them by name: mountains, a volcano with sharp ridges, a city. None where they are
/// not on this machine, with a message.
///
/// # Panics
/// When one of them does not open.
#[must_use]
pub fn files() -> Vec<(&'static str, Raster)> {
    named(&[
        "mt_rainier_90m.tif",
        "SainteHelens.dem",
        "LisbonElevation.tif",
    ])
}

/// Five of them, a city seen by lidar among them; none where they are not on this machine.
///
/// # Panics
/// When one of them does not open.
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

/// All of them that open, by their names' order. None where they are not on this machine, which
/// is reported, as is a file that does not open.
///
/// # Panics
/// When their folder cannot be read.
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

/// A raster true to scale, a cell a millimetre.
///
/// # Panics
/// When it cannot be rendered so.
#[must_use]
pub fn terrain(raster: &Raster) -> Terrain<'_> {
    let grid = HapticGrid::new(raster, HapticCells::Square);
    let scale = grid.true_scale(1.0).expect("scale");
    Terrain::over(grid, scale, 0).expect("terrain")
}
