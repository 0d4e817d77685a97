//! Esri ASCII grids: a header of keys, then numbers in any layout of white space.

mod header;
mod tokens;
mod values;

#[cfg(test)]
mod tests;

use super::input::Input;
use super::{CellSize, Decoded, Fault};
use header::Header;
use tokens::Tokens;

pub(super) use header::looks_like_header;

/// Reads a grid. Every sample takes at least a digit and a separator, so the
/// file's length bounds what is allocated whatever its header says.
pub(super) fn decode(input: &Input) -> Result<Decoded, Fault> {
    let mut tokens = Tokens::new(input.reader()?);
    let header = Header::read(&mut tokens)?;
    let (columns, rows) = header.size()?;
    let samples = values::read(&mut tokens, &header, columns, rows, input.len())?;
    let format = format!("Esri ASCII grid, {}", samples.type_name());
    let mut decoded = Decoded::new(format, columns, rows, samples);
    decoded.no_data = Some(header.no_data());
    let (east, north) = header.cell()?;
    let extent = (east * f64::from(columns), north * f64::from(rows));
    decoded.cell = Some(CellSize::guessed((east, north), header.corner(), extent));
    Ok(decoded)
}
