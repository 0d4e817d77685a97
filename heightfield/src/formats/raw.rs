//! Raw samples with a stated layout.

use crate::decoded::Decoded;
use crate::input::FileBytes;
use crate::raw_samples::RawSamples;
use crate::read::StoredType;
use crate::{OpenOptions, RasterError, RawLayout};

/// Extensions of files with samples only.
pub(crate) const EXTENSIONS: [&str; 4] = ["raw", "bin", "r16", "r32"];

/// Reads `columns × rows` samples, north row first; the file must contain exactly these.
pub(crate) fn decode(
    input: &FileBytes,
    layout: RawLayout,
    options: &OpenOptions,
) -> Result<Decoded, RasterError> {
    let (columns, rows) = (layout.columns, layout.rows);
    let (samples, bytes) = (u64::from(columns) * u64::from(rows), layout.sample.bytes());
    let stated = samples
        .checked_mul(bytes)
        .ok_or_else(|| RasterError::AbsurdSize(format!("{columns} × {rows}")))?;
    let what = format!(
        "{columns} × {rows} samples of {bytes} bytes are {stated} bytes, the file has {}",
        input.len()
    );
    if input.len() < stated {
        return Err(RasterError::Truncated(what));
    }
    if input.len() > stated {
        return Err(RasterError::damaged(format!(
            "the stated size is not its size: {what}"
        )));
    }
    let stored = StoredType::Held(layout.sample);
    let plain = RawSamples::packed((columns, rows), stored, layout.endian, 0);
    let format = format!("raw {}", layout.sample.none().type_name());
    let storage = plain.storage(input, options)?;
    Ok(Decoded::new(format, (columns, rows), storage))
}
