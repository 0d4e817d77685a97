//! TIFF, GeoTIFF, BigTIFF and cloud-optimised GeoTIFF: the first band of the
//! first full image.
//!
//! `tiff-reader` decodes; it is named in this folder only.

mod budget;
mod fault;
mod georef;
mod images;
mod layout;
mod metadata;
mod samples;
mod user_defined;

use std::sync::Arc;

use tiff_reader::source::{BytesSource, FileSource, SharedSource};
use tiff_reader::{OpenOptions, ParseBudgets, TiffFile};

use crate::raster::BadRaster;
use crate::raster::beside::lay_out_by_world_file;
use crate::raster::decoded::Decoded;
use crate::raster::format::{Claim, Format, Parts, starts_with_any};
use crate::raster::input::{Data, FileBytes};
use fault::fault;
use layout::Layout;
use metadata::Metadata;

/// TIFF and BigTIFF of either byte order.
pub(super) const FORMAT: Format = Format {
    name: "TIFF",
    begins: |head| starts_with_any(head, &[b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"]),
    extensions: &[("tif", Claim::Promises), ("tiff", Claim::Promises)],
    parts: Parts::Bands,
    decode: |input, options| decode(input, options.band),
};

/// Extensions of a TIFF's world files.
const WORLD_FILES: [&str; 4] = ["tfw", "tifw", "tiffw", "tfwx"];

/// Reads the heights: of several bands the `asked` one (the first being 1) or the
/// first, of several images the first that is neither an overview nor a mask.
fn decode(input: &FileBytes, asked: Option<u32>) -> Result<Decoded, BadRaster> {
    let file = open(input)?;
    let image = images::full(&file)?;
    let layout = Layout::read(image, asked)?;
    budget::check(&layout, input.len())?;
    let samples = samples::read(&file, image, &layout, layout.band)?;
    let format = layout.described(file.byte_order());
    let mut decoded = Decoded::new(format, (layout.columns, layout.rows), samples);
    let beside = mask_beside(input)?;
    decoded.mask = samples::holes(&file, image, &layout, beside.as_ref())?;
    let meant = 1 + u16::from(layout.alpha.is_some());
    if asked.is_some() {
        decoded.format += &format!(", band {} of {}", layout.band + 1, layout.bands);
    } else if layout.bands > meant {
        decoded.remarks.push(format!(
            "it has {} bands: the first is taken for the height (--band)",
            layout.bands
        ));
    }
    let metadata = Metadata::read(image, layout.band)?;
    decoded.no_data = metadata.no_data;
    decoded.scale = metadata.scale.unwrap_or(1.0);
    decoded.offset = metadata.offset.unwrap_or(0.0);
    georef::apply(image, &mut decoded, metadata.metres_per_vertical_unit);
    if decoded.place.is_none() {
        lay_out_by_world_file(input, &WORLD_FILES, &mut decoded)?;
    }
    Ok(decoded)
}

/// The mask that GDAL keeps in a file of its own, `NAME.tif.msk`.
fn mask_beside(input: &FileBytes) -> Result<Option<TiffFile>, BadRaster> {
    let Data::File(_, path) = input.data() else {
        return Ok(None);
    };
    let mut mask = path.as_os_str().to_owned();
    mask.push(".msk");
    let mask = std::path::Path::new(&mask);
    match mask.is_file() {
        true => open(&FileBytes::open(mask)?).map(Some),
        false => Ok(None),
    }
}

/// Opens the file. No list in its directories may be longer than the file is.
fn open(input: &FileBytes) -> Result<TiffFile, BadRaster> {
    const LONGEST_LIST: usize = 32 << 20;
    let bytes = usize::try_from(input.len()).unwrap_or(usize::MAX);
    let options = OpenOptions {
        // Every block is read once.
        block_cache_bytes: 0,
        parse_budgets: ParseBudgets {
            max_ifds: 64,
            max_tag_value_bytes: bytes.min(LONGEST_LIST),
            ..ParseBudgets::default()
        },
        ..OpenOptions::default()
    };
    let source: SharedSource = match input.data() {
        Data::File(_, path) => Arc::new(FileSource::open(path).map_err(fault)?),
        Data::Memory(bytes) => Arc::new(BytesSource::new(bytes.clone())),
    };
    TiffFile::from_source_with_options(source, options).map_err(fault)
}

#[cfg(test)]
mod tests;
