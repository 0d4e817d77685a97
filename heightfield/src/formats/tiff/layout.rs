//! Storage of an image's samples, and whether these can be heights.

use std::ops::Range;
use std::sync::Arc;

use tiff_reader::{ByteOrder, Ifd, PhotometricInterpretation};

use super::decoder_error::{fault, unsupported};
use super::images::Directory;
use super::index::{Chunk, Index};
use super::unpacked_on_disk::Unpacked;
use crate::blocks::Part;
use crate::encoding::no_codes;
use crate::read::StoredType;
use crate::{RasterError, SampleType};

/// Larger chunks are not decoded whole if there is an alternative, bytes.
pub(super) const MAX_DECODED: u64 = 1 << 20;

/// Storage of an image's samples.
pub(super) struct Layout {
    /// The image.
    pub(super) directory: Directory,
    pub(super) columns: u32,
    pub(super) rows: u32,
    /// Type of a sample.
    pub(super) stored: (SampleFormat, u16),
    pub(super) bands: u16,
    /// The band with the heights, the first being 0.
    pub(super) band: usize,
    /// True if the first three bands are red, green and blue, and encode the heights.
    pub(super) has_codes: bool,
    /// The band with the transparency, if there is one.
    pub(super) alpha: Option<usize>,
    /// Its name, and the max bytes that a stored byte may expand to.
    pub(super) compression: (&'static str, u64),
    /// True if each band has its own chunks.
    planar: bool,
    tiled: bool,
    /// Columns and rows of a strip or tile.
    pub(super) chunk: (u32, u32),
    /// True if the bytes are samples in plain order, and the chunks are so large that they are read
    /// row by row.
    pub(super) is_plain: bool,
    /// Chunks that are too large to be decoded on access, once they are decompressed on disk.
    pub(super) unpacked: Option<Arc<Unpacked>>,
}

/// Number of bands of encoded heights.
pub(super) const COLOURS: usize = 3;

/// The kind of numbers to read from a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberKind {
    /// Heights in a band, the first being 1; by default, in the first.
    Heights(Option<u32>),
    /// As `Heights`, for numbers that are classes: the numbers of a palette are used directly.
    Classes(Option<u32>),
    /// Heights encoded in colours.
    Codes,
}

impl NumberKind {
    const fn band(self) -> Option<u32> {
        match self {
            Self::Heights(band) | Self::Classes(band) => band,
            Self::Codes => None,
        }
    }
}

/// Meaning of a sample's bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SampleFormat {
    Unsigned,
    Signed,
    Float,
}

/// Returns the name of a compression, and the max bytes that a stored byte may expand to.
fn compression(code: u16) -> Result<(&'static str, u64), RasterError> {
    let refused = match code {
        1 => return Ok(("uncompressed", 1)),
        5 => return Ok(("lzw", 2048)),
        8 => return Ok(("deflate", 1040)),
        32773 => return Ok(("packbits", 64)),
        32946 => return Ok(("olddeflate", 1040)),
        // Zstandard repeats a block of 128 KiB with a few bytes.
        50000 => return Ok(("zstd", 40_000)),
        6 | 7 => "JPEG compression",
        // LERC stores a uniform block in some hundred bytes; this allows blocks of a megapixel.
        34887 => return Ok(("lerc", 40_000)),
        34925 => "LZMA compression",
        50001 => "WebP compression",
        50002 | 52546 => "JPEG XL compression",
        _ => return Err(unsupported(format!("compression {code}"))),
    };
    Err(unsupported(refused.into()))
}

impl Layout {
    /// Reads and checks the layout of an image for the requested kind of numbers.
    pub(super) fn read(directory: &Directory, kind: NumberKind) -> Result<Self, RasterError> {
        let image = directory.ifd();
        let bands = image.samples_per_pixel();
        match kind {
            NumberKind::Codes => check_codes(image, bands)?,
            NumberKind::Classes(_) if is_palette(image) => {}
            NumberKind::Heights(band) | NumberKind::Classes(band) => {
                refuse_colour(image, bands, band.is_some())?;
            }
        }
        let band = chosen_band(kind.band(), bands)?;
        let layout = Self {
            band,
            has_codes: kind == NumberKind::Codes,
            alpha: alpha(image, bands).filter(|alpha| *alpha != band),
            ..Self::of(directory, stored_type(image)?)?
        };
        check_predictor(image, layout.stored.0)?;
        // Fails here for layouts that the decoder rejects, even if it is not used later.
        image.raster_layout().map_err(fault)?;
        Ok(layout)
    }

