//! Esri's headers: a key and its value per line, for `.flt` grids and for `.bil`, `.bip` and `.bsq`
//! images.

use std::collections::HashMap;

use super::Header;
use super::layout::{Interleave, Layout};
use crate::decoded::Decoded;
use crate::ground_map::GroundMap;
use crate::numbers::{self, NoDataText};
use crate::read::StoredType;
use crate::{Endian, RasterError, SampleType};

/// Returns true if a text is such a header: it has the number of columns and rows.
pub(super) fn is_header(text: &str) -> bool {
    let keys = Keys::read(text);
    keys.0.contains_key("ncols") && keys.0.contains_key("nrows")
}

/// Values by lower-case key.
struct Keys(HashMap<String, String>);

/// Reads a header for data with an extension and a size in bytes. If it does not state the type,
/// the data's size defines the bytes of a sample: four and more are floats, as in GDAL, and
/// integers are signed if the no-data value is negative.
pub(super) fn read(text: &str, extension: &str, bytes: u64) -> Result<Header, RasterError> {
    let keys = Keys::read(text);
    let (columns, rows) = (keys.count("ncols")?, keys.count("nrows")?);
    let (columns, rows) = match (columns, rows) {
        (Some(columns), Some(rows)) if columns > 0 && rows > 0 => (columns, rows),
        _ => return Err(RasterError::damaged("it states no columns or no rows")),
    };
    let interleave = match keys.text("layout").or(match extension {
        "bip" => Some("bip"),
        "bsq" => Some("bsq"),
        _ => None,
    }) {
        None | Some("bil") => Interleave::Line,
        Some("bip") => Interleave::Pixel,
        Some("bsq") => Interleave::Sequential,
        Some(other) => return Err(RasterError::Unfamiliar(format!("layout {other}"))),
    };
    let bands = keys.count("nbands")?.unwrap_or(1).max(1);
    let skip = keys.bytes("skipbytes")?.unwrap_or(0);
    let samples = u64::from(columns) * u64::from(rows);
    let samples = samples.saturating_mul(bands.into());
    let by_length = bytes.checked_sub(skip).filter(|bytes| bytes % samples == 0);
    let by_length = by_length.map(|bytes| bytes / samples);
    let (stored, remark) = keys.stored(extension, by_length)?;
    let layout = Layout {
        columns,
        rows,
        bands,
        stored,
        endian: match keys.text("byteorder") {
            Some("m" | "msbfirst" | "big_endian") => Endian::Big,
            _ => Endian::Little,
        },
        interleave,
        skip,
        // For a single band, the rows of all bands and of the band are the same.
        row_bytes: keys.bytes("totalrowbytes")?,
        band_row_bytes: keys.bytes("bandrowbytes")?,
        band_gap: keys.bytes("bandgapbytes")?.unwrap_or(0),
    };
    let no_data = keys.no_data();
    let map = keys.map(rows)?;
    let unit = keys.text("zunits").map(str::to_owned);
    Ok(Header {
        format: match extension {
            "flt" => "Esri float grid",
            _ => "Esri band image",
        },
        layout,
        describe: Box::new(move |decoded: &mut Decoded| {
            decoded.no_data = no_data.value;
            decoded.remarks.extend(no_data.remark);
            decoded.remarks.extend(remark);
            decoded.set_unit(unit.as_deref());
            if let Some(map) = map {
                decoded.set_layout(map, None);
            }
            Ok(())
        }),
    })
}

impl Keys {
    fn read(text: &str) -> Self {
        let lines = text.trim_start_matches('\u{feff}').lines();
        let pairs = lines.filter_map(|line| {
            let (key, value) = line
                .trim()
                .split_once(|c: char| c.is_whitespace() || c == '=')?;
            let value = value.trim_matches(|c: char| c.is_whitespace() || c == '=');
            Some((key.to_lowercase(), value.to_lowercase()))
        });
        Self(pairs.collect())
    }

    fn text(&self, key: &str) -> Option<&str> {
        self.0.get(key).map(String::as_str)
    }

    fn number(&self, key: &str) -> Result<Option<f64>, RasterError> {
        let Some(text) = self.text(key) else {
            return Ok(None);
        };
        let wrong = || RasterError::damaged(format!("{key} is '{text}', not a number"));
        numbers::number(text).ok_or_else(wrong).map(Some)
    }

    fn bytes(&self, key: &str) -> Result<Option<u64>, RasterError> {
        let Some(number) = self.number(key)? else {
            return Ok(None);
        };
        match number.fract() == 0.0 && (0.0..9e15).contains(&number) {
            true => Ok(Some(number as u64)),
            false => Err(RasterError::damaged(format!("{key} is {number}"))),
        }
    }

    fn count(&self, key: &str) -> Result<Option<u32>, RasterError> {
        let Some(number) = self.bytes(key)? else {
            return Ok(None);
        };
        let absurd = |_| RasterError::AbsurdSize(format!("{key} is {number}"));
        u32::try_from(number).map(Some).map_err(absurd)
    }

