//! SRTM height tiles: big-endian 16-bit samples without a header. Size and place follow from the
//! file's length and name.

use crate::decoded::Decoded;
use crate::file_layout::RasterType;
use crate::format::{Claim, Format, Parts};
use crate::ground_map::GroundMap;
use crate::input::FileBytes;
use crate::placed::GroundUnit;
use crate::raw_samples::RawSamples;
use crate::read::StoredType;
use crate::{
    CellSize, CellUnit, Certainty, Endian, OpenOptions, RasterError, ReferenceSystem, SampleType,
};

/// SRTM tiles, which can only be recognised by name.
pub(super) const FORMAT: Format = Format {
    name: "SRTM",
    begins: |_| false,
    extensions: &[("hgt", Claim::Certain)],
    parts: Parts::One,
    decode,
};

/// SRTM's no-data value.
const VOID: f64 = -32768.0;

/// Decodes a tile. It covers one degree by one degree and shares its border samples with its
/// neighbours.
fn decode(input: &FileBytes, options: &OpenOptions) -> Result<Decoded, RasterError> {
    let (columns, rows) = size(input.len())?;
    let stored = StoredType::Held(SampleType::I16);
    let plain = RawSamples::packed((columns, rows), stored, Endian::Big, 0);
    let format = "SRTM height tile, int16".to_owned();
    let mut decoded = Decoded::new(format, (columns, rows), plain.storage(input, options)?);
    decoded.no_data = Some(VOID);
    decoded.file_layout.raster_type = Some(RasterType::Point);
    decoded.metres_per_vertical_unit = Some(1.0);
    // SRTM's heights are above the geoid EGM96, its coordinates in WGS 84.
    decoded.set_vertical_datum(5773);
    decoded.system = ReferenceSystem::from_code(4326);
    let cells = [columns, rows].map(|samples| f64::from(samples.max(2) - 1));
    let (east, north) = (1.0 / cells[0], 1.0 / cells[1]);
    let map = corner(input.name()).and_then(|(west, south)| {
        GroundMap::from_centre([west, east, 0.0], [south + 1.0, 0.0, -north])
    });
    if let Some(map) = map {
        decoded.set_layout(map, Some(GroundUnit::DEGREE));
    } else {
        decoded.cell = Some(CellSize {
            certainty: Certainty::Assumed,
            ..CellSize::stated((east, north), CellUnit::Degree, None)
        });
        decoded.remarks.push(
            "the name does not state the tile's place (as N44W072.hgt does): it is read as a degree \
             high, with square cells (--input cell=30m)"
                .into(),
        );
    }
    Ok(decoded)
}

/// Returns the columns and rows of a tile of a size in bytes.
fn size(bytes: u64) -> Result<(u32, u32), RasterError> {
    // Above 50° some producers halve the columns.
    if bytes == 2 * 1801 * 3601 {
        return Ok((1801, 3601));
    }
    let side = (bytes / 2).isqrt();
    match u32::try_from(side) {
        Ok(side) if u64::from(side) * u64::from(side) * 2 == bytes => Ok((side, side)),
        _ => Err(RasterError::Truncated(format!(
            "{bytes} bytes are no square of 16-bit samples; a 3 arc-second tile \
             has 2884802, a 1 arc-second tile 25934402"
        ))),
    }
}

/// Returns longitude and latitude of the tile's south-western sample in degrees, from a name as
/// `N44W072.hgt` or `s05e100.SRTMGL1.hgt`.
fn corner(name: &str) -> Option<(f64, f64)> {
    let name = name.to_ascii_uppercase();
    let bytes = name.as_bytes();
    let digits = |range: std::ops::Range<usize>| -> Option<f64> {
        let text = name.get(range)?;
        let all_digits = text.bytes().all(|byte| byte.is_ascii_digit());
        text.parse().ok().filter(|_| all_digits)
    };
    // A longer name, as N45W074T86.hgt, means a part of a tile.
    if bytes.get(7).is_some_and(u8::is_ascii_alphanumeric) {
        return None;
    }
    let latitude = digits(1..3).filter(|&degrees| degrees <= 90.0)?;
    let longitude = digits(4..7).filter(|&degrees| degrees <= 180.0)?;
    let signed = |letter, [plus, minus]: [u8; 2], degrees: f64| match letter {
        letter if letter == plus => Some(degrees),
        letter if letter == minus => Some(-degrees),
        _ => None,
    };
    let west = signed(bytes[3], *b"EW", longitude)?;
    Some((west, signed(bytes[0], *b"NS", latitude)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_name_determines_corner_or_is_rejected() {
        assert_eq!(corner("N44W072.hgt"), Some((-72.0, 44.0)));
        assert_eq!(corner("s05e100.SRTMGL1.hgt"), Some((100.0, -5.0)));
        assert_eq!(corner("N45W074T86.hgt"), None);
        assert_eq!(corner("n45w0741.hgt"), None);
        assert_eq!(corner("N45W074_v3.hgt"), Some((-74.0, 45.0)));
        assert_eq!(corner("mountain.hgt"), None);
        assert_eq!(corner("N99E000.hgt"), None);
        assert_eq!(corner("N44X072.hgt"), None);
        assert_eq!(corner("é4W072.hgt"), None);
        assert_eq!(corner(""), None);
    }

    #[test]
    fn file_length_determines_size_or_is_rejected() {
        assert_eq!(size(2 * 1201 * 1201).unwrap(), (1201, 1201));
        assert_eq!(size(2 * 3601 * 3601).unwrap(), (3601, 3601));
        assert_eq!(size(2 * 1801 * 3601).unwrap(), (1801, 3601));
        assert_eq!(size(2 * 5 * 5).unwrap(), (5, 5));
        assert!(size(2 * 5 * 5 + 1).is_err());
        assert!(size(2 * 5 * 6).is_err());
    }
}
