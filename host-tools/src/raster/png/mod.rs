//! PNG pictures: grey, grey with holes, or the height in one channel of a
//! colour picture.

use std::io::{BufRead, Seek};

use ::png::{BitDepth, ColorType, Decoder, DecodingError, Limits, Reader, Transformations};

use super::archive::DEFLATE_RATIO;
use super::input::Input;
use super::samples::HoleMask;
use super::{Decoded, Fault, PngChannel, Samples};

/// Bytes that PNG's own chunks may take (text, profiles, tables).
const CHUNK_BYTES: usize = 64 << 20;

/// Reads one channel of a picture as heights.
///
/// - Grey: the grey is the height. With alpha, a sample of alpha 0 is a hole and
///   any other alpha means nothing.
/// - Colour with alpha: the alpha is the height, as in the paper's data, 0 being
///   a height like any other. An alpha that is opaque everywhere marks a
///   photograph, not a height field.
/// - Colour without alpha, or a palette: not a height field.
///
/// `channel` overrides this choice.
pub(super) fn decode(input: &Input, channel: Option<PngChannel>) -> Result<Decoded, Fault> {
    let limits = Limits { bytes: CHUNK_BYTES };
    let mut decoder = Decoder::new_with_limits(input.reader()?, limits);
    decoder.set_transformations(Transformations::IDENTITY);
    decoder.ignore_checksums(false);
    let mut reader = decoder.read_info().map_err(fault)?;
    let picture = Picture::new(&reader, input.len())?;
    let chosen = picture.choose(channel)?;
    let channels = read_channels(&mut reader, &picture, chosen)?;
    if channel.is_none() && chosen.height == PngChannel::Alpha {
        refuse_opaque(&channels.samples)?;
    }
    let format = format!("PNG, {}-bit {}", picture.bits, chosen.described(&picture));
    let mut decoded = Decoded::new(format, picture.columns, picture.rows, channels.samples);
    decoded.mask = channels.mask;
    Ok(decoded)
}

/// What the header says, checked.
struct Picture {
    columns: u32,
    rows: u32,
    bits: u8,
    color: ColorType,
    interlaced: bool,
}

/// Which channel is the height, and which marks holes.
#[derive(Clone, Copy)]
struct Choice {
    height: PngChannel,
    height_index: usize,
    hole_index: Option<usize>,
}

impl Picture {
    fn new<R: BufRead + Seek>(reader: &Reader<R>, file_bytes: u64) -> Result<Self, Fault> {
        let info = reader.info();
        let picture = Self {
            columns: info.width,
            rows: info.height,
            bits: match info.bit_depth {
                BitDepth::Eight => 8,
                BitDepth::Sixteen => 16,
                few => {
                    return Err(Fault::Unsupported {
                        format: "PNG",
                        feature: format!("{} bits a sample", few as u8),
                    });
                }
            },
            color: info.color_type,
            interlaced: info.interlaced,
        };
        let bytes = u64::from(picture.columns)
            .checked_mul(u64::from(picture.rows))
            .and_then(|samples| samples.checked_mul(picture.sample_bytes() * picture.channels()))
            .filter(|&bytes| bytes <= file_bytes.saturating_mul(DEFLATE_RATIO));
        if bytes.is_none() {
            return Err(Fault::AbsurdSize(format!(
                "{} × {} samples in a file of {file_bytes} bytes",
                picture.columns, picture.rows
            )));
        }
        Ok(picture)
    }

    fn channels(&self) -> u64 {
        self.color.samples() as u64
    }

    fn sample_bytes(&self) -> u64 {
        u64::from(self.bits) / 8
    }

    fn choose(&self, asked: Option<PngChannel>) -> Result<Choice, Fault> {
        use PngChannel::{Alpha, Blue, Green, Grey, Red};
        let present: &[PngChannel] = match self.color {
            ColorType::Grayscale => &[Grey],
            ColorType::GrayscaleAlpha => &[Grey, Alpha],
            ColorType::Rgb => &[Red, Green, Blue],
            ColorType::Rgba => &[Red, Green, Blue, Alpha],
            ColorType::Indexed => {
                return Err(Fault::NotAHeightField("a picture with a palette".into()));
            }
        };
        let height = match (asked, self.color) {
            (Some(channel), _) => channel,
            (None, ColorType::Rgb) => {
                return Err(Fault::AmbiguousChannels("a colour picture".into()));
            }
            (None, ColorType::Rgba) => Alpha,
            (None, _) => Grey,
        };
        let find = |wanted| present.iter().position(|&channel| channel == wanted);
        let height_index = find(height).ok_or_else(|| {
            Fault::AmbiguousChannels(format!("the picture has no {height:?} channel"))
        })?;
        Ok(Choice {
            height,
            height_index,
            hole_index: find(Alpha).filter(|_| height == Grey),
        })
    }
}

