//! How an image's samples are stored, and whether they can be heights.

use std::io::{Read, Seek};

use tiff::decoder::{ChunkType, Decoder};
use tiff::tags::{CompressionMethod, PhotometricInterpretation, SampleFormat, Tag};

use super::fault;
use crate::raster::Fault;

/// The type of a stored sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stored {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F16,
    F32,
    F64,
}

/// How an image's samples are stored.
#[derive(Debug)]
pub(super) struct Layout {
    pub(super) columns: u32,
    pub(super) rows: u32,
    pub(super) stored: Stored,
    pub(super) bands: u16,
    /// Each band has its own chunks.
    pub(super) planar: bool,
    pub(super) white_is_zero: bool,
    pub(super) compression: CompressionMethod,
    pub(super) chunk: (u32, u32),
    pub(super) tiled: bool,
    /// Bytes stored for each chunk; 0 for one that a sparse file leaves out.
    pub(super) chunk_bytes: Vec<u64>,
    big_endian: bool,
}

impl Layout {
    /// Reads and checks the layout of the current image.
    pub(super) fn read<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<Self, Fault> {
        let (columns, rows) = decoder.dimensions().map_err(fault)?;
        let bands: u16 = unsigned(decoder, Tag::SamplesPerPixel)?.unwrap_or(1);
        let photometric: u16 = unsigned(decoder, Tag::PhotometricInterpretation)?.unwrap_or(1);
        let photometric = PhotometricInterpretation::from_u16(photometric);
        refuse_colour(photometric, bands)?;
        let white_is_zero = photometric == Some(PhotometricInterpretation::WhiteIsZero);
        let stored = stored_type(decoder)?;
        if white_is_zero && !matches!(stored, Stored::U8 | Stored::U16 | Stored::U32) {
            return Err(unsupported(
                "white is zero for other samples than unsigned integers",
            ));
        }
        let compression: u16 = unsigned(decoder, Tag::Compression)?.unwrap_or(1);
        let compression = supported_compression(compression)?;
        let tiled = decoder.get_chunk_type() == ChunkType::Tile;
        let counts = if tiled {
            Tag::TileByteCounts
        } else {
            Tag::StripByteCounts
        };
        let chunk = decoder.chunk_dimensions();
        Ok(Self {
            columns,
            rows,
            stored,
            bands,
            planar: unsigned::<u16, _>(decoder, Tag::PlanarConfiguration)? == Some(2),
            white_is_zero,
            compression,
            chunk: if tiled {
                chunk
            } else {
                (columns, chunk.1.min(rows))
            },
            tiled,
            chunk_bytes: decoder.get_tag_u64_vec(counts).map_err(fault)?,
            big_endian: decoder.byte_order() == tiff::tags::ByteOrder::BigEndian,
        })
    }

    /// Chunks from west to east.
    pub(super) fn chunks_across(&self) -> u32 {
        self.columns.div_ceil(self.chunk.0)
    }

    /// Bytes stored for each chunk of the first band; `None` when the index has
    /// too few.
    pub(super) fn first_band(&self) -> Option<&[u64]> {
        let down = self.rows.div_ceil(self.chunk.1);
        let chunks = u64::from(self.chunks_across()) * u64::from(down);
        self.chunk_bytes.get(..usize::try_from(chunks).ok()?)
    }

    /// Samples of neighbouring bands that are stored together.
    pub(super) fn interleaved(&self) -> u16 {
        if self.planar { 1 } else { self.bands }
    }

    /// Bytes of the samples that are stored together.
    pub(super) fn texel_bytes(&self) -> u64 {
        let sample = match self.stored {
            Stored::U8 | Stored::I8 => 1,
            Stored::U16 | Stored::I16 | Stored::F16 => 2,
            Stored::U32 | Stored::I32 | Stored::F32 => 4,
            Stored::U64 | Stored::I64 | Stored::F64 => 8,
        };
        sample * u64::from(self.interleaved())
    }

