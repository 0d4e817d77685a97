//! PNG pictures: grey, grey with no-data, or the height in one channel of a colour picture.

mod encoded;

use std::io::{BufRead, Seek};

use ::png::{BitDepth, ColorType, Decoder, DecodingError, Limits, Reader, Transformations};

use crate::beside::apply_world_file;
use crate::decoded::Decoded;
use crate::format::{Claim, Format, Parts};
use crate::input::{FileBytes, ReadSeek};
use crate::samples::{NoDataMask, SampleValue, with_samples};
use crate::{Endian, PngChannel, RasterError, Samples};

/// Pictures whose pixels are heights.
pub(super) const FORMAT: Format = Format {
    name: "PNG",
    begins: |head| head.starts_with(b"\x89PNG\r\n\x1a\n"),
    extensions: &[("png", Claim::Expected)],
    parts: Parts::One,
    decode: |input, options| {
        let mut decoded = match options.encoding {
            Some(encoding) => encoded::decode(input, encoding)?,
            None => decode(input, options.png_channel)?,
        };
        apply_world_file(input, &WORLD_FILES, &mut decoded)?;
        Ok(decoded)
    },
};

/// Extensions of a PNG's world files.
const WORLD_FILES: [&str; 3] = ["pgw", "pngw", "pgwx"];

/// Max memory of a PNG's own chunks (text, profiles, tables), bytes.
const CHUNK_BYTES: usize = 64 << 20;

/// Reads one channel of a picture as heights.
///
/// - Grey: the grey is the height. A sample of alpha 0 is no-data; any other alpha is ignored. A
///   grey that is marked transparent (`tRNS`) is no-data.
/// - Colour with alpha: the alpha is the height, as in the paper's data, and 0 is an ordinary
///   height. An alpha that is opaque everywhere means a photograph, not a height field.
/// - Colour without alpha, or a palette: not a height field.
///
/// `channel` overrides this choice.
fn decode(input: &FileBytes, channel: Option<PngChannel>) -> Result<Decoded, RasterError> {
    let mut reader = reader(input)?;
    let info = reader.info();
    let (size, color) = ((info.width, info.height), info.color_type);
    let sample_bytes = match info.bit_depth {
        BitDepth::Eight => 1,
        BitDepth::Sixteen => 2,
        few => {
            return Err(RasterError::Unsupported {
                format: "PNG",
                feature: format!("{} bits a sample", few as u8),
            });
        }
    };
    let pixel_bytes = sample_bytes * color.samples();
    input.check_size(size.0, size.1, pixel_bytes as u64)?;
    let transparent = transparent_grey(info);
    let chosen = Choice::new(color, channel).map_err(|fault| match channel {
        None => encoded::suspect_encoded_heights(fault, input),
        Some(_) => fault,
    })?;
    let count = size.0 as usize * size.1 as usize;
    let mut pixels = Pixels {
        columns: size.0 as usize,
        chosen,
        sample_bytes,
        pixel_bytes,
        samples: match sample_bytes {
            1 => Samples::U8(Vec::with_capacity(count)),
            _ => Samples::U16(Vec::with_capacity(count)),
        },
        mask: chosen
            .no_data_index
            .map(|_| NoDataMask::with_capacity(count)),
    };
    pixels.read(&mut reader)?;
    if channel.is_none() && chosen.height == PngChannel::Alpha {
        refuse_opaque(&pixels.samples)
            .map_err(|fault| encoded::suspect_encoded_heights(fault, input))?;
    }
    let what = chosen.described(color);
    let format = format!("PNG, {}-bit {what}", 8 * sample_bytes);
    let mut decoded = Decoded::new(format, size, pixels.samples);
    decoded.storage.set_no_data(pixels.mask);
    decoded.no_data = transparent;
    Ok(decoded)
}

/// Returns a decoder that has read the picture's header.
fn reader(input: &FileBytes) -> Result<Reader<Box<dyn ReadSeek + '_>>, RasterError> {
    let limits = Limits { bytes: CHUNK_BYTES };
    let mut decoder = Decoder::new_with_limits(input.reader()?, limits);
    decoder.set_transformations(Transformations::IDENTITY);
    decoder.ignore_checksums(false);
    decoder.read_info().map_err(fault)
}

/// Returns the grey of a `tRNS` chunk, which has 16 bits at any depth of the picture.
fn transparent_grey(info: &::png::Info<'_>) -> Option<f64> {
    let grey = match info.trns.as_deref() {
        Some(&[high, low]) if info.color_type == ColorType::Grayscale => [high, low],
        _ => return None,
    };
    Some(u16::from_be_bytes(grey).into())
}

