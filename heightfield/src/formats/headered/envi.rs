//! ENVI's headers: `key = value`, where a value in braces may go over several lines.

use std::collections::HashMap;

use super::Header;
use super::layout::{Interleave, Layout};
use crate::crs::ReferenceSystem;
use crate::decoded::Decoded;
use crate::geometry::metres_in;
use crate::ground_map::GroundMap;
use crate::placed::GroundUnit;
use crate::read::Stored;
use crate::{BadRaster, Certainty, Endian, SampleType};

/// Whether a text is such a header.
pub(super) fn is_header(text: &str) -> bool {
    text.trim_start_matches('\u{feff}')
        .trim_start()
        .starts_with("ENVI")
}

/// Reads a header; scale and offset are those of a band.
pub(super) fn read(text: &str, band: u32) -> Result<Header, BadRaster> {
    let keys = Keys::read(text);
    if keys
        .text("file compression")
        .is_some_and(|packed| packed != "0")
    {
        return Err(BadRaster::Unsupported {
            format: "ENVI",
            feature: "a compressed file".into(),
        });
    }
    let layout = Layout {
        columns: keys.size("samples")?,
        rows: keys.size("lines")?,
        bands: keys.number("bands")?.unwrap_or(1.0).max(1.0) as u32,
        stored: keys.stored()?,
        endian: match keys.text("byte order") {
            Some("1") => Endian::Big,
            _ => Endian::Little,
        },
        interleave: match keys.text("interleave").map(str::to_lowercase).as_deref() {
            Some("bil") => Interleave::Line,
            Some("bip") => Interleave::Pixel,
            _ => Interleave::Sequential,
        },
        skip: keys.number("header offset")?.unwrap_or(0.0).max(0.0) as u64,
        row_bytes: None,
        band_row_bytes: None,
        band_gap: 0,
    };
    Ok(Header {
        format: "ENVI",
        layout,
        describe: Box::new(move |decoded: &mut Decoded| describe(&keys, band, decoded)),
    })
}

fn describe(keys: &Keys, band: u32, decoded: &mut Decoded) -> Result<(), BadRaster> {
    decoded.no_data = keys.number("data ignore value")?;
    let of_band = |key: &str| {
        let values = keys.list(key)?;
        values.get(band as usize - 1)?.parse::<f64>().ok()
    };
    decoded.scale = of_band("data gain values").unwrap_or(1.0);
    decoded.offset = of_band("data offset values").unwrap_or(0.0);
    if let Some(wkt) = keys.text("coordinate system string") {
        let (system, vertical) = ReferenceSystem::from_wkt(wkt);
        decoded.system = system;
        decoded.set_vertical(vertical, None);
    }
    let Some(info) = keys.list("map info") else {
        return Ok(());
    };
    let map_info = MapInfo::read(&info)
        .ok_or_else(|| BadRaster::damaged("its map info is not a place and a cell"))?;
    // Zone and datum tell the code that Esri's texts leave out.
    let has_code = |system: &ReferenceSystem| system.code().is_some();
    if !decoded.system.as_ref().is_some_and(has_code) {
        let by_code = map_info.code.and_then(ReferenceSystem::from_code);
        decoded.system = by_code.or(decoded.system.take());
    }
    decoded.lay_out(map_info.map, map_info.unit);
    Ok(())
}

/// The values by their keys in lower case, without braces.
struct Keys(HashMap<String, String>);

