//! Heights encoded in the colours of a picture, as in web maps.

use ::png::{BitDepth, ColorType};

use super::{fault, reader};
use crate::decoded::Decoded;
use crate::encoding::code;
use crate::input::FileBytes;
use crate::samples::NoDataMask;
use crate::{Encoding, RasterError, Samples};

/// Reads a picture whose colours encode heights. An alpha of 0 is no-data.
pub(super) fn decode(input: &FileBytes, encoding: Encoding) -> Result<Decoded, RasterError> {
    let codes = Codes::read(input)?;
    let mut decoded = Decoded::new("PNG".into(), codes.size, Samples::from(codes.codes));
    decoded.decode_as_codes(encoding);
    decoded.storage.set_no_data(Some(codes.transparent));
    Ok(decoded)
}

/// Converts the fault of ambiguous channels if the picture looks like encoded heights.
pub(super) fn suspect_encoded_heights(fault: RasterError, input: &FileBytes) -> RasterError {
    if !matches!(fault, RasterError::AmbiguousChannels(_)) {
        return fault;
    }
    let Ok(codes) = Codes::read(input) else {
        return fault;
    };
    let encodings = [Encoding::Terrarium, Encoding::TerrainRgb];
    let alike = encodings
        .into_iter()
        .find(|encoding| codes.resembles(*encoding));
    alike.map_or(fault, RasterError::EncodedPicture)
}

/// 65536 R + 256 G + B of every pixel.
struct Codes {
    size: (u32, u32),
    codes: Vec<i32>,
    /// Pixels whose alpha is 0.
    transparent: NoDataMask,
}

impl Codes {
    fn read(input: &FileBytes) -> Result<Self, RasterError> {
        let mut reader = reader(input)?;
        let info = reader.info();
        let (size, color, depth) = ((info.width, info.height), info.color_type, info.bit_depth);
        if !matches!(color, ColorType::Rgb | ColorType::Rgba) || depth != BitDepth::Eight {
            return Err(RasterError::NotAHeightField(
                "heights are encoded in pictures of red, green and blue of 8 bits".into(),
            ));
        }
        let pixel = color.samples();
        input.check_size(size.0, size.1, pixel as u64)?;
        let mut frame = vec![0; reader.output_buffer_size().unwrap_or(0)];
        reader.next_frame(&mut frame).map_err(fault)?;
        let count = size.0 as usize * size.1 as usize;
        let mut codes = Vec::with_capacity(count);
        let mut transparent = NoDataMask::with_capacity(count);
        for (index, bytes) in frame.chunks_exact(pixel).take(count).enumerate() {
            codes.push(code([bytes[0], bytes[1], bytes[2]]));
            transparent.set(index, bytes.get(3) == Some(&0));
        }
        Ok(Self {
            size,
            codes,
            transparent,
        })
    }

    /// Returns true if the heights are possible on Earth, and mostly near their neighbours', unlike
    /// the colours of a photograph.
    fn resembles(&self, encoding: Encoding) -> bool {
        /// Range from below the deepest sea to above the highest mountain, m.
        const GROUND: std::ops::RangeInclusive<f64> = -11_500.0..=9_000.0;
        /// Height difference of neighbours that is steep even for cells of a kilometre, m.
        const STEEP: f64 = 700.0;
        let (lowest, step) = encoding.metres();
        let height = |code: i32| lowest + f64::from(code) * step;
        let has_height = |code: i32| code != 0;
        let rows = self.codes.chunks(self.size.0 as usize);
        let pairs = || rows.clone().flat_map(|row| row.windows(2));
        let both = || pairs().filter(|pair| has_height(pair[0]) && has_height(pair[1]));
        let steep = both().filter(|pair| (height(pair[1]) - height(pair[0])).abs() > STEEP);
        let all = both().count();
        let on_earth = self.codes.iter().filter(|code| has_height(**code));
        let on_earth = on_earth
            .map(|code| height(*code))
            .all(|height| GROUND.contains(&height));
        // A uniform colour proves nothing.
        let first = self.codes.first();
        let varies = self.codes.iter().any(|code| Some(code) != first);
        varies && on_earth && all > 0 && 100 * steep.count() <= all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{OpenOptions, Raster};

    const SIDE: u32 = 32;

    fn picture(colour: impl Fn(u32, u32) -> [u8; 4], with_alpha: bool) -> FileBytes {
        let mut file = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut file, SIDE, SIDE);
        encoder.set_color(if with_alpha {
            ColorType::Rgba
        } else {
            ColorType::Rgb
        });
        encoder.set_depth(BitDepth::Eight);
        let channels = if with_alpha { 4 } else { 3 };
        let pixels = (0..SIDE).flat_map(|row| (0..SIDE).map(move |column| (column, row)));
        let bytes: Vec<u8> = pixels
            .flat_map(|(column, row)| colour(column, row).into_iter().take(channels))
            .collect();
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(&bytes).expect("the samples");
        writer.finish().expect("the end");
        FileBytes::unpacked("tile.png", file)
    }

