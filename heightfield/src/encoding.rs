//! Heights encoded in the colours of a picture, as in web maps.

use super::decoded::Decoded;
use super::{Encoding, RasterError, Samples};

impl Encoding {
    /// Returns the height of code 0, and the height of a step of the code, both in metres.
    pub(super) const fn metres(self) -> (f64, f64) {
        match self {
            Self::TerrainRgb => (-10_000.0, 0.1),
            Self::Terrarium => (-32_768.0, 1.0 / 256.0),
        }
    }

    const fn title(self) -> &'static str {
        match self {
            Self::TerrainRgb => "Terrain-RGB",
            Self::Terrarium => "Terrarium",
        }
    }
}

/// Returns 65536 R + 256 G + B.
pub(super) const fn code([red, green, blue]: [u8; 3]) -> i32 {
    i32::from_be_bytes([0, red, green, blue])
}

/// Returns the codes of three bands.
pub(super) fn codes([red, green, blue]: [Vec<u8>; 3]) -> Samples {
    let all = red.into_iter().zip(green).zip(blue);
    let codes: Vec<i32> = all
        .map(|((red, green), blue)| code([red, green, blue]))
        .collect();
    codes.into()
}

/// Returns the error for a picture without codes.
pub(super) fn no_codes(what: &str) -> RasterError {
    RasterError::NotAHeightField(format!(
        "{what}, and heights are encoded in pictures of red, green and blue of 8 bits"
    ))
}

impl Decoded {
    /// Interprets the samples as codes of heights. Code 0 is below all ground, so it is no-data.
    pub(super) fn decode_as_codes(&mut self, encoding: Encoding) {
        (self.offset, self.scale) = encoding.metres();
        self.no_data = Some(0.0);
        self.metres_per_vertical_unit = Some(1.0);
        self.format += &format!(", {} heights", encoding.title());
    }
}
