//! USGS ASCII digital elevation models: 1024-byte records of fixed columns. A
//! header (record A), then one profile after another from west to east, each from
//! south to north (records B).

use std::str::FromStr;

use crate::decoded::{Decoded, sides};
use crate::format::{Claim, Format, Parts};
use crate::ground_map::GroundMap;
use crate::input::FileBytes;
use crate::placed::GroundUnit;
use crate::{BadRaster, Certainty, ReferenceSystem, Samples};

/// USGS ASCII digital elevation models.
pub(super) const FORMAT: Format = Format {
    name: "USGS DEM",
    begins: looks_like_header,
    extensions: &[("dem", Claim::Decides)],
    parts: Parts::One,
    decode: |input, _| decode(input),
};

const RECORD: usize = 1024;
/// Bytes of a record that are written to.
const USED: usize = 1020;
/// Where a header says its horizontal datum. Old headers end before; such models are on
/// NAD27.
const DATUM_AT: usize = 890;
const HEIGHT_CHARS: usize = 6;
const PROFILE_HEADER: usize = 144;
/// What these files write where there is no elevation.
const VOID: i64 = -32767;

/// Whether a file begins with such a header: text throughout, and numbers where
/// the level, the pattern and the number of profiles are.
fn looks_like_header(head: &[u8]) -> bool {
    head.len() == RECORD
        && head.iter().all(|byte| (0x20..0x7f).contains(byte))
        && (1..=4).contains(&number::<i64>(head, 144, 6).unwrap_or(0))
        && number::<i64>(head, 150, 6) == Some(1)
        && number::<i64>(head, 858, 6).is_some_and(|profiles| profiles > 0)
}

/// Reads a model.
fn decode(input: &FileBytes) -> Result<Decoded, BadRaster> {
    let bytes = input.head(u64::MAX)?;
    if !looks_like_header(&bytes[..bytes.len().min(RECORD)]) {
        return Err(BadRaster::damaged(
            "its name says USGS DEM, its header does not (columns 145-156, 859-864)",
        ));
    }
    let header = Header::read(&bytes)?;
    let profiles = read_profiles(&bytes, &header)?;
    header.assemble(&profiles)
}

struct Header {
    profiles: usize,
    /// Distance between samples along one profile, from south to north.
    spacing: f64,
    /// Vertical units a stored unit.
    resolution: f64,
    east: f64,
    unit: GroundUnit,
    system: Option<ReferenceSystem>,
    states_datum: bool,
    /// EPSG's code of the vertical datum.
    vertical: Option<u16>,
    metres_per_vertical_unit: f64,
}

impl Header {
    fn read(bytes: &[u8]) -> Result<Self, BadRaster> {
        let positive = |at: usize, what: &str| {
            let value =
                number::<f64>(bytes, at, 12).filter(|value| value.is_finite() && *value > 0.0);
            value.ok_or_else(|| {
                BadRaster::damaged(format!("the header's {what} is not a number above 0"))
            })
        };
        let east = positive(816, "spacing from west to east")?;
        let north = positive(828, "spacing from south to north")?;
        let unit = match number::<i64>(bytes, 528, 6) {
            Some(0) => GroundUnit::angle(1.0_f64.to_degrees()),
            Some(1) => GroundUnit::length(0.3048, Certainty::Stated),
            Some(3) => GroundUnit::angle(1.0 / 3600.0),
            _ => GroundUnit::METRE,
        };
        Ok(Self {
            profiles: number::<i64>(bytes, 858, 6)
                .and_then(|count| usize::try_from(count).ok())
                .ok_or_else(|| BadRaster::damaged("the header's number of profiles"))?,
            spacing: north,
            resolution: positive(840, "vertical resolution")?,
            east,
            unit,
            states_datum: number::<i64>(bytes, DATUM_AT, 2).is_some(),
            system: horizontal_system(bytes).and_then(ReferenceSystem::from_code),
            vertical: match number::<i64>(bytes, 888, 2) {
                Some(2) => Some(5702),
                Some(3) => Some(5703),
                _ => None,
            },
            metres_per_vertical_unit: match number::<i64>(bytes, 534, 6) {
                Some(1) => 0.3048,
                _ => 1.0,
            },
        })
    }

    /// Puts the profiles side by side. Each starts at its own northing: a
    /// quadrangle's border is slanted against the grid, and outside it is a hole.
    fn assemble(&self, profiles: &[Profile]) -> Result<Decoded, BadRaster> {
        let souths = profiles.iter().map(|profile| profile.south);
        let south = souths.fold(f64::INFINITY, f64::min);
        let mut places = Vec::with_capacity(profiles.len());
        let mut rows = 0;
        for profile in profiles {
            let steps = ((profile.south - south) / self.spacing).round();
            // A profile that starts this far north is a damaged number.
            if !(0.0..1e6).contains(&steps) {
                return Err(BadRaster::damaged(format!(
                    "a profile starts at northing {}",
                    profile.south
                )));
            }
            places.push(steps as usize);
            rows = rows.max(steps as usize + profile.heights.len());
        }
        let columns = profiles.len();
        let stored: usize = profiles.iter().map(|profile| profile.heights.len()).sum();
        // Profiles overlap for the most part: anything else is a damaged northing.
        if rows.saturating_mul(columns) > 64 * stored.max(1024) {
            return Err(BadRaster::AbsurdSize(format!(
                "{columns} × {rows} samples around {stored} elevations"
            )));
        }
        let mut samples = vec![f32::NAN; rows * columns];
        for (column, (profile, first)) in profiles.iter().zip(&places).enumerate() {
            for (row, &height) in (*first..).zip(&profile.heights) {
                samples[row * columns + column] = height;
            }
        }
        let size = sides(columns as u64, rows as u64)?;
        let mut decoded = Decoded::new("USGS ASCII DEM".into(), size, Samples::from(samples));
        decoded.metres_per_vertical_unit = Some(self.metres_per_vertical_unit);
        if let Some(code) = self.vertical {
            decoded.set_vertical_datum(code);
        }
        decoded.system.clone_from(&self.system);
        if !self.states_datum {
            decoded.system_from = Certainty::Assumed;
        }
        let west = profiles.first().map_or(0.0, |profile| profile.west);
        let map = GroundMap::from_centre([west, self.east, 0.0], [south, 0.0, self.spacing]);
        let map = map.ok_or_else(|| BadRaster::damaged("its profiles lie nowhere"))?;
        decoded.lay_out(map, Some(self.unit));
        Ok(decoded)
    }
}

