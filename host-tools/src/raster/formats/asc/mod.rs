//! Esri ASCII grids: a header of keys, then numbers in any layout of white space.

mod header;
mod tokens;
mod values;

#[cfg(test)]
mod tests;

use crate::raster::decoded::Decoded;
use crate::raster::format::{Claim, Format};
use crate::raster::input::FileBytes;
use crate::raster::{BadRaster, CellSize, GroundTransform};
use header::{Header, looks_like_header};
use tokens::Tokens;

/// Esri ASCII grids.
pub(super) const FORMAT: Format = Format {
    name: "Esri ASCII",
    begins: looks_like_header,
    extensions: &[("asc", Claim::Decides), ("txt", Claim::Suggests)],
    decode: |input, _| decode(input),
};

/// Reads a grid. Every sample takes at least a digit and a separator, so the
/// file's length bounds what is allocated whatever its header says.
fn decode(input: &FileBytes) -> Result<Decoded, BadRaster> {
    let mut tokens = Tokens::new(input.reader()?);
    let header = Header::read(&mut tokens)?;
    let (columns, rows) = header.size()?;
    let samples = values::read(&mut tokens, &header, columns, rows, input.len())?;
    let format = format!("Esri ASCII grid, {}", samples.type_name());
    let mut decoded = Decoded::new(format, (columns, rows), samples);
    decoded.no_data = Some(header.no_data());
    let (east, north) = header.cell()?;
    // The file's first row is the northernmost.
    decoded.ground = header
        .first_centre((east, north))
        .and_then(|[west, south]| {
            let north_row = south + north * (f64::from(rows) - 1.0);
            GroundTransform::new([west, north_row], [east, 0.0], [0.0, -north])
        });
    let extent = (east * f64::from(columns), north * f64::from(rows));
    decoded.cell = Some(CellSize::guessed((east, north), header.corner(), extent));
    Ok(decoded)
}
