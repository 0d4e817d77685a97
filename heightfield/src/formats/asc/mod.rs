//! Esri ASCII grids: a header of keys, then numbers separated by any white space.

mod header;
mod tokens;
mod values;

#[cfg(test)]
mod tests;

use crate::decoded::Decoded;
use crate::format::{Claim, Format, Parts};
use crate::ground_map::GroundMap;
use crate::input::FileBytes;
use crate::numbers::beginning;
use crate::{CellSize, RasterError, SampleType, beside};
use header::{Header, is_header};
use tokens::Tokens;

/// Esri ASCII grids.
pub(super) const FORMAT: Format = Format {
    name: "Esri ASCII",
    begins: is_header,
    extensions: &[("asc", Claim::Certain), ("txt", Claim::Possible)],
    parts: Parts::One,
    decode: |input, _| decode(input),
};

/// Reads a grid. Every sample takes at least a digit and a separator, so the file's length bounds
/// the allocation whatever the header states.
fn decode(input: &FileBytes) -> Result<Decoded, RasterError> {
    let mut tokens = Tokens::new(input.reader()?);
    let header = Header::read(&mut tokens)?;
    let (columns, rows) = header.size()?;
    let samples = match input.is_outline() {
        // The type depends on the numbers, which are not read for an outline; `f32` is enough for
        // heights.
        true => SampleType::F32.none(),
        false => values::read(&mut tokens, &header, columns, rows, input.len())?,
    };
    let format = format!("Esri ASCII grid, {}", samples.type_name());
    let mut decoded = Decoded::new(format, (columns, rows), samples);
    decoded.no_data = Some(header.no_data());
    if let Some(word) = &header.no_data_word {
        let word = beginning(word);
        decoded.remarks.push(format!(
            "its no-data value is the text '{word}', which is no number: samples with this text count as no data, and those of {}",
            header.no_data()
        ));
    }
    let (east, north) = header.cell()?;
    beside::reference_system(input, &mut decoded)?;
    match header.south_west((east, north)) {
        Some(corner) => {
            let map = GroundMap::from_south_west(corner, (east, north), rows);
            let map = map.ok_or_else(|| RasterError::damaged("its header places it nowhere"))?;
            decoded.set_layout(map, None);
        }
        None => {
            let extent = (east * f64::from(columns), north * f64::from(rows));
            decoded.cell = Some(CellSize::guessed((east, north), None, extent));
        }
    }
    Ok(decoded)
}
