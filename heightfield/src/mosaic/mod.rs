//! Many files as one terrain: a folder, a pattern of names, a GDAL VRT, or items of a STAC.
//!
//! Of a folder or pattern (`names`) the header of each file is read (`index`), and the files
//! have to share a grid (`grid`). A STAC (`stac`) says what the headers would. A VRT is an index itself (`vrt`). Each gives a list of
//! sources (`source`): which samples of the terrain a file has, and how they follow from its
//! own. A block of the terrain (`reader`, behind [`super::blocks`]) is filled from the last source to the
//! first. Files are opened when they are touched, and few at once (`pool`).
//!
//! Where no file has a height there is a hole. A file that cannot be read is one, too, with
//! a warning: one bad file of thousands is no reason to feel nothing.
//!
//! Level *L* has every 2ᴸ-th sample, as of a raster in memory; of a file that has overviews
//! it has those.

mod grid;
mod index;
mod names;
mod pool;
mod reader;
mod source;
mod stac;
#[cfg(test)]
mod tests;
mod tile_file;
mod vrt;

use std::path::{Path, PathBuf};

use super::input::FileBytes;
use super::{BadRaster, Decoded, OpenOptions, beside};
use crate::remote::{Elsewhere, is_url};
pub(super) use names::named;
pub(super) use stac::{decode as of_stac, is_json};
pub(super) use vrt::decode as of_vrt;
pub(super) use vrt::xml::is_vrt;

/// Name of GDAL's format in messages.
pub(super) const VRT: &str = "VRT";

/// The terrain of the files that a path stands for.
pub(super) fn of_files(files: Vec<PathBuf>, options: &OpenOptions) -> Result<Decoded, BadRaster> {
    if options.raw.is_some() {
        return Err(BadRaster::NoPlace(
            "raw samples do not say where they lie, so that many files of them are no terrain"
                .into(),
        ));
    }
    index::decoded(files.into_iter().map(index::File::from).collect(), options)
}

/// The files of a terrain, and those beside them, that are read: a file, all files of a folder
/// or pattern, a VRT and its sources, or a STAC and its items.
#[must_use]
pub fn files_read_with(path: &Path) -> Vec<PathBuf> {
    let with_neighbours = |files: Vec<PathBuf>| {
        let each = files.iter().flat_map(|file| beside::files_read_with(file));
        each.collect()
    };
    if path.to_str().is_some_and(is_url) {
        // Nothing is written there.
        return Vec::new();
    }
    if let Ok(Some(files)) = named(path) {
        return with_neighbours(files);
    }
    let input = FileBytes::open(path, &Elsewhere::default());
    let sources = input.and_then(|input| match () {
        () if is_vrt(&input)? => vrt::sources(&input, path),
        () if is_json(&input)? => stac::sources(&input, path),
        () => Ok(Vec::new()),
    });
    let mut files = beside::files_read_with(path);
    files.extend(with_neighbours(sources.unwrap_or_default()));
    files
}
