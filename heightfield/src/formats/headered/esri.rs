//! Esri's headers: a key and its value a line, of `.flt` grids and of `.bil`, `.bip` and
//! `.bsq` images.

use std::collections::HashMap;

use super::Header;
use super::layout::{Interleave, Layout};
use crate::decoded::Decoded;
use crate::ground_map::GroundMap;
use crate::read::Stored;
use crate::{BadRaster, Endian, SampleType};

/// Whether a text is such a header: it says how many columns and rows there are.
pub(super) fn is_header(text: &str) -> bool {
    let keys = Keys::read(text);
    keys.0.contains_key("ncols") && keys.0.contains_key("nrows")
}

/// The values by their keys in lower case.
struct Keys(HashMap<String, String>);

/// Reads a header for data with an extension. Where it does not say, a `.flt` has single
/// floats, and other integers have a sign when the no-data value has one.
pub(super) fn read(text: &str, extension: &str) -> Result<Header, BadRaster> {
    let keys = Keys::read(text);
    let (columns, rows) = (keys.count("ncols")?, keys.count("nrows")?);
    let (columns, rows) = match (columns, rows) {
        (Some(columns), Some(rows)) if columns > 0 && rows > 0 => (columns, rows),
        _ => return Err(BadRaster::damaged("it gives no columns or no rows")),
    };
    let interleave = match keys.text("layout").or(match extension {
        "bip" => Some("bip"),
        "bsq" => Some("bsq"),
        _ => None,
    }) {
        None | Some("bil") => Interleave::Line,
        Some("bip") => Interleave::Pixel,
        Some("bsq") => Interleave::Sequential,
        Some(other) => return Err(BadRaster::Unfamiliar(format!("layout {other}"))),
    };
    let layout = Layout {
        columns,
        rows,
        bands: keys.count("nbands")?.unwrap_or(1).max(1),
        stored: keys.stored(extension)?,
        endian: match keys.text("byteorder") {
            Some("m" | "msbfirst" | "big_endian") => Endian::Big,
            _ => Endian::Little,
        },
        interleave,
        skip: keys.bytes("skipbytes")?.unwrap_or(0),
        // Of one band the rows of all bands and of the band are the same.
        row_bytes: keys.bytes("totalrowbytes")?,
        band_row_bytes: keys.bytes("bandrowbytes")?,
        band_gap: keys.bytes("bandgapbytes")?.unwrap_or(0),
    };
    let no_data = keys.number("nodata")?.or(keys.number("nodata_value")?);
    let map = keys.map(rows)?;
    Ok(Header {
        format: match extension {
            "flt" => "Esri float grid",
            _ => "Esri band image",
        },
        layout,
        describe: Box::new(move |decoded: &mut Decoded| {
            decoded.no_data = no_data;
            if let Some(map) = map {
                decoded.lay_out(map, None);
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

    fn number(&self, key: &str) -> Result<Option<f64>, BadRaster> {
        let Some(text) = self.text(key) else {
            return Ok(None);
        };
        let number = text.replace(',', ".").parse();
        number
            .map(Some)
            .map_err(|_| BadRaster::damaged(format!("{key} is '{text}', not a number")))
    }

    fn bytes(&self, key: &str) -> Result<Option<u64>, BadRaster> {
        let Some(number) = self.number(key)? else {
            return Ok(None);
        };
        match number.fract() == 0.0 && (0.0..9e15).contains(&number) {
            true => Ok(Some(number as u64)),
            false => Err(BadRaster::damaged(format!("{key} is {number}"))),
        }
    }

    fn count(&self, key: &str) -> Result<Option<u32>, BadRaster> {
        let Some(number) = self.bytes(key)? else {
            return Ok(None);
        };
        let absurd = |_| BadRaster::AbsurdSize(format!("{key} is {number}"));
        u32::try_from(number).map(Some).map_err(absurd)
    }

    fn stored(&self, extension: &str) -> Result<Stored, BadRaster> {
        use SampleType::{F32, F64, I8, I16, I32, U8, U16, U32};
        let is_flt = extension == "flt";
        let bits = self.count("nbits")?.unwrap_or(if is_flt { 32 } else { 8 });
        let negative = self.number("nodata")?.or(self.number("nodata_value")?);
        let kind = match self.text("pixeltype") {
            Some(kind) if kind.starts_with('f') => 'f',
            Some(kind) if kind.starts_with('s') => 's',
            Some(_) => 'u',
            None if is_flt => 'f',
            None if negative.is_some_and(|value| value < 0.0) => 's',
            None => 'u',
        };
        Ok(Stored::Held(match (kind, bits) {
            ('u', 8) => U8,
            ('s', 8) => I8,
            ('u', 16) => U16,
            ('s', 16) => I16,
            ('u', 32) => U32,
            ('s', 32) => I32,
            ('f', 32) => F32,
            ('f', 64) => F64,
            _ => {
                return Err(BadRaster::Unsupported {
                    format: "Esri band image",
                    feature: format!("{bits} bits a sample"),
                });
            }
        }))
    }

    /// By the centre of the north-western sample (images) or the south-western corner
    /// (grids).
    fn map(&self, rows: u32) -> Result<Option<GroundMap>, BadRaster> {
        let cell = self.number("cellsize")?;
        let side = |key| Ok::<_, BadRaster>(self.number(key)?.or(cell));
        let Some((east, north)) = side("xdim")?.zip(side("ydim")?) else {
            return Ok(None);
        };
        let north_west = self.number("ulxmap")?.zip(self.number("ulymap")?);
        let place = |corner, centre, step: f64| {
            let by_centre = self.number(centre)?.map(|at| at - step / 2.0);
            Ok::<_, BadRaster>(self.number(corner)?.or(by_centre))
        };
        let west = place("xllcorner", "xllcenter", east)?;
        let south_west = west.zip(place("yllcorner", "yllcenter", north)?);
        let map = match (north_west, south_west) {
            (Some((x, y)), _) => GroundMap::from_centre([x, east, 0.0], [y, 0.0, -north]),
            (None, Some(corner)) => GroundMap::from_south_west(corner, (east, north), rows),
            (None, None) => return Ok(None),
        };
        let nowhere = || BadRaster::damaged("its cells have no size");
        map.ok_or_else(nowhere).map(Some)
    }
}