    /// Reads the layout of a mask, whose samples may have few bits.
    pub(super) fn of_mask(directory: &Directory) -> Result<Self, RasterError> {
        let image = directory.ifd();
        let bits = image.bits_per_sample().map_err(fault)?;
        let bits = bits.first().copied().unwrap_or(1);
        let layout = Self::of(directory, (SampleFormat::Unsigned, bits))?;
        image.raster_layout().map_err(fault)?;
        match matches!(bits, 1 | 2 | 4 | 8) && image.predictor() == 1 && layout.bands == 1 {
            true => Ok(layout),
            false => Err(unsupported(format!("a mask of {bits} bits a sample"))),
        }
    }

    /// Reads the layout of the first band's samples.
    fn of(directory: &Directory, stored: (SampleFormat, u16)) -> Result<Self, RasterError> {
        let image = directory.ifd();
        let (columns, rows) = (image.width(), image.height());
        if columns == 0 || rows == 0 {
            return Err(RasterError::damaged(format!(
                "TIFF: an image of {columns} × {rows}"
            )));
        }
        let (tiled, chunk) = match (image.tile_width(), image.tile_height()) {
            (Some(width), Some(height)) => (true, (width, height)),
            _ => (false, (columns, image.rows_per_strip().min(rows))),
        };
        if chunk.0 == 0 || chunk.1 == 0 {
            return Err(RasterError::damaged(
                "TIFF: strips or tiles without samples",
            ));
        }
        if Index::of(image, tiled).is_none() {
            let what = "TIFF: it does not state where its samples are";
            return Err(RasterError::damaged(what));
        }
        let layout = Self {
            directory: directory.clone(),
            columns,
            rows,
            stored,
            bands: image.samples_per_pixel(),
            band: 0,
            has_codes: false,
            alpha: None,
            compression: compression(image.compression())?,
            planar: image.planar_configuration() == 2,
            tiled,
            chunk,
            is_plain: false,
            unpacked: None,
        };
        Ok(Self {
            is_plain: layout.chunk_size() > MAX_DECODED && has_plain_samples(image),
            ..layout
        })
    }

    /// Returns true if rows can be read without the rest of their strip or tile.
    pub(super) fn is_read_by_rows(&self) -> bool {
        self.is_plain || self.unpacked.is_some()
    }

    /// Returns true if a part can be read without decompressing to disk first.
    #[cfg(test)]
    pub(super) fn is_available(&self, part: &Part) -> bool {
        self.unpacked.as_ref().is_none_or(|unpacked| {
            let bands = self.bands_read();
            let chunks = bands.flat_map(|band| self.chunks_of(band, part));
            let mut stored = chunks.filter(|chunk| chunk.bytes > 0);
            stored.all(|chunk| unpacked.has(&chunk))
        })
    }

