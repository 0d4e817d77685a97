//! TIFF, GeoTIFF, BigTIFF and cloud-optimised GeoTIFF: the first band of the first full image, in
//! memory or, if it is large, read in blocks on access.
//!
//! `tiff-reader` decodes; only this folder uses it.
//!
//! - `images`, `layout`, `index`, `budget`: the directories of a file, the type and arrangement of
//!   its samples, the offsets of its strips and tiles, and the memory that these lists may take;
//! - `gdal_metadata`: no-data, scale and unit; `georef`, `user_defined`: the place of the samples and
//!   their reference system, from the keys that `geo_keys` reads; `describe`: all of these;
//! - `band`, `samples`, `masks`: the heights of a band, and which of them are no-data;
//! - `blocks`, `uncompressed`, `unpack`, `unpacked_on_disk`: parts of large images, read on access;
//! - `blended_overviews`: detection of overviews averaged with no-data values, which are ignored;
//! - `remote_source`, `decoder_error`: files at URLs, and the decoder's errors.

mod band;
mod blended_overviews;
mod blocks;
mod budget;
mod decoder_error;
mod describe;
mod gdal_metadata;
mod geo_keys;
mod georef;
mod images;
mod index;
mod layout;
mod masks;
mod remote_source;
mod samples;
mod uncompressed;
mod unpack;
mod unpacked_on_disk;
mod user_defined;

use std::iter::once;
use std::sync::Arc;

use tiff_reader::source::{FileSource, SharedSource};
use tiff_reader::{ParseBudgets, TiffError, TiffFile};

use crate::beside::find_appended;
use crate::blocks::Part;
use crate::decoded::Decoded;
use crate::file_layout::FileLayout;
use crate::format::{Claim, Format, Parts, starts_with_any};
use crate::input::{Data, FileBytes};
use crate::storage::Storage;
use crate::{OpenOptions, RasterError};
use blended_overviews::blended;
use blocks::{FileContext, Image, TiffBlocks};
use decoder_error::fault;
use describe::{describe, number_kind, overview_sizes};
use gdal_metadata::Metadata;
use layout::Layout;
use remote_source::RemoteSource;

