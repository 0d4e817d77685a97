//! Many files as one terrain: a folder, or a pattern of names.
//!
//! The header of each file is read (`index`), and the files have to share a grid (`grid`). Each is
//! a source (`source`): which samples of the terrain it has. A block of the terrain (`reader`,
//! behind [`super::blocks`]) is filled from the last source to the first. Files are opened when
//! they are touched, and few at once (`pool`).
//!
//! Layers beside heights, as masks and counts of scenes, are left out (`layers`). Files that overlap
//! and differ there are reported, and refused where they lie on the same samples (`overlaps`).
//!
//! A place without a height in any file is no-data. So is a file that cannot be read, with a warning:
//! one bad file of thousands does not make the terrain unusable.
//!
//! Level *L* has every 2ᴸ-th sample, as of a raster in memory; of a file that has overviews
//! it has those.

mod grid;
mod index;
mod layers;
mod names;
mod overlaps;
mod pool;
mod reader;
mod source;
#[cfg(test)]
mod tests;
mod tile_file;

use std::path::{Path, PathBuf};

use super::formats::gdal;
use super::{Decoded, OpenOptions, RasterError, beside};
use crate::remote::is_url;
pub(super) use names::named;

/// The terrain of the files that a path stands for.
pub(super) fn of_files(files: Vec<PathBuf>, options: &OpenOptions) -> Result<Decoded, RasterError> {
    if options.raw.is_some() {
        return Err(RasterError::NoPlace(
            "raw samples do not say where they lie, so that many files of them are no terrain"
                .into(),
        ));
    }
    let (files, layers) = layers::split_by_name(files);
    let mut decoded = index::decoded(files, options)?;
    decoded.remarks.extend(layers::left_out(&layers));
    Ok(decoded)
}

/// The files of a terrain, and those beside them, that are read: a file and those that it names as
/// a VRT, or all files of a folder or pattern.
#[must_use]
pub fn files_read_with(path: &Path) -> Vec<PathBuf> {
    if path.to_str().is_some_and(is_url) {
        // Nothing is written there.
        return Vec::new();
    }
    let files = match named(path) {
        Ok(Some(files)) => files,
        _ => std::iter::once(path.to_owned())
            .chain(gdal::files_read_with(path))
            .collect(),
    };
    let each = files.iter().flat_map(|file| beside::files_read_with(file));
    let mut each: Vec<_> = each.collect();
    each.sort();
    each.dedup();
    each
}
