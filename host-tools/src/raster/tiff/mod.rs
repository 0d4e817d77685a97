//! TIFF, GeoTIFF, BigTIFF and cloud-optimised GeoTIFF: the first band of the
//! first full image.

mod budget;
mod chunks;
mod directory;
mod field;
mod georef;
mod layout;
mod mask;
mod metadata;

use tiff::decoder::Decoder;
use tiff::tags::Tag;
use tiff::{TiffError, TiffFormatError};

use super::input::Input;
use super::{Decoded, Fault};
use layout::Layout;
use metadata::Metadata;

/// Reads the heights: of several bands the first, of several images the first
/// that is neither an overview nor a mask.
pub(super) fn decode(input: &Input) -> Result<Decoded, Fault> {
    let directories = directory::sound(&mut input.reader()?, input.len())?;
    let mut decoder = Decoder::new(input.reader()?).map_err(fault)?;
    skip_to_full_image(&mut decoder, directories)?;
    let layout = Layout::read(&mut decoder)?;
    budget::check(&layout, input.len())?;
    let (samples, mask) = chunks::read(&mut decoder, &layout)?;
    let mut decoded = Decoded::new(layout.described(), layout.columns, layout.rows, samples);
    decoded.mask = mask;
    mask::apply(input, directories, &mut decoded)?;
    if layout.bands > 1 {
        decoded.remarks.push(format!(
            "it has {} bands: the first is taken for the height",
            layout.bands
        ));
    }
    let metadata = Metadata::read(&mut decoder)?;
    decoded.no_data = metadata.no_data;
    decoded.scale = metadata.scale.unwrap_or(1.0);
    decoded.offset = metadata.offset.unwrap_or(0.0);
    georef::apply(&mut decoder, &mut decoded);
    decoded.metres_per_vertical_unit = metadata
        .metres_per_vertical_unit
        .or(decoded.metres_per_vertical_unit);
    Ok(decoded)
}

/// Bits of the tag that says what an image is in its file.
const REDUCED: u32 = 1;
const MASK: u32 = 4;

fn skip_to_full_image<R: std::io::Read + std::io::Seek>(
    decoder: &mut Decoder<R>,
    directories: usize,
) -> Result<(), Fault> {
    for left in (0..directories).rev() {
        let kind = decoder
            .find_tag_unsigned::<u32>(Tag::NewSubfileType)
            .ok()
            .flatten()
            .unwrap_or(0);
        if kind & (REDUCED | MASK) == 0 || left == 0 || !decoder.more_images() {
            return Ok(());
        }
        decoder.next_image().map_err(fault)?;
    }
    Ok(())
}

/// What the decoder's error says to the user.
fn fault(error: TiffError) -> Fault {
    match error {
        TiffError::IoError(error) => Fault::from_io(error, "the image"),
        TiffError::UnsupportedError(error) => Fault::Unsupported {
            format: "TIFF",
            feature: format!("this variant ({error})"),
        },
        TiffError::LimitsExceeded => {
            Fault::AbsurdSize("TIFF: a list of more entries than any image needs".into())
        }
        TiffError::IntSizeError => Fault::damaged("TIFF: a number in its header is out of range"),
        TiffError::FormatError(TiffFormatError::InvalidDimensions(columns, rows)) => {
            Fault::damaged(format!("TIFF: an image of {columns} × {rows}"))
        }
        error => Fault::Damaged(format!("TIFF: {error}")),
    }
}

#[cfg(test)]
mod tests;
