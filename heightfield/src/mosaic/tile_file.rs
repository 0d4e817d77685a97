//! One file of many: opened alone, whatever its format, but no terrain of many files itself.

use std::path::Path;

use super::super::input::FileBytes;
use super::super::one_file;
use super::super::{BadRaster, Decoded, OpenOptions};
use super::VRT;
use super::vrt::xml::is_vrt;

/// Decodes one file of many.
pub(super) fn decode(path: &Path, options: &OpenOptions) -> Result<Decoded, BadRaster> {
    one_file::decode(&open(path, options)?, options)
}

/// What the header of one file of many says. A format that has no short way there
/// decodes the whole file.
pub(super) fn outline(path: &Path, options: &OpenOptions) -> Result<Decoded, BadRaster> {
    one_file::decode(&open(path, options)?.in_outline(true), options)
}

/// A VRT of VRTs might never end.
fn open(path: &Path, options: &OpenOptions) -> Result<FileBytes, BadRaster> {
    let input = FileBytes::open(path, &options.elsewhere)?;
    match is_vrt(&input)? {
        true => Err(BadRaster::Unsupported {
            format: VRT,
            feature: "a VRT among the files of another terrain".into(),
        }),
        false => Ok(input),
    }
}
