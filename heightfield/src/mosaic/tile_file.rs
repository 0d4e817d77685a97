//! One file of many: opened alone, in any format.

use std::path::Path;

use super::super::input::FileBytes;
use super::super::one_file;
use super::super::{Decoded, OpenOptions, RasterError};

/// Decodes one file of many.
pub(super) fn decode(path: &Path, options: &OpenOptions) -> Result<Decoded, RasterError> {
    one_file::decode(&FileBytes::open(path, &options.fetcher)?, options)
}

/// Reads the header of one file of many. Some formats decode the whole file for that.
pub(super) fn outline(path: &Path, options: &OpenOptions) -> Result<Decoded, RasterError> {
    let input = FileBytes::open(path, &options.fetcher)?;
    one_file::decode(&input.with_outline(true), options)
}