    /// Returns heights of hills from a sea floor to a mountain, m.
    fn ground(column: u32, row: u32) -> f64 {
        -200.0 + 37.0 * f64::from(column) + 11.0 * f64::from(row * row % 97)
    }

    fn encoded(height: f64, encoding: Encoding) -> [u8; 4] {
        let (lowest, step) = encoding.metres();
        let [_, r, g, b] = (((height - lowest) / step).round() as u32).to_be_bytes();
        [r, g, b, 255]
    }

    fn open(input: &FileBytes, encoding: Option<Encoding>) -> Result<Raster, RasterError> {
        let options = OpenOptions {
            encoding,
            ..OpenOptions::default()
        };
        Raster::checked((super::super::FORMAT.decode)(input, &options)?, None)
    }

    #[test]
    fn heights_round_to_step_and_transparent_or_black_is_no_data() {
        for (encoding, step) in [
            (Encoding::TerrainRgb, 0.1),
            (Encoding::Terrarium, 1.0 / 256.0),
        ] {
            let colour = |column, row| match (column, row) {
                (3, 4) => [0, 0, 0, 255],
                (5, 6) => [1, 134, 160, 0],
                _ => encoded(ground(column, row), encoding),
            };
            for with_alpha in [true, false] {
                let raster = open(&picture(colour, with_alpha), Some(encoding)).expect("heights");
                let no_data = 1 + u64::from(with_alpha);
                assert_eq!(raster.summary().no_data, no_data, "{encoding:?}");
                assert!(raster.height(3, SIDE - 1 - 4).is_nan());
                for (column, row) in [(0, 0), (7, 30), (31, 31)] {
                    let height = raster.height(column, SIDE - 1 - row);
                    assert!(
                        (height - ground(column, row)).abs() <= step / 2.0 + 1e-9,
                        "{height}"
                    );
                }
                assert_eq!(raster.stated_metres_per_vertical_unit(), Some(1.0));
            }
        }
    }

    #[test]
    fn encoded_picture_is_distinguished_from_photograph() {
        for encoding in [Encoding::TerrainRgb, Encoding::Terrarium] {
            for with_alpha in [true, false] {
                let tile = picture(
                    |column, row| encoded(ground(column, row), encoding),
                    with_alpha,
                );
                let fault = open(&tile, None).expect_err("not without the option");
                assert!(
                    matches!(fault, RasterError::EncodedPicture(found) if found == encoding),
                    "{encoding:?}: {fault}"
                );
            }
        }
        let photograph = picture(
            |c, r| [(c * 8) as u8, (r * 8) as u8, ((c * r) % 256) as u8, 255],
            false,
        );
        let fault = open(&photograph, None).expect_err("a photograph");
        assert!(
            matches!(fault, RasterError::AmbiguousChannels(_)),
            "{fault}"
        );
        let flat = picture(|_, _| [128, 0, 0, 255], false);
        assert!(matches!(
            open(&flat, None),
            Err(RasterError::AmbiguousChannels(_))
        ));
    }

    #[test]
    fn grey_picture_encodes_no_heights() {
        let mut file = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut file, 2, 2);
        encoder.set_color(ColorType::Grayscale);
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(&[1, 2, 3, 4]).expect("the samples");
        writer.finish().expect("the end");
        let grey = FileBytes::unpacked("grey.png", file);
        let fault = open(&grey, Some(Encoding::Terrarium)).expect_err("grey");
        assert!(matches!(fault, RasterError::NotAHeightField(_)), "{fault}");
    }
}