impl Keys {
    fn read(text: &str) -> Self {
        let mut values = HashMap::new();
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            let Some((key, value)) = line.split_once('=') else {
                continue;
            };
            let mut value = value.trim().to_owned();
            while value.starts_with('{') && !value.contains('}') {
                let Some(more) = lines.next() else { break };
                value.push(' ');
                value.push_str(more.trim());
            }
            let value = value.trim_start_matches('{');
            let value = value.split_once('}').map_or(value, |(inside, _)| inside);
            values.insert(key.trim().to_lowercase(), value.trim().to_owned());
        }
        Self(values)
    }

    fn text(&self, key: &str) -> Option<&str> {
        self.0.get(key).map(String::as_str)
    }

    fn list(&self, key: &str) -> Option<Vec<&str>> {
        Some(self.text(key)?.split(',').map(str::trim).collect())
    }

    fn number(&self, key: &str) -> Result<Option<f64>, BadRaster> {
        let Some(text) = self.text(key) else {
            return Ok(None);
        };
        let wrong = |_| BadRaster::damaged(format!("{key} is '{text}', not a number"));
        text.parse().map(Some).map_err(wrong)
    }

    fn size(&self, key: &str) -> Result<u32, BadRaster> {
        match self.number(key)? {
            None => Err(BadRaster::damaged(format!("it has no {key}"))),
            Some(count) if count.fract() != 0.0 || count < 1.0 => {
                Err(BadRaster::damaged(format!("{key} is {count}")))
            }
            Some(count) if count > f64::from(u32::MAX) => {
                Err(BadRaster::AbsurdSize(format!("{key} is {count}")))
            }
            Some(count) => Ok(count as u32),
        }
    }

    fn stored(&self) -> Result<Stored, BadRaster> {
        use SampleType::{F32, F64, I16, I32, U8, U16, U32};
        let held = match self.text("data type").unwrap_or("none") {
            "1" => U8,
            "2" => I16,
            "3" => I32,
            "4" => F32,
            "5" => F64,
            "12" => U16,
            "13" => U32,
            "14" => return Ok(Stored::I64),
            "15" => return Ok(Stored::U64),
            "6" | "9" => {
                let what = "complex numbers (ENVI data type 6 or 9)";
                return Err(BadRaster::NotAHeightField(what.into()));
            }
            other => return Err(BadRaster::damaged(format!("data type is {other}"))),
        };
        Ok(Stored::Held(held))
    }
}

/// `{projection, column, row, x, y, dx, dy, …, datum, units=…, rotation=…}`: the place
/// of a pixel's corner, counted from 1.
struct MapInfo {
    map: GroundMap,
    unit: Option<GroundUnit>,
    /// EPSG's code of the reference system, where zone and datum tell it.
    code: Option<u16>,
}

impl MapInfo {
    fn read(info: &[&str]) -> Option<Self> {
        let numbers: Vec<f64> = info
            .get(1..7)?
            .iter()
            .map(|word| word.parse().ok())
            .collect::<Option<_>>()?;
        let &[column, row, x, y, east, north] = numbers.as_slice() else {
            return None;
        };
        let option = |key: &str| {
            let values = info.iter().filter_map(|word| word.split_once('='));
            let mut found = values.filter(|(name, _)| name.trim().eq_ignore_ascii_case(key));
            found.next().map(|(_, value)| value.trim())
        };
        let angle: f64 = option("rotation")
            .and_then(|angle| angle.parse().ok())
            .unwrap_or(0.0);
        let (sin, cos) = angle.to_radians().sin_cos();
        let (per_column, per_row) = ([east * cos, east * sin], [north * sin, -north * cos]);
        let origin = |at: f64, axis: usize| {
            at - (column - 1.0) * per_column[axis] - (row - 1.0) * per_row[axis]
        };
        let of_axis = |at, axis: usize| [origin(at, axis), per_column[axis], per_row[axis]];
        let unit = match option("units").unwrap_or_default() {
            "Degrees" | "degrees" => Some(GroundUnit::DEGREE),
            "Seconds" | "seconds" => Some(GroundUnit::angle(1.0 / 3600.0)),
            "Minutes" | "minutes" => Some(GroundUnit::angle(1.0 / 60.0)),
            name => metres_in(name).map(|metres| GroundUnit::length(metres, Certainty::Stated)),
        };
        Some(Self {
            map: GroundMap::new(of_axis(x, 0), of_axis(y, 1))?,
            unit,
            code: system_code(info),
        })
    }
}

/// EPSG's code of UTM zones and plain degrees on WGS 84, NAD27 and NAD83.
fn system_code(info: &[&str]) -> Option<u16> {
    let has = |wanted: &str| info.iter().any(|word| word.eq_ignore_ascii_case(wanted));
    let (wgs84, nad27, nad83) = (
        has("WGS-84"),
        has("North America 1927"),
        has("North America 1983"),
    );
    match info.first()?.to_lowercase().as_str() {
        "geographic lat/lon" if wgs84 => Some(4326),
        "geographic lat/lon" if nad27 => Some(4267),
        "geographic lat/lon" if nad83 => Some(4269),
        "utm" => {
            let zone = info.get(7)?.parse::<u16>().ok();
            let zone = zone.filter(|zone| (1..=60).contains(zone))?;
            match has("South") {
                true if wgs84 => Some(32_700 + zone),
                false if wgs84 => Some(32_600 + zone),
                false if nad27 && zone <= 22 => Some(26_700 + zone),
                false if nad83 && zone <= 23 => Some(26_900 + zone),
                _ => None,
            }
        }
        _ => None,
    }
}