    /// The variant in words.
    pub(super) fn described(&self) -> String {
        let stored = match self.stored {
            Stored::U8 => "uint8",
            Stored::I8 => "int8",
            Stored::U16 => "uint16",
            Stored::I16 => "int16",
            Stored::U32 => "uint32",
            Stored::I32 => "int32",
            Stored::U64 => "uint64",
            Stored::I64 => "int64",
            Stored::F16 => "float16",
            Stored::F32 => "float32",
            Stored::F64 => "float64",
        };
        let compression = match self.compression {
            CompressionMethod::None => "uncompressed".into(),
            method => format!("{method:?}").to_lowercase(),
        };
        let (columns, rows) = self.chunk;
        let chunks = if self.tiled {
            format!("{columns} × {rows} tiles")
        } else {
            "strips".into()
        };
        let endian = if self.big_endian { ", big-endian" } else { "" };
        format!("TIFF, {stored}, {compression}, {chunks}{endian}")
    }
}

fn unsupported(feature: &str) -> Fault {
    Fault::Unsupported {
        format: "TIFF",
        feature: feature.into(),
    }
}

/// The compressions that are compiled in, of those that GIS programs write.
fn supported_compression(code: u16) -> Result<CompressionMethod, Fault> {
    let name = match code {
        1 | 5 | 8 | 32773 | 32946 | 50000 => {
            return Ok(CompressionMethod::from_u16_exhaustive(code));
        }
        6 | 7 => "JPEG",
        34887 => "LERC",
        34925 => "LZMA",
        50001 => "WebP",
        50002 | 52546 => "JPEG XL",
        _ => return Err(unsupported(&format!("compression {code}"))),
    };
    Err(unsupported(&format!("{name} compression")))
}

fn unsigned<T: TryFrom<u64>, R: Read + Seek>(
    decoder: &mut Decoder<R>,
    tag: Tag,
) -> Result<Option<T>, Fault> {
    decoder.find_tag_unsigned(tag).map_err(fault)
}

/// Colours are no heights, however many bands they have.
fn refuse_colour(photometric: Option<PhotometricInterpretation>, bands: u16) -> Result<(), Fault> {
    use PhotometricInterpretation::{
        BlackIsZero, CMYK, RGB, RGBPalette, TransparencyMask, WhiteIsZero, YCbCr,
    };
    let what = match photometric {
        Some(BlackIsZero | WhiteIsZero) => return Ok(()),
        Some(RGB) => format!("a colour image of {bands} bands"),
        Some(RGBPalette) => "an image with a palette".into(),
        Some(YCbCr) => "a colour image (YCbCr)".into(),
        Some(CMYK) => "a colour image (CMYK)".into(),
        Some(TransparencyMask) => "a transparency mask".into(),
        _ => "an image of unknown interpretation".into(),
    };
    Err(Fault::NotAHeightField(what))
}

fn stored_type<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<Stored, Fault> {
    let first = |values: Option<Vec<u16>>| values.and_then(|values| values.first().copied());
    let bits = first(
        decoder
            .find_tag_unsigned_vec(Tag::BitsPerSample)
            .map_err(fault)?,
    );
    let format = first(
        decoder
            .find_tag_unsigned_vec(Tag::SampleFormat)
            .map_err(fault)?,
    );
    let format = SampleFormat::from_u16_exhaustive(format.unwrap_or(1));
    Ok(match (format, bits.unwrap_or(1)) {
        (SampleFormat::Uint, 8) => Stored::U8,
        (SampleFormat::Int, 8) => Stored::I8,
        (SampleFormat::Uint, 16) => Stored::U16,
        (SampleFormat::Int, 16) => Stored::I16,
        (SampleFormat::IEEEFP, 16) => Stored::F16,
        (SampleFormat::Uint, 32) => Stored::U32,
        (SampleFormat::Int, 32) => Stored::I32,
        (SampleFormat::IEEEFP, 32) => Stored::F32,
        (SampleFormat::Uint, 64) => Stored::U64,
        (SampleFormat::Int, 64) => Stored::I64,
        (SampleFormat::IEEEFP, 64) => Stored::F64,
        (SampleFormat::Uint | SampleFormat::Int, 1) => {
            return Err(Fault::NotAHeightField("one bit a sample".into()));
        }
        (SampleFormat::Uint | SampleFormat::Int | SampleFormat::IEEEFP, bits) => {
            return Err(unsupported(&format!("{bits} bits a sample")));
        }
        _ => {
            return Err(Fault::NotAHeightField(
                "samples that are no real numbers".into(),
            ));
        }
    })
}