/// TIFF and BigTIFF of either byte order.
pub(super) const FORMAT: Format = Format {
    name: "TIFF",
    begins: |head| starts_with_any(head, &[b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"]),
    extensions: &[("tif", Claim::Expected), ("tiff", Claim::Expected)],
    parts: Parts::Bands,
    decode,
};

/// Max size of samples that are downloaded whole, for a file at a URL, bytes.
const FEW_BYTES: u64 = 1 << 20;

/// Max size of a list in a directory, and of all lists, bytes: the whole Earth in cells of one
/// second and tiles of 256 × 256 samples has an index of 100 MB.
const MAX_LIST: usize = 72 << 20;
const ALL_LISTS: usize = 128 << 20;

/// Reads the heights, or leaves them in the file: from the chosen band or the first, and from the
/// first image that is neither an overview nor a mask.
fn decode(input: &FileBytes, options: &OpenOptions) -> Result<Decoded, RasterError> {
    let file = Arc::new(open(input)?);
    let full = images::full(&file)?;
    let mask_file = find_appended(input, "msk")?;
    let mask = mask_file.as_ref().map(open).transpose()?.map(Arc::new);
    let context = FileContext {
        name: input.name(),
        kind: number_kind(options)?,
        mask: mask.as_ref(),
        disk: match input.remote() {
            Some(_) => Err("it is at a URL"),
            None => Ok(&options.disk_cache),
        },
    };
    let image = Image::of(&full, &context)?;
    let layout = &image.layout;
    let (size, band, bands) = ((layout.columns, layout.rows), layout.band, layout.bands);
    let has_alpha = layout.alpha.is_some();
    let mut format = layout.described(file.byte_order());
    if options.band.is_some() {
        format += &format!(", band {} of {bands}", band + 1);
    }
    let file_layout = FileLayout {
        bands: bands.into(),
        block: Some(layout.chunk.into()),
        overviews: overview_sizes(&file, input)?,
        raster_type: None,
    };
    let metadata = Metadata::read(full.ifd(), band, bands);
    let files: Vec<_> = once(input).chain(&mask_file).collect();
    let sample_type = layout.memory_type().none();
    let no_data = options.no_data.or(metadata.no_data);
    let no_data = no_data.and_then(|value| sample_type.comparable_no_data(value));
    let (storage, storage_remarks) = stored(&files, options, &file, image, &context, no_data)?;
    let mut decoded = Decoded::new(format, size, storage);
    for remark in storage_remarks {
        match remark {
            StorageRemark::Remark(remark) => decoded.remarks.push(remark),
            StorageRemark::MemoryReason(why) => decoded.memory_reason = Some(why),
        }
    }
    if options.band.is_none() && options.encoding.is_none() && bands > 1 + u16::from(has_alpha) {
        decoded.remarks.push(format!(
            "it has {bands} bands: the first is used as the height (--input band=N)"
        ));
    }
    decoded.file_layout = file_layout;
    describe(&mut decoded, full.ifd(), metadata, input, options)?;
    Ok(decoded)
}

/// Remark on the storage of the samples.
enum StorageRemark {
    /// A remark on how they are read.
    Remark(String),
    /// Reason why all are in memory.
    MemoryReason(String),
}

/// Returns the samples of the full image: left in the file if they are many and it allows that,
/// else all of them. `files` are the TIFF and its mask's, if any; `no_data` is the value as a
/// sample stores it.
fn stored(
    files: &[&FileBytes],
    options: &OpenOptions,
    file: &Arc<TiffFile>,
    mut image: Image,
    context: &FileContext<'_>,
    no_data: Option<f64>,
) -> Result<(Storage, Vec<StorageRemark>), RasterError> {
    let input = files[0];
    let max = match input.remote() {
        // Parts that are not accessed are not downloaded.
        Some(_) => options.max_in_memory_bytes.min(FEW_BYTES),
        None => options.max_in_memory_bytes,
    };
    let mut storage_remarks = None;
    if image.layout.bytes() > max {
        if let Err(fault) = budget::check(&image.layout, input.len(), true) {
            if !image.has_parts() {
                budget::check_memory(&image.layout)?;
            }
            return Err(fault);
        }
        match image.prepare_blocks(context.disk) {
            Ok(()) => {
                if !input.is_outline() {
                    unpack::check_first(&image.layout)?;
                }
                storage_remarks = remark_unpacked(&image);
                let overviews = match find_appended(input, "ovr")? {
                    Some(beside) => Some((Arc::new(open(&beside)?), beside.remote())),
                    None => None,
                };
                let file = (file.clone(), input.remote());
                let mut blocks = TiffBlocks::new(file, image, overviews, context, files)?;
                let mut remarks: Vec<_> = storage_remarks.into_iter().collect();
                if options.encoding.is_some() && blocks.has_overviews() {
                    blocks.drop_overviews();
                    remarks.push(StorageRemark::Remark(
                        "its overviews are not used: the mean of encoded colours is no height"
                            .into(),
                    ));
                } else if let Some(no_data) = no_data.filter(|_| !input.is_outline())
                    && let Some(remark) = blended(&blocks, no_data)?
                {
                    blocks.drop_overviews();
                    remarks.push(StorageRemark::Remark(remark));
                }
                return Ok((blocks.into(), remarks));
            }
            Err(why) => {
                storage_remarks = Some(StorageRemark::MemoryReason(
                    why + peak_memory_remark(&image.layout),
                ));
            }
        }
    }
    let layout = &image.layout;
    budget::check_memory(layout)?;
    budget::check(layout, input.len(), false)?;
    if input.is_outline() {
        return Ok((
            layout.memory_type().none().into(),
            storage_remarks.into_iter().collect(),
        ));
    }
    let all = Part::whole(layout.columns, layout.rows);
    if let Some(remote) = input.remote() {
        remote.prefetch(once(0..input.len()));
    }
    let mut storage = Storage::from(samples::heights(layout, &all)?);
    storage.set_no_data(samples::no_data_mask(layout, &image.masks, &all)?);
    Ok((storage, storage_remarks.into_iter().collect()))
}

/// Returns a remark on the peak memory, if reading needs more than the samples themselves.
fn peak_memory_remark(layout: &Layout) -> &'static str {
    let all = Part::whole(layout.columns, layout.rows);
    match layout.is_plain || unpack::suits_whole_band(layout, &all) {
        true => "",
        false => "; opening it requires more than that",
    }
}

/// Returns a remark on strips or tiles that are decompressed to disk, if there are any.
fn remark_unpacked(image: &Image) -> Option<StorageRemark> {
    let megabytes = image.unpacked_bytes().div_ceil(1_000_000);
    let owner = match &image.layout.unpacked {
        Some(_) => format!("its {}", image.layout.chunks_name()),
        None => "the strips or tiles of its mask".into(),
    };
    (megabytes > 0).then(|| {
        StorageRemark::Remark(format!(
            "{owner} are too large to be unpacked each time they are touched: they are unpacked on disk (--cache), up to {megabytes} MB, until the program ends"
        ))
    })
}

/// Opens the file. Its directories' lists must not be longer than the file.
fn open(input: &FileBytes) -> Result<TiffFile, RasterError> {
    let bytes = usize::try_from(input.len()).unwrap_or(usize::MAX);
    let options = tiff_reader::OpenOptions {
        // Blocks are cached in one place for all formats.
        block_cache_bytes: 0,
        parse_budgets: ParseBudgets {
            max_ifds: 64,
            max_tag_value_bytes: bytes.min(MAX_LIST),
            max_metadata_value_bytes: ALL_LISTS,
            ..ParseBudgets::default()
        },
        ..tiff_reader::OpenOptions::default()
    };
    let source: SharedSource = match input.data() {
        Data::File(_, path) => Arc::new(FileSource::open(path).map_err(fault)?),
        #[cfg(test)]
        Data::Memory(bytes) => Arc::new(tiff_reader::source::BytesSource::new(bytes.clone())),
        Data::Remote(file, _) => Arc::new(RemoteSource(file.clone())),
    };
    TiffFile::from_source_with_options(source, options).map_err(|error| match &error {
        TiffError::InvalidTagValue { reason, .. } if is_long(reason) => {
            decoder_error::unsupported(format!(
                "an index of more than {} MB, as of very many small tiles,",
                MAX_LIST >> 20
            ))
        }
        _ => fault(error),
    })
}

/// Returns true if a list is rejected as too long for any file.
fn is_long(reason: &str) -> bool {
    [MAX_LIST, ALL_LISTS]
        .iter()
        .any(|max| reason.ends_with(&format!("parse budget {max}")))
}

#[cfg(test)]
mod odd_tags_tests;
#[cfg(test)]
mod test_files;
#[cfg(test)]
mod tests;
/// TIFFs written tag by tag, for the tests of all crates.
#[cfg(test)]
#[path = "../../../../tests/src/tiffs.rs"]
#[allow(dead_code, unreachable_pub)]
mod tiffs;
