//! Samples from bytes, for all formats with plain samples.

use half::f16;

use super::RasterError;
use super::samples::{Endian, SampleType, SampleValue, Samples, with_samples};

/// The type of a sample in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StoredType {
    /// A type that is also used in memory.
    Held(SampleType),
    /// Half floats, single floats in memory.
    F16,
    /// 64-bit integers, double floats in memory (exact to 2^53).
    I64,
    /// As `I64`, unsigned.
    U64,
}

impl StoredType {
    /// Returns the bytes of a sample in the file.
    pub(super) const fn bytes(self) -> u64 {
        match self {
            Self::Held(sample) => sample.bytes(),
            Self::F16 => 2,
            Self::I64 | Self::U64 => 8,
        }
    }

    /// Returns the type of the samples in memory.
    pub(super) const fn memory_type(self) -> SampleType {
        match self {
            Self::Held(sample) => sample,
            Self::F16 => SampleType::F32,
            Self::I64 | Self::U64 => SampleType::F64,
        }
    }

    /// Returns an empty vector with capacity for `count` samples; the caller has checked that the
    /// file contains them.
    pub(super) fn reserve(self, count: u64) -> Result<Samples, RasterError> {
        let mut samples = self.memory_type().none();
        let reserved = usize::try_from(count).ok().and_then(
            |count| with_samples!(&mut samples, values => values.try_reserve_exact(count).ok()),
        );
        reserved.ok_or_else(|| {
            RasterError::AbsurdSize(format!("{count} samples do not fit into memory"))
        })?;
        Ok(samples)
    }

    /// Appends the samples in `bytes`, which are `stride` bytes apart, to `samples` from
    /// [`StoredType::reserve`].
    pub(super) fn append(self, samples: &mut Samples, bytes: &[u8], stride: usize, endian: Endian) {
        let each = || bytes.chunks(stride);
        match (self, samples) {
            (Self::F16, Samples::F32(values)) => {
                values
                    .extend(each().map(|bytes| {
                        f16::from_bits(u16::from_bytes(&bytes[..2], endian)).to_f32()
                    }));
            }
            (Self::I64, Samples::F64(values)) => {
                values.extend(
                    each().map(|bytes| i64::from_le_bytes(to_little_endian(bytes, endian)) as f64),
                );
            }
            (Self::U64, Samples::F64(values)) => {
                values.extend(
                    each().map(|bytes| u64::from_le_bytes(to_little_endian(bytes, endian)) as f64),
                );
            }
            (_, samples) => with_samples!(samples, values => extend(values, each(), endian)),
        }
    }
}

fn extend<'b, T: SampleValue>(
    values: &mut Vec<T>,
    stored: impl Iterator<Item = &'b [u8]>,
    endian: Endian,
) {
    values.extend(stored.map(|bytes| T::from_bytes(&bytes[..size_of::<T>()], endian)));
}

/// Returns the first eight bytes, least significant first.
fn to_little_endian(bytes: &[u8], endian: Endian) -> [u8; 8] {
    let mut eight: [u8; 8] = bytes[..8].try_into().unwrap_or_default();
    if endian == Endian::Big {
        eight.reverse();
    }
    eight
}