    /// Returns `strips` or `tiles`.
    pub(super) const fn chunks_name(&self) -> &'static str {
        if self.tiled { "tiles" } else { "strips" }
    }

    /// Returns true if it has strips.
    pub(super) const fn has_strips(&self) -> bool {
        !self.tiled
    }

    /// Returns the size of a chunk's samples, bytes.
    pub(super) fn chunk_size(&self) -> u64 {
        self.row_bytes().saturating_mul(self.chunk.1.into())
    }

    /// Returns the size of a chunk's row, bytes.
    pub(super) fn row_bytes(&self) -> u64 {
        self.bytes_of(self.chunk.0)
    }

    /// Returns the size of some texels of a row, rounded up to bytes.
    fn bytes_of(&self, columns: u32) -> u64 {
        let bits = u64::from(self.stored.1) * u64::from(self.bands_together());
        bits.saturating_mul(columns.into()).div_ceil(8)
    }

    /// Returns the byte range of some columns in a chunk's row.
    pub(super) fn row_range(&self, first: u32, columns: u32) -> Range<u64> {
        let bits = u64::from(self.stored.1) * u64::from(self.bands_together());
        bits.saturating_mul(first.into()) / 8..self.bytes_of(first.saturating_add(columns))
    }

    /// Returns the type of a sample in the file, and in memory.
    pub(super) const fn sample(&self) -> StoredType {
        use SampleFormat::{Float, Signed, Unsigned};
        match self.stored {
            (Unsigned, 8) => StoredType::Held(SampleType::U8),
            (Signed, 8) => StoredType::Held(SampleType::I8),
            (Unsigned, 16) => StoredType::Held(SampleType::U16),
            (Signed, 16) => StoredType::Held(SampleType::I16),
            (Float, 16) => StoredType::F16,
            (Unsigned, 32) => StoredType::Held(SampleType::U32),
            (Signed, 32) => StoredType::Held(SampleType::I32),
            (Float, 32) => StoredType::Held(SampleType::F32),
            (Unsigned, _) => StoredType::U64,
            (Signed, _) => StoredType::I64,
            (Float, _) => StoredType::Held(SampleType::F64),
        }
    }

    /// Returns the type of the heights in memory.
    pub(super) const fn memory_type(&self) -> SampleType {
        match self.has_codes {
            true => SampleType::I32,
            false => self.sample().memory_type(),
        }
    }

    /// Returns the number of chunks from west to east.
    pub(super) fn chunks_across(&self) -> u32 {
        self.columns.div_ceil(self.chunk.0)
    }

    /// Returns the chunks with samples of a part, in the band of the heights, without those missing
    /// in the index.
    pub(super) fn chunks_in(&self, part: &Part) -> impl Iterator<Item = Chunk> {
        self.chunks_of(self.band, part)
    }

    /// As `chunks_in`, for another band.
    pub(super) fn chunks_of(&self, band: usize, part: &Part) -> impl Iterator<Item = Chunk> {
        let (width, height) = self.chunk;
        let across = part.column / width..(part.column + part.columns).div_ceil(width);
        let down = part.row / height..(part.row + part.rows).div_ceil(height);
        let places = down.flat_map(move |row| across.clone().map(move |column| (column, row)));
        let (first, index) = (self.first_of(band), self.index());
        places.filter_map(move |(column, row)| {
            let number = u64::from(row) * u64::from(self.chunks_across()) + u64::from(column);
            let number = usize::try_from(number).ok()?.checked_add(first?)?;
            let (place, bytes) = index.as_ref()?.at(number)?;
            let (column, row) = (column * width, row * height);
            let covers = Part {
                column,
                row,
                columns: width.min(self.columns - column),
                rows: height.min(self.rows - row),
            };
            Some(Chunk {
                place,
                bytes,
                covers,
            })
        })
    }

    /// Returns the size of all samples in memory, bytes.
    pub(super) fn bytes(&self) -> u64 {
        let samples = u64::from(self.columns) * u64::from(self.rows);
        samples.saturating_mul(self.memory_type().bytes())
    }

    /// Returns offset and size of each chunk of the heights' band; `None` if the index is too
    /// short. The size is 0 for chunks that are missing in a sparse file.
    pub(super) fn of_band(&self) -> Option<impl Iterator<Item = (u64, u64)>> {
        let (index, first) = (self.index()?, self.first_of(self.band)?);
        let end = first.checked_add(usize::try_from(self.chunks_of_band()).ok()?)?;
        index.at(end.checked_sub(1)?)?;
        Some((first..end).map_while(move |number| index.at(number)))
    }

    /// Returns the number of a band's chunks.
    pub(super) fn chunks_of_band(&self) -> u64 {
        u64::from(self.chunks_across()) * u64::from(self.rows.div_ceil(self.chunk.1))
    }

    /// Returns the offsets of all chunks of all bands.
    pub(super) fn places(&self) -> impl Iterator<Item = u64> {
        let index = self.index();
        (0..).map_while(move |number| index.as_ref()?.place(number))
    }

    /// Returns the size of its lists in memory.
    pub(super) fn index_bytes(&self) -> usize {
        self.index().map_or(0, |index| index.memory_bytes())
    }

    fn index(&self) -> Option<Index<'_>> {
        Index::of(self.directory.ifd(), self.tiled)
    }

    /// Returns the number of a band's first chunk among those of all bands.
    fn first_of(&self, band: usize) -> Option<usize> {
        let chunks = usize::try_from(self.chunks_of_band()).ok()?;
        match self.planar {
            true => chunks.checked_mul(band),
            false => Some(0),
        }
    }

    /// Returns the bands whose chunks are read for heights, including the transparency.
    pub(super) fn bands_read(&self) -> impl Iterator<Item = usize> + use<> {
        let separate_alpha = self.alpha.filter(|_| self.planar);
        let colours = if self.has_codes && self.planar {
            1..COLOURS
        } else {
            1..1
        };
        std::iter::once(self.band)
            .chain(colours)
            .chain(separate_alpha)
    }

    /// Returns the bytes of a texel before a band's sample.
    pub(super) fn bytes_before(&self, band: usize) -> usize {
        let band = if self.planar { 0 } else { band };
        usize::from(self.stored.1 / 8) * band
    }

    /// Returns the bytes of samples that are stored together: one of each band, or only one if each
    /// band has its own chunks.
    pub(super) fn texel_bytes(&self) -> u64 {
        u64::from(self.stored.1 / 8) * u64::from(self.bands_together())
    }

    /// Returns the number of bands that share chunks.
    pub(super) const fn bands_together(&self) -> u16 {
        if self.planar { 1 } else { self.bands }
    }

    /// Returns a description of the variant.
    pub(super) fn described(&self, order: ByteOrder) -> String {
        let sample = match self.stored.0 {
            SampleFormat::Unsigned => "uint",
            SampleFormat::Signed => "int",
            SampleFormat::Float => "float",
        };
        let (bits, compression) = (self.stored.1, self.compression.0);
        let chunks = match self.chunk {
            (columns, rows) if self.tiled => format!("{columns} × {rows} tiles"),
            _ => "strips".into(),
        };
        let order = match order {
            ByteOrder::BigEndian => ", big-endian",
            ByteOrder::LittleEndian => "",
        };
        format!("TIFF, {sample}{bits}, {compression}, {chunks}{order}")
    }
}

