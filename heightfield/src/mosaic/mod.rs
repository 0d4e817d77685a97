//! Many files as one terrain: a folder, or a pattern of names.
//!
//! The header of each file is read (`index`), and the files must share a grid (`grid`). Each is a
//! source (`source`) of certain samples of the terrain. A block of the terrain (`reader`, used by
//! [`super::blocks`]) is filled from the last source to the first. Files are opened on access, and
//! few at once (`pool`).
//!
//! Layers beside heights, such as masks and counts of scenes, are ignored (`layers`). Differences
//! between overlapping files are reported, or rejected if the files have the same samples
//! (`overlaps`).
//!
//! A position without a height in any file is no-data. So is a file that cannot be read, with a
//! warning: one bad file of thousands must not make the terrain unusable.
//!
//! Level *L* has every 2ᴸ-th sample, as for a raster in memory, or the overviews of files that have
//! them.

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

/// Returns the terrain of files.
pub(super) fn of_files(files: Vec<PathBuf>, options: &OpenOptions) -> Result<Decoded, RasterError> {
    if options.raw.is_some() {
        return Err(RasterError::NoPlace(
            "raw samples do not state their place, so several files of them are no terrain".into(),
        ));
    }
    let (files, layers) = layers::split_by_name(files);
    let mut decoded = index::decoded(files, options)?;
    decoded.remarks.extend(layers::remark_ignored(&layers));
    Ok(decoded)
}

/// Returns the files of a terrain that are read, with the files beside them: a file and those that
/// it references, as a VRT does, or all files of a folder or pattern.
#[must_use]
pub fn files_read_with(path: &Path) -> Vec<PathBuf> {
    if path.to_str().is_some_and(is_url) {
        // No output is written to a server.
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
