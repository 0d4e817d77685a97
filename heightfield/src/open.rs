//! From a path to decoded samples: separates single files from many.

use std::path::{Path, PathBuf};

use super::formats::gdal;
use super::input::FileBytes;
use super::{Decoded, OpenOptions, RasterError, mosaic, one_file};

/// Decodes a terrain: a file, or many files as one.
pub(super) fn decode(path: &Path, options: &OpenOptions) -> Result<Decoded, RasterError> {
    if let Some(files) = mosaic::named(path).transpose() {
        return match files.and_then(|files| decode_all(&files, options)) {
            // Some formats are folders.
            Err(fault @ RasterError::NoTiles(_)) if options.gdal && path.is_dir() => {
                match gdal::decode(path, options) {
                    Err(RasterError::UnknownFormat) => Err(fault),
                    decoded => decoded,
                }
            }
            decoded => decoded,
        };
    }
    one_file::decode(&FileBytes::open(path, &options.fetcher)?, options)
}

/// Decodes files as one terrain.
pub(super) fn decode_all(files: &[PathBuf], options: &OpenOptions) -> Result<Decoded, RasterError> {
    if files.is_empty() {
        return Err(RasterError::NoTiles("no file is named".into()));
    }
    mosaic::of_files(files.to_vec(), options)
}

/// Decodes a file with GDAL only.
pub(super) fn decode_by_gdal(path: &Path, options: &OpenOptions) -> Result<Decoded, RasterError> {
    gdal::decode(path, options)
}
