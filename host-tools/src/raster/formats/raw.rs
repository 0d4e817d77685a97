//! Raw samples with a stated layout.

use crate::raster::decoded::Decoded;
use crate::raster::input::FileBytes;
use crate::raster::plain::Plain;
use crate::raster::read::Stored;
use crate::raster::{BadRaster, OpenOptions, RawLayout};

/// Extensions of files that are nothing but samples.
pub(in crate::raster) const EXTENSIONS: [&str; 4] = ["raw", "bin", "r16", "r32"];

/// Reads `columns × rows` samples, north row first; the file must hold exactly
/// those.
pub(in crate::raster) fn decode(
    input: &FileBytes,
    layout: RawLayout,
    options: &OpenOptions,
) -> Result<Decoded, BadRaster> {
    let (columns, rows) = (layout.columns, layout.rows);
    let (samples, bytes) = (u64::from(columns) * u64::from(rows), layout.sample.bytes());
    let promised = samples
        .checked_mul(bytes)
        .ok_or_else(|| BadRaster::AbsurdSize(format!("{columns} × {rows}")))?;
    let what = format!(
        "{columns} × {rows} samples of {bytes} bytes are {promised} bytes, the file has {}",
        input.len()
    );
    if input.len() < promised {
        return Err(BadRaster::Truncated(what));
    }
    if input.len() > promised {
        return Err(BadRaster::damaged(format!(
            "the stated size is not its size: {what}"
        )));
    }
    let stored = Stored::Held(layout.sample);
    let plain = Plain::packed((columns, rows), stored, layout.endian, 0);
    let format = format!("raw {}", layout.sample.none().type_name());
    let storage = plain.storage(input, options)?;
    Ok(Decoded::new(format, (columns, rows), storage))
}
