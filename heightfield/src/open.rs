//! From a path to decoded samples: tells many files from one.

use std::path::{Path, PathBuf};

use super::formats::gdal;
use super::guard::guarded;
use super::input::FileBytes;
use super::one_file::{self, or_by_gdal};
use super::{BadRaster, Decoded, OpenOptions, mosaic};

/// Decodes a terrain: a file, which may be packed, or many that are one.
pub(super) fn decode(path: &Path, options: &OpenOptions) -> Result<Decoded, BadRaster> {
    if let Some(files) = mosaic::named(path)? {
        return match decode_all(&files, options) {
            // Some formats are folders.
            Err(fault @ BadRaster::NoTiles(_)) if options.gdal => {
                gdal::decode(path, options)?.ok_or(fault)
            }
            decoded => decoded,
        };
    }
    let input = FileBytes::open(path, &options.elsewhere)?;
    if options.raw.is_none() && mosaic::is_json(&input)? {
        return mosaic::of_stac(&input, path, options);
    }
    check_no_asset(options, "a file")?;
    if options.raw.is_none() && mosaic::is_vrt(&input)? {
        let decoded = guarded(mosaic::VRT, || mosaic::of_vrt(&input, path, options));
        return or_by_gdal(decoded, &input, options);
    }
    one_file::decode(&input, options)
}

/// Decodes files as one terrain.
pub(super) fn decode_all(files: &[PathBuf], options: &OpenOptions) -> Result<Decoded, BadRaster> {
    check_no_asset(options, "many files")?;
    if files.is_empty() {
        return Err(BadRaster::NoTiles("no file is named".into()));
    }
    mosaic::of_files(files.to_vec(), options)
}

/// Checks that no asset is asked for of what has none.
fn check_no_asset(options: &OpenOptions, of: &str) -> Result<(), BadRaster> {
    match &options.asset {
        None => Ok(()),
        Some(asset) => Err(BadRaster::NoSuchPart {
            asked: format!("asset {asset}"),
            there: format!("only a STAC has assets, and this is {of}"),
        }),
    }
}

/// Decodes a file by GDAL alone.
pub(super) fn decode_by_gdal(path: &Path, options: &OpenOptions) -> Result<Decoded, BadRaster> {
    gdal::decode(path, options)?.ok_or(BadRaster::UnknownFormat)
}
