//! A file at a URL as a source for `tiff-reader`.

use std::sync::Arc;

use tiff_reader::TiffError;
use tiff_reader::source::TiffSource;

use crate::remote::RemoteFile;

/// A file at a URL.
pub(super) struct RemoteSource(pub(super) Arc<RemoteFile>);

impl TiffSource for RemoteSource {
    fn len(&self) -> u64 {
        self.0.len()
    }

    fn read_exact_at(&self, offset: u64, len: usize) -> Result<Vec<u8>, TiffError> {
        let read = self.0.read_at(offset, len);
        read.map_err(|error| TiffError::Io(error, String::new()))
    }
}
