//! The compressions of HDF5's registry that `hdf5-reader` leaves to others.

use std::io::Read;

use hdf5_reader::FilterRegistry;
use hdf5_reader::error::Error;

/// Zstandard's number in HDF5's registry of filters.
const ZSTD: u16 = 32015;

/// The filters of `hdf5-reader` and Zstandard. No chunk is unpacked past so many bytes, whatever
/// it says; `hdf5-reader` has the same limit.
pub(super) fn with_zstd(largest_chunk: usize) -> FilterRegistry {
    let mut filters = FilterRegistry::new();
    filters.register(
        ZSTD,
        Box::new(move |_, packed, _| unpack(packed, largest_chunk)),
    );
    filters
}

fn unpack(packed: &[u8], largest: usize) -> Result<Vec<u8>, Error> {
    let decoder = ruzstd::decoding::StreamingDecoder::new(packed)
        .map_err(|error| Error::DecompressionError(format!("Zstandard: {error}")))?;
    let mut bytes = Vec::new();
    decoder
        .take(largest as u64 + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| Error::DecompressionError(format!("Zstandard: {error}")))?;
    if bytes.len() > largest {
        let what = format!("Zstandard: a chunk of more than {largest} bytes");
        return Err(Error::DecompressionError(what));
    }
    Ok(bytes)
}
