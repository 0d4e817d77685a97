//! Raw samples with a stated layout.

use std::io::Read;

use super::input::Input;
use super::{Decoded, Endian, Fault, RawLayout, RawSample, Samples};

/// Reads `columns × rows` samples, north row first; the file must hold exactly
/// those.
pub(super) fn decode(input: &Input, layout: RawLayout) -> Result<Decoded, Fault> {
    let samples = u64::from(layout.columns) * u64::from(layout.rows);
    let promised = samples
        .checked_mul(layout.sample.bytes())
        .ok_or_else(|| Fault::AbsurdSize(format!("{} × {}", layout.columns, layout.rows)))?;
    let what = format!(
        "{} × {} samples of {} bytes are {promised} bytes, the file has {}",
        layout.columns,
        layout.rows,
        layout.sample.bytes(),
        input.len()
    );
    if input.len() < promised {
        return Err(Fault::Truncated(what));
    }
    if input.len() > promised {
        return Err(Fault::damaged(format!(
            "the stated size is not its size: {what}"
        )));
    }
    let reader = &mut *input.reader()?;
    let samples = read_samples(reader, samples, layout.sample, layout.endian)?;
    let format = format!("raw {}", samples.type_name());
    Ok(Decoded::new(format, layout.columns, layout.rows, samples))
}

impl RawSample {
    /// Bytes a sample takes.
    pub(super) fn bytes(self) -> u64 {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// Reads `count` samples; the caller has checked that the file holds them.
pub(super) fn read_samples(
    reader: &mut dyn Read,
    count: u64,
    sample: RawSample,
    endian: Endian,
) -> Result<Samples, Fault> {
    macro_rules! read_as {
        ($variant:ident, $type:ty) => {
            Samples::$variant(read_converted(reader, count, |bytes| match endian {
                Endian::Little => <$type>::from_le_bytes(bytes),
                Endian::Big => <$type>::from_be_bytes(bytes),
            })?)
        };
    }
    Ok(match sample {
        RawSample::U8 => read_as!(U8, u8),
        RawSample::I8 => read_as!(I8, i8),
        RawSample::U16 => read_as!(U16, u16),
        RawSample::I16 => read_as!(I16, i16),
        RawSample::U32 => read_as!(U32, u32),
        RawSample::I32 => read_as!(I32, i32),
        RawSample::F32 => read_as!(F32, f32),
        RawSample::F64 => read_as!(F64, f64),
    })
}

fn read_converted<const N: usize, T>(
    reader: &mut dyn Read,
    count: u64,
    convert: impl Fn([u8; N]) -> T,
) -> Result<Vec<T>, Fault> {
    const SAMPLES_AT_ONCE: usize = 8192;
    let mut left =
        usize::try_from(count).map_err(|_| Fault::AbsurdSize(format!("{count} samples")))?;
    let mut values = Vec::with_capacity(left);
    let mut buffer = vec![0; N * SAMPLES_AT_ONCE];
    while left > 0 {
        let now = left.min(SAMPLES_AT_ONCE);
        let bytes = &mut buffer[..now * N];
        reader
            .read_exact(bytes)
            .map_err(|error| Fault::from_io(error, "the samples"))?;
        let (samples, _) = bytes.as_chunks::<N>();
        values.extend(samples.iter().map(|&sample| convert(sample)));
        left -= now;
    }
    Ok(values)
}