impl Choice {
    fn described(self, picture: &Picture) -> String {
        match (self.height, picture.color) {
            (PngChannel::Grey, ColorType::GrayscaleAlpha) => "grey, alpha 0 is no data".into(),
            (PngChannel::Grey, _) => "grey".into(),
            (channel, _) => format!("height in {}", format!("{channel:?}").to_lowercase()),
        }
    }
}

struct Channels {
    samples: Samples,
    mask: Option<HoleMask>,
}

/// Reads row by row, keeping the chosen channel only; an interlaced picture has
/// to be put together first.
fn read_channels<R: BufRead + Seek>(
    reader: &mut Reader<R>,
    picture: &Picture,
    chosen: Choice,
) -> Result<Channels, Fault> {
    let count = picture.columns as usize * picture.rows as usize;
    let mut channels = Channels {
        samples: if picture.bits == 8 {
            Samples::U8(Vec::with_capacity(count))
        } else {
            Samples::U16(Vec::with_capacity(count))
        },
        mask: chosen.hole_index.map(|_| HoleMask::new(count)),
    };
    let stride = picture.channels() as usize * picture.sample_bytes() as usize;
    let row_bytes = stride * picture.columns as usize;
    if picture.interlaced {
        let mut frame = vec![0; reader.output_buffer_size().unwrap_or(0)];
        reader.next_frame(&mut frame).map_err(fault)?;
        for row in frame.chunks_exact(row_bytes) {
            channels.take_row(row, stride, chosen);
        }
    } else {
        while let Some(row) = reader.next_row().map_err(fault)? {
            channels.take_row(row.data(), stride, chosen);
        }
    }
    Ok(channels)
}

impl Channels {
    fn take_row(&mut self, row: &[u8], stride: usize, chosen: Choice) {
        let first = self.samples.len();
        let texels = row.chunks_exact(stride);
        match &mut self.samples {
            Samples::U8(values) => values.extend(texels.map(|texel| texel[chosen.height_index])),
            Samples::U16(values) => {
                values.extend(texels.map(|texel| wide(texel, chosen.height_index)));
            }
            _ => unreachable!("a PNG has 8 or 16 bits a sample"),
        }
        let Some((mask, alpha)) = self.mask.as_mut().zip(chosen.hole_index) else {
            return;
        };
        let wide_samples = matches!(self.samples, Samples::U16(_));
        for (index, texel) in (first..).zip(row.chunks_exact(stride)) {
            let alpha = if wide_samples {
                wide(texel, alpha)
            } else {
                u16::from(texel[alpha])
            };
            if alpha == 0 {
                mask.set(index);
            }
        }
    }
}

fn wide(texel: &[u8], channel: usize) -> u16 {
    u16::from_be_bytes([texel[2 * channel], texel[2 * channel + 1]])
}

/// A photograph's alpha is opaque everywhere: that is no relief.
fn refuse_opaque(alpha: &Samples) -> Result<(), Fault> {
    let opaque = match alpha {
        Samples::U8(values) => values.iter().all(|&value| value == u8::MAX),
        Samples::U16(values) => values.iter().all(|&value| value == u16::MAX),
        _ => false,
    };
    if opaque {
        return Err(Fault::AmbiguousChannels(
            "a colour picture whose alpha is opaque everywhere".into(),
        ));
    }
    Ok(())
}

fn fault(error: DecodingError) -> Fault {
    match error {
        DecodingError::IoError(error) => Fault::from_io(error, "the picture"),
        DecodingError::LimitsExceeded => Fault::AbsurdSize("the picture's chunks".into()),
        DecodingError::Format(error) => Fault::Damaged(format!("PNG: {error}")),
        DecodingError::Parameter(error) => Fault::Damaged(format!("PNG: {error}")),
    }
}

#[cfg(test)]
mod tests;