/// The channel of the height, and the channel that marks no-data.
#[derive(Clone, Copy)]
struct Choice {
    height: PngChannel,
    height_index: usize,
    no_data_index: Option<usize>,
}

impl Choice {
    fn new(color: ColorType, requested: Option<PngChannel>) -> Result<Self, RasterError> {
        use PngChannel::{Alpha, Blue, Green, Grey, Red};
        let (present, usual): (&[PngChannel], _) = match color {
            ColorType::Grayscale => (&[Grey], Some(Grey)),
            ColorType::GrayscaleAlpha => (&[Grey, Alpha], Some(Grey)),
            ColorType::Rgb => (&[Red, Green, Blue], None),
            ColorType::Rgba => (&[Red, Green, Blue, Alpha], Some(Alpha)),
            ColorType::Indexed => {
                return Err(RasterError::NotAHeightField(
                    "a picture with a palette".into(),
                ));
            }
        };
        let ambiguous = |what: String| RasterError::AmbiguousChannels(what);
        let height = requested
            .or(usual)
            .ok_or_else(|| ambiguous("a colour picture".into()))?;
        let find = |requested| present.iter().position(|&channel| channel == requested);
        Ok(Self {
            height,
            height_index: find(height)
                .ok_or_else(|| ambiguous(format!("the picture has no {height:?} channel")))?,
            no_data_index: find(Alpha).filter(|_| height == Grey),
        })
    }

    fn described(self, color: ColorType) -> String {
        match (self.height, color) {
            (PngChannel::Grey, ColorType::GrayscaleAlpha) => "grey, alpha 0 is no data".into(),
            (PngChannel::Grey, _) => "grey".into(),
            (channel, _) => format!("height in {}", format!("{channel:?}").to_lowercase()),
        }
    }
}

/// The chosen channel, filled row by row.
struct Pixels {
    columns: usize,
    chosen: Choice,
    sample_bytes: usize,
    pixel_bytes: usize,
    samples: Samples,
    mask: Option<NoDataMask>,
}

impl Pixels {
    /// Reads the rows. An interlaced picture is decoded whole before it has rows.
    fn read<R: BufRead + Seek>(&mut self, reader: &mut Reader<R>) -> Result<(), RasterError> {
        if reader.info().interlaced {
            let mut frame = vec![0; reader.output_buffer_size().unwrap_or(0)];
            reader.next_frame(&mut frame).map_err(fault)?;
            let rows = frame.chunks_exact(self.columns * self.pixel_bytes);
            rows.for_each(|row| self.add_row(row));
        } else {
            while let Some(row) = reader.next_row().map_err(fault)? {
                self.add_row(row.data());
            }
        }
        Ok(())
    }

    fn add_row(&mut self, row: &[u8]) {
        let first = self.samples.len();
        let channel = |index: usize| {
            let bytes = index * self.sample_bytes..(index + 1) * self.sample_bytes;
            let pixels = row.chunks_exact(self.pixel_bytes);
            pixels.map(move |pixel| &pixel[bytes.clone()])
        };
        let heights = channel(self.chosen.height_index);
        match &mut self.samples {
            Samples::U8(values) => values.extend(heights.map(|bytes| bytes[0])),
            Samples::U16(values) => {
                values.extend(heights.map(|bytes| u16::from_bytes(bytes, Endian::Big)));
            }
            _ => unreachable!("a PNG has 8 or 16 bits a sample"),
        }
        if let Some((mask, alpha)) = self.mask.as_mut().zip(self.chosen.no_data_index) {
            let transparent = channel(alpha).map(|bytes| bytes.iter().all(|&byte| byte == 0));
            let no_data = (first..)
                .zip(transparent)
                .filter(|&(_, is_no_data)| is_no_data);
            no_data.for_each(|(index, _)| mask.insert(index));
        }
    }
}

/// Rejects an alpha that is opaque everywhere: it is a photograph, not a relief.
fn refuse_opaque(alpha: &Samples) -> Result<(), RasterError> {
    let opaque = f64::from(match alpha {
        Samples::U8(_) => u16::from(u8::MAX),
        _ => u16::MAX,
    });
    if with_samples!(alpha, values => values.iter().all(|value| value.widen() == opaque)) {
        return Err(RasterError::AmbiguousChannels(
            "a colour picture whose alpha is opaque everywhere".into(),
        ));
    }
    Ok(())
}

fn fault(error: DecodingError) -> RasterError {
    match error {
        DecodingError::IoError(error) => RasterError::from_io(error, "the picture"),
        DecodingError::LimitsExceeded => RasterError::AbsurdSize("the picture's chunks".into()),
        error => RasterError::Unfamiliar(format!("PNG: {error}")),
    }
}

#[cfg(test)]
mod tests;
