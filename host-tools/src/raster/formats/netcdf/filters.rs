//! The compressions of HDF5's registry that `hdf5-reader` leaves to others.

use std::io::Read;

use hdf5_reader::FilterRegistry;
use hdf5_reader::error::Error;

/// Zstandard's number in HDF5's registry of filters.
const ZSTD: u16 = 32015;
/// No chunk is unpacked past this, whatever it says; `hdf5-reader` has the same limit.
const LARGEST_CHUNK: u64 = hdf5_reader::DEFAULT_MAX_CHUNK_BYTES as u64;

/// The filters of `hdf5-reader` and Zstandard.
pub(super) fn with_zstd() -> FilterRegistry {
    let mut filters = FilterRegistry::new();
    filters.register(ZSTD, Box::new(|_, packed, _| unpack(packed)));
    filters
}

fn unpack(packed: &[u8]) -> Result<Vec<u8>, Error> {
    let decoder = ruzstd::decoding::StreamingDecoder::new(packed)
        .map_err(|error| Error::DecompressionError(format!("Zstandard: {error}")))?;
    let mut bytes = Vec::new();
    decoder
        .take(LARGEST_CHUNK + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| Error::DecompressionError(format!("Zstandard: {error}")))?;
    if bytes.len() as u64 > LARGEST_CHUNK {
        let what = format!("Zstandard: a chunk of more than {LARGEST_CHUNK} bytes");
        return Err(Error::DecompressionError(what));
    }
    Ok(bytes)
}