    fn no_data(&self) -> NoDataText {
        let text = self.text("nodata").or(self.text("nodata_value"));
        text.map_or(NoDataText::default(), |text| numbers::no_data(text, 0, 1))
    }

    /// Returns the type of a sample, with a remark if it is not stated; `by_length` is the size of
    /// a sample by the data's size, bytes.
    fn stored(
        &self,
        extension: &str,
        by_length: Option<u64>,
    ) -> Result<(StoredType, Option<String>), RasterError> {
        let by_name = self.text("numbertype").map(number_type).transpose()?;
        let declared = self.count("nbits")?;
        let (bits, is_guess) = match (declared, by_name, by_length) {
            (Some(bits), Some((other, _)), _) if bits != other => {
                return Err(RasterError::damaged(format!(
                    "nbits is {bits} and numbertype is {}",
                    self.text("numbertype").unwrap_or_default()
                )));
            }
            (Some(bits), ..) | (None, Some((bits, _)), _) => (bits, false),
            (None, None, Some(bytes @ (1 | 2 | 4 | 8))) => (8 * bytes as u32, true),
            (None, None, _) => (if extension == "flt" { 32 } else { 8 }, false),
        };
        let negative = self.no_data().value.is_some_and(|value| value < 0.0);
        let stated_kind = self.text("pixeltype").map(|kind| match kind {
            kind if kind.starts_with('f') => 'f',
            kind if kind.starts_with('s') => 's',
            _ => 'u',
        });
        let is_float = bits >= 32 && (extension == "flt" || is_guess);
        let kind = stated_kind.or(by_name.map(|(_, kind)| kind));
        let kind = kind.unwrap_or(match (is_float, negative) {
            (true, _) => 'f',
            (false, true) => 's',
            (false, false) => 'u',
        });
        let stored = StoredType::Held(sample_type(kind, bits)?);
        let remark = (is_guess && extension != "flt").then(|| {
            let name = stored.memory_type().none().type_name();
            format!("its header states no type of samples: by the length of the data it is {name}")
        });
        Ok((stored, remark))
    }

    /// Returns the map, from the centre of the north-western sample (images) or the south-western
    /// corner (grids).
    fn map(&self, rows: u32) -> Result<Option<GroundMap>, RasterError> {
        let cell = self.number("cellsize")?;
        let side = |key| Ok::<_, RasterError>(self.number(key)?.or(cell));
        let Some((east, north)) = side("xdim")?.zip(side("ydim")?) else {
            return Ok(None);
        };
        let north_west = self.number("ulxmap")?.zip(self.number("ulymap")?);
        let place = |corner, centre, step: f64| {
            let by_centre = self.number(centre)?.map(|at| at - step / 2.0);
            Ok::<_, RasterError>(self.number(corner)?.or(by_centre))
        };
        let west = place("xllcorner", "xllcenter", east)?;
        let south_west = west.zip(place("yllcorner", "yllcenter", north)?);
        let map = match (north_west, south_west) {
            (Some((x, y)), _) => GroundMap::from_centre([x, east, 0.0], [y, 0.0, -north]),
            (None, Some(corner)) => GroundMap::from_south_west(corner, (east, north), rows),
            (None, None) => return Ok(None),
        };
        let nowhere = || RasterError::damaged("its cells have no size");
        map.ok_or_else(nowhere).map(Some)
    }
}

fn sample_type(kind: char, bits: u32) -> Result<SampleType, RasterError> {
    use SampleType::{F32, F64, I8, I16, I32, U8, U16, U32};
    Ok(match (kind, bits) {
        ('u', 8) => U8,
        ('s', 8) => I8,
        ('u', 16) => U16,
        ('s', 16) => I16,
        ('u', 32) => U32,
        ('s', 32) => I32,
        ('f', 32) => F32,
        ('f', 64) => F64,
        _ => {
            return Err(RasterError::Unsupported {
                format: "Esri band image",
                feature: format!("{bits} bits a sample"),
            });
        }
    })
}

/// Returns bits and kind of a type in NOAA's notation: `2_BYTE_INTEGER`, `4_BYTE_FLOAT`.
fn number_type(name: &str) -> Result<(u32, char), RasterError> {
    let (bytes, kind) = name.split_once("_byte_").unwrap_or_default();
    let kind = match kind {
        "float" | "real" => Some('f'),
        "integer" | "signed_integer" => Some('s'),
        "unsigned_integer" | "unsigned" => Some('u'),
        _ => None,
    };
    let bits = bytes
        .parse::<u32>()
        .ok()
        .and_then(|bytes| bytes.checked_mul(8));
    let unknown = || RasterError::damaged(format!("numbertype {name} is not supported"));
    bits.zip(kind).ok_or_else(unknown)
}
