//! Samples from bytes, for all formats that store them plainly.

use std::io::Read;

use super::BadRaster;
use super::samples::{Endian, SampleType, SampleValue, Samples, with_samples};

/// Reads `count` samples; the caller has checked that the file holds them.
///
/// # Errors
/// When the reader ends or fails before.
pub(super) fn read_samples(
    reader: &mut dyn Read,
    count: u64,
    sample: SampleType,
    endian: Endian,
) -> Result<Samples, BadRaster> {
    with_samples!(sample.none(), none => Ok(fill(none, reader, count, endian)?.into()))
}

fn fill<T: SampleValue>(
    mut values: Vec<T>,
    reader: &mut dyn Read,
    count: u64,
    endian: Endian,
) -> Result<Vec<T>, BadRaster> {
    const SAMPLES_AT_ONCE: usize = 8192;
    let mut left =
        usize::try_from(count).map_err(|_| BadRaster::AbsurdSize(format!("{count} samples")))?;
    values.reserve_exact(left);
    let mut buffer = vec![0; size_of::<T>() * SAMPLES_AT_ONCE];
    while left > 0 {
        let now = left.min(SAMPLES_AT_ONCE);
        let bytes = &mut buffer[..now * size_of::<T>()];
        reader
            .read_exact(bytes)
            .map_err(|error| BadRaster::from_io(error, "the samples"))?;
        let stored = bytes.chunks_exact(size_of::<T>());
        values.extend(stored.map(|bytes| T::from_bytes(bytes, endian)));
        left -= now;
    }
    Ok(values)
}
