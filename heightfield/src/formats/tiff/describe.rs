//! The user's choice of a band, and the metadata in a file and its neighbours.

use std::sync::Arc;

use tiff_reader::{Ifd, TiffFile};

use super::gdal_metadata::Metadata;
use super::layout::NumberKind;
use super::{georef, images};
use crate::beside::{apply_world_file, find_appended, remark_other_place};
use crate::decoded::Decoded;
use crate::input::{Data, FileBytes};
use crate::{OpenOptions, RasterError};

/// Extensions of a TIFF's world files.
const WORLD_FILES: [&str; 4] = ["tfw", "tifw", "tiffw", "tfwx"];

/// Sets the metadata from the file and its neighbours.
pub(super) fn describe(
    decoded: &mut Decoded,
    image: &Ifd,
    metadata: Metadata,
    input: &FileBytes,
    options: &OpenOptions,
) -> Result<(), RasterError> {
    decoded.no_data = metadata.no_data;
    decoded.scale = metadata.scale.unwrap_or(1.0);
    decoded.offset = metadata.offset.unwrap_or(0.0);
    decoded.remarks.extend(metadata.remarks);
    // libgdal reads systems that are defined by keys.
    let by_gdal = options.gdal.then_some(input);
    georef::apply(image, decoded, metadata.metres_per_vertical_unit, by_gdal);
    match decoded.place {
        None => apply_world_file(input, &WORLD_FILES, decoded)?,
        Some(_) if input.is_outline() => {}
        Some(_) => remark_other_place(input, &WORLD_FILES, decoded),
    }
    if let Some(encoding) = options.encoding {
        decoded.decode_as_codes(encoding);
    }
    remark_orientation(image, decoded);
    Ok(())
}

/// Returns columns and rows of the overviews in a file, and in one beside it on disk.
pub(super) fn overview_sizes(
    file: &Arc<TiffFile>,
    input: &FileBytes,
) -> Result<Vec<[u32; 2]>, RasterError> {
    let mut found = images::overviews(file);
    if let (Data::File(..), false) = (input.data(), input.is_outline())
        && let Some(beside) = find_appended(input, "ovr")?
    {
        // Its faults are reported where it is used.
        found
            .extend(super::open(&beside).map_or(vec![], |file| images::overviews(&Arc::new(file))));
    }
    let size = |image: &images::Directory| [image.ifd().width(), image.ifd().height()];
    Ok(found.iter().map(size).collect())
}

/// Returns the kind of numbers that the user chose.
pub(super) fn number_kind(options: &OpenOptions) -> Result<NumberKind, RasterError> {
    match (options.encoding, options.band) {
        (Some(_), Some(band)) => Err(RasterError::NoSuchPart {
            requested: format!("band {band} with --input encoding=…"),
            available: "three bands together are one height".into(),
        }),
        (Some(_), None) => Ok(NumberKind::Codes),
        (None, band) if options.classes => Ok(NumberKind::Classes(band)),
        (None, band) => Ok(NumberKind::Heights(band)),
    }
}

/// Adds a remark on the tag for the position of the first row and column, which GDAL also ignores.
fn remark_orientation(image: &Ifd, decoded: &mut Decoded) {
    const ORIENTATION: u16 = 274;
    let first = match image.tag(ORIENTATION).and_then(|tag| tag.value.as_u32()) {
        None | Some(0 | 1) => return,
        Some(2) => "the first row at the top, the first column at the right",
        Some(3) => "the first row at the bottom, the first column at the right",
        Some(4) => "the first row at the bottom, the first column at the left",
        Some(_) => "rows and columns exchanged",
    };
    decoded.remarks.push(format!(
        "its Orientation tag has {first}: it is not used, as in GDAL, and the first row is read as the northern one unless the file's place states another"
    ));
}