/// EPSG's code of the horizontal system: the header's kind of coordinates, UTM zone and
/// datum. State plane zones have numbers of their own, which are not resolved.
fn horizontal_system(bytes: &[u8]) -> Option<u16> {
    let (nad27, wgs72, wgs84, nad83) = (1, 2, 3, 4);
    let datum = number::<i64>(bytes, DATUM_AT, 2).unwrap_or(nad27);
    let zone = number::<u16>(bytes, 162, 6).filter(|zone| (1..=60).contains(zone));
    match (number::<i64>(bytes, 156, 6)?, datum) {
        (0, d) if d == nad27 => Some(4267),
        (0, d) if d == wgs72 => Some(4322),
        (0, d) if d == wgs84 => Some(4326),
        (0, d) if d == nad83 => Some(4269),
        (1, d) if d == nad27 => Some(26_700 + zone.filter(|zone| *zone <= 22)?),
        (1, d) if d == wgs72 => Some(32_200 + zone?),
        (1, d) if d == wgs84 => Some(32_600 + zone?),
        (1, d) if d == nad83 => Some(26_900 + zone.filter(|zone| *zone <= 23)?),
        _ => None,
    }
}

/// Elevations along one line, from south to north; NaN is a hole.
struct Profile {
    west: f64,
    south: f64,
    heights: Vec<f32>,
}

fn read_profiles(bytes: &[u8], header: &Header) -> Result<Vec<Profile>, BadRaster> {
    let mut profiles = Vec::new();
    let mut at = RECORD;
    for number in 1..=header.profiles {
        let (profile, records) = read_profile(bytes, at, header)
            .map_err(|fault| in_profile(fault, number, header.profiles))?;
        profiles.push(profile);
        at += records * RECORD;
    }
    Ok(profiles)
}

fn in_profile(fault: BadRaster, number: usize, of: usize) -> BadRaster {
    match fault {
        BadRaster::Truncated(what) => {
            BadRaster::Truncated(format!("profile {number} of {of}: {what}"))
        }
        BadRaster::Damaged(what) => BadRaster::Damaged(format!("profile {number} of {of}: {what}")),
        other => other,
    }
}

/// One profile, and how many records it takes.
fn read_profile(bytes: &[u8], at: usize, header: &Header) -> Result<(Profile, usize), BadRaster> {
    if bytes.len() < at + PROFILE_HEADER {
        return Err(BadRaster::Truncated("it is missing".into()));
    }
    let record = &bytes[at..];
    let count = number::<i64>(record, 12, 6)
        .and_then(|count| usize::try_from(count).ok())
        .ok_or_else(|| BadRaster::damaged("its number of elevations is not a number"))?;
    let west = number::<f64>(record, 24, 24)
        .ok_or_else(|| BadRaster::damaged("its easting is not a number"))?;
    let south = number::<f64>(record, 48, 24)
        .ok_or_else(|| BadRaster::damaged("its northing is not a number"))?;
    let datum = number::<f64>(record, 72, 24).unwrap_or(0.0);
    let mut heights = Vec::with_capacity(count.min(record.len() / HEIGHT_CHARS));
    for index in 0..count {
        let text_at = height_place(index);
        if record.len() < text_at + HEIGHT_CHARS {
            return Err(BadRaster::Truncated(format!(
                "it ends after {index} of {count} elevations"
            )));
        }
        let stored = number::<i64>(record, text_at, HEIGHT_CHARS).ok_or_else(|| {
            BadRaster::damaged(format!("elevation {} is not a number", index + 1))
        })?;
        heights.push(if stored == VOID {
            f32::NAN
        } else {
            (stored as f64 * header.resolution + datum) as f32
        });
    }
    let records = (PROFILE_HEADER + count * HEIGHT_CHARS).div_ceil(USED);
    let profile = Profile {
        west,
        south,
        heights,
    };
    Ok((profile, records))
}

/// Where in a profile's records the elevation of an index is written. Each record
/// ends with four blanks; without them the elevations would follow each other.
fn height_place(index: usize) -> usize {
    let at = PROFILE_HEADER + index * HEIGHT_CHARS;
    at / USED * RECORD + at % USED
}

/// What fixed columns say, as a number of some kind.
fn number<T: FromStr>(bytes: &[u8], at: usize, chars: usize) -> Option<T> {
    let text = std::str::from_utf8(bytes.get(at..at + chars)?).ok()?;
    // Fortran writes `D` for an exponent.
    text.trim().replace(['D', 'd'], "E").parse().ok()
}