/// Checks the predictor: floats support only predictor 3.
fn check_predictor(image: &Ifd, format: SampleFormat) -> Result<(), RasterError> {
    const FLOAT_PREDICTOR: u16 = 3;
    match (image.predictor(), format) {
        (FLOAT_PREDICTOR, SampleFormat::Signed | SampleFormat::Unsigned) => {
            Err(RasterError::damaged(
                "TIFF: its samples are whole numbers and its predictor is 3, which is for floats",
            ))
        }
        _ => Ok(()),
    }
}

/// Returns true if the bytes are samples: not compressed, without predictor, bits not reversed.
fn has_plain_samples(image: &Ifd) -> bool {
    (image.compression(), image.predictor(), image.fill_order()) == (1, 1, 1)
}

/// Returns the band that its tag marks as alpha, associated or not.
fn alpha(image: &Ifd, bands: u16) -> Option<usize> {
    const EXTRA_SAMPLES: u16 = 338;
    let extra = image.tag(EXTRA_SAMPLES)?.value.as_u16_slice()?;
    let first = usize::from(bands).checked_sub(extra.len())?;
    let alpha = extra.iter().position(|kind| matches!(kind, 1 | 2))?;
    // The first band is the height, whatever its tag.
    Some(first + alpha).filter(|band| *band > 0)
}

/// Returns the band that the user chose, or the first, which is 0.
fn chosen_band(requested: Option<u32>, bands: u16) -> Result<usize, RasterError> {
    let band = requested.unwrap_or(1).max(1);
    if band > u32::from(bands) {
        let available = match bands {
            1 => "the file has one band".to_owned(),
            bands => format!("the file has bands 1 to {bands}"),
        };
        let requested = format!("band {band}");
        return Err(RasterError::NoSuchPart {
            requested,
            available,
        });
    }
    Ok(band as usize - 1)
}

/// Checks that an image has colours that may encode heights.
fn check_codes(image: &Ifd, bands: u16) -> Result<(), RasterError> {
    use PhotometricInterpretation::{MinIsBlack, Rgb};
    let meaning = image.photometric_interpretation_enum();
    let is_rgb = matches!(meaning, Some(Rgb | MinIsBlack));
    let is_bytes = stored_type(image)? == (SampleFormat::Unsigned, 8);
    match is_rgb && is_bytes && usize::from(bands) >= COLOURS {
        true => Ok(()),
        false => Err(no_codes("the file has other bands")),
    }
}

fn is_palette(image: &Ifd) -> bool {
    image.photometric_interpretation_enum() == Some(PhotometricInterpretation::Palette)
}

/// Rejects colours, with any number of bands, unless the user has `chosen` one of them.
fn refuse_colour(image: &Ifd, bands: u16, chosen: bool) -> Result<(), RasterError> {
    use PhotometricInterpretation as Meaning;
    let what = match image.photometric_interpretation_enum() {
        Some(Meaning::MinIsBlack | Meaning::MinIsWhite) => return Ok(()),
        Some(Meaning::Rgb | Meaning::Separated) if chosen => return Ok(()),
        Some(Meaning::Rgb) => {
            let what = format!("a colour image of {bands} bands");
            return Err(RasterError::ColourBands { what, bands });
        }
        Some(Meaning::Palette) => "an image with a palette".into(),
        Some(Meaning::YCbCr) => "a colour image (YCbCr)".into(),
        Some(Meaning::Separated) => "a colour image (CMYK)".into(),
        Some(Meaning::Mask) => "a transparency mask".into(),
        _ => "an image of unknown interpretation".into(),
    };
    Err(RasterError::NotAHeightField(what))
}

fn stored_type(image: &Ifd) -> Result<(SampleFormat, u16), RasterError> {
    let first = |values: Vec<u16>| values.first().copied().unwrap_or(1);
    let bits = first(image.bits_per_sample().map_err(fault)?);
    let format = match first(image.sample_format().map_err(fault)?) {
        1 => SampleFormat::Unsigned,
        2 => SampleFormat::Signed,
        3 => SampleFormat::Float,
        _ => {
            let what = "samples that are no real numbers".into();
            return Err(RasterError::NotAHeightField(what));
        }
    };
    match bits {
        1 if format != SampleFormat::Float => {
            Err(RasterError::NotAHeightField("one bit a sample".into()))
        }
        8 if format == SampleFormat::Float => Err(unsupported("8 bits a sample".into())),
        8 | 16 | 32 | 64 => Ok((format, bits)),
        _ => Err(unsupported(format!("{bits} bits a sample"))),
    }
}
