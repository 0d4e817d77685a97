//! USGS ASCII digital elevation models: 1024-byte records of fixed columns. A
//! header (record A), then one profile after another from west to east, each from
//! south to north (records B).

use super::input::Input;
use super::{CellSize, CellUnit, Certainty, Decoded, Fault, Samples};

const RECORD: usize = 1024;
/// Elevations that fit behind a profile's own header, and in the records after.
const FIRST_RECORD_HEIGHTS: usize = 146;
const NEXT_RECORD_HEIGHTS: usize = 170;
const HEIGHT_CHARS: usize = 6;
const PROFILE_HEADER: usize = 144;
/// What these files write where there is no elevation.
const VOID: i64 = -32767;

/// Whether a file begins with such a header: text throughout, and numbers where
/// the level, the pattern and the number of profiles are.
pub(super) fn looks_like_header(head: &[u8]) -> bool {
    head.len() == RECORD
        && head.iter().all(|byte| (0x20..0x7f).contains(byte))
        && (1..=4).contains(&integer(head, 144, 6).unwrap_or(0))
        && integer(head, 150, 6) == Some(1)
        && integer(head, 858, 6).is_some_and(|profiles| profiles > 0)
}

/// Reads a model.
pub(super) fn decode(input: &Input) -> Result<Decoded, Fault> {
    let bytes = input.bytes()?;
    if !looks_like_header(&bytes[..bytes.len().min(RECORD)]) {
        return Err(Fault::damaged(
            "its name says USGS DEM, its header does not (columns 145-156, 859-864)",
        ));
    }
    let header = Header::read(&bytes)?;
    let profiles = read_profiles(&bytes, &header)?;
    header.assemble(&profiles)
}

struct Header {
    profiles: usize,
    /// Distance between profiles, and between samples along one.
    spacing: (f64, f64),
    /// Vertical units a stored unit.
    resolution: f64,
    ground_unit: i64,
    metres_per_vertical_unit: f64,
    latitude: Option<f64>,
}

impl Header {
    fn read(bytes: &[u8]) -> Result<Self, Fault> {
        let needed = |value: Option<f64>, what: &str| {
            value
                .filter(|value| value.is_finite() && *value > 0.0)
                .ok_or_else(|| {
                    Fault::damaged(format!("the header's {what} is not a number above 0"))
                })
        };
        let south_west = real(bytes, 570, 24);
        let north_west = real(bytes, 618, 24);
        let ground_unit = integer(bytes, 528, 6).unwrap_or(2);
        let middle = south_west
            .zip(north_west)
            .map(|(south, north)| (south + north) / 2.0);
        Ok(Self {
            profiles: integer(bytes, 858, 6)
                .and_then(|count| usize::try_from(count).ok())
                .ok_or_else(|| Fault::damaged("the header's number of profiles"))?,
            spacing: (
                needed(real(bytes, 816, 12), "spacing from west to east")?,
                needed(real(bytes, 828, 12), "spacing from south to north")?,
            ),
            resolution: needed(real(bytes, 840, 12), "vertical resolution")?,
            ground_unit,
            metres_per_vertical_unit: match integer(bytes, 534, 6) {
                Some(1) => 0.3048,
                _ => 1.0,
            },
            // Corners are in arc seconds where the ground unit is.
            latitude: middle
                .filter(|_| ground_unit == 3)
                .map(|seconds| seconds / 3600.0),
        })
    }

    fn cell(&self) -> CellSize {
        let (east, north) = self.spacing;
        let (unit, per_unit) = match self.ground_unit {
            0 => (CellUnit::Degree, 1.0_f64.to_degrees()),
            1 => (CellUnit::Length { metres: 0.3048 }, 1.0),
            3 => (CellUnit::Degree, 1.0 / 3600.0),
            _ => (CellUnit::Length { metres: 1.0 }, 1.0),
        };
        CellSize {
            east: east * per_unit,
            north: north * per_unit,
            unit,
            latitude: self.latitude,
            certainty: Certainty::Stated,
        }
    }

    /// Puts the profiles side by side. Each starts at its own northing: a
    /// quadrangle's border is slanted against the grid, and outside it is a hole.
    fn assemble(&self, profiles: &[Profile]) -> Result<Decoded, Fault> {
        let south = profiles
            .iter()
            .map(|profile| profile.south)
            .fold(f64::INFINITY, f64::min);
        let mut places = Vec::with_capacity(profiles.len());
        let mut rows = 0;
        for profile in profiles {
            let steps = ((profile.south - south) / self.spacing.1).round();
            // A profile that starts this far north is a damaged number.
            if !(0.0..1e6).contains(&steps) {
                return Err(Fault::damaged(format!(
                    "a profile starts at northing {}",
                    profile.south
                )));
            }
            let first = steps as usize;
            rows = rows.max(first + profile.heights.len());
            places.push(first);
        }
        let columns = profiles.len();
        let stored: usize = profiles.iter().map(|profile| profile.heights.len()).sum();
        // Profiles overlap for the most part: anything else is a damaged northing.
        if rows.saturating_mul(columns) > 64 * stored.max(1024) {
            return Err(Fault::AbsurdSize(format!(
                "{columns} × {rows} samples around {stored} elevations"
            )));
        }
        let mut samples = vec![f32::NAN; rows * columns];
        for (column, (profile, first)) in profiles.iter().zip(&places).enumerate() {
            for (row, &height) in (*first..).zip(&profile.heights) {
                samples[row * columns + column] = height;
            }
        }
        let side = |length: usize| {
            u32::try_from(length).map_err(|_| Fault::AbsurdSize(format!("{length} samples")))
        };
        let mut decoded = Decoded::new(
            "USGS ASCII DEM",
            side(columns)?,
            side(rows)?,
            Samples::F32(samples),
        );
        decoded.south_up = true;
        decoded.cell = Some(self.cell());
        decoded.metres_per_vertical_unit = Some(self.metres_per_vertical_unit);
        Ok(decoded)
    }
}

/// Elevations along one line, from south to north; NaN is a hole.
struct Profile {
    south: f64,
    heights: Vec<f32>,
}

fn read_profiles(bytes: &[u8], header: &Header) -> Result<Vec<Profile>, Fault> {
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

fn in_profile(fault: Fault, number: usize, of: usize) -> Fault {
    match fault {
        Fault::Truncated(what) => Fault::Truncated(format!("profile {number} of {of}: {what}")),
        Fault::Damaged(what) => Fault::Damaged(format!("profile {number} of {of}: {what}")),
        other => other,
    }
}

/// One profile, and how many records it takes.
fn read_profile(bytes: &[u8], at: usize, header: &Header) -> Result<(Profile, usize), Fault> {
    if bytes.len() < at + PROFILE_HEADER {
        return Err(Fault::Truncated("it is missing".into()));
    }
    let record = &bytes[at..];
    let count = integer(record, 12, 6)
        .and_then(|count| usize::try_from(count).ok())
        .ok_or_else(|| Fault::damaged("its number of elevations is not a number"))?;
    let south =
        real(record, 48, 24).ok_or_else(|| Fault::damaged("its northing is not a number"))?;
    let datum = real(record, 72, 24).unwrap_or(0.0);
    let mut heights = Vec::with_capacity(count.min(record.len() / HEIGHT_CHARS));
    for index in 0..count {
        let text_at = height_place(index);
        if record.len() < text_at + HEIGHT_CHARS {
            return Err(Fault::Truncated(format!(
                "it ends after {index} of {count} elevations"
            )));
        }
        let stored = integer(record, text_at, HEIGHT_CHARS)
            .ok_or_else(|| Fault::damaged(format!("elevation {} is not a number", index + 1)))?;
        heights.push(if stored == VOID {
            f32::NAN
        } else {
            (stored as f64 * header.resolution + datum) as f32
        });
    }
    let later = count.saturating_sub(FIRST_RECORD_HEIGHTS);
    Ok((
        Profile { south, heights },
        1 + later.div_ceil(NEXT_RECORD_HEIGHTS),
    ))
}

/// Where in a profile's records the elevation of an index is written.
fn height_place(index: usize) -> usize {
    match index.checked_sub(FIRST_RECORD_HEIGHTS) {
        None => PROFILE_HEADER + index * HEIGHT_CHARS,
        Some(later) => {
            let (record, place) = (later / NEXT_RECORD_HEIGHTS, later % NEXT_RECORD_HEIGHTS);
            (1 + record) * RECORD + place * HEIGHT_CHARS
        }
    }
}

fn field(bytes: &[u8], at: usize, chars: usize) -> Option<&str> {
    std::str::from_utf8(bytes.get(at..at + chars)?)
        .ok()
        .map(str::trim)
}

fn integer(bytes: &[u8], at: usize, chars: usize) -> Option<i64> {
    field(bytes, at, chars)?.parse().ok()
}

/// A number, with Fortran's `D` for the exponent.
fn real(bytes: &[u8], at: usize, chars: usize) -> Option<f64> {
    field(bytes, at, chars)?
        .replace(['D', 'd'], "E")
        .parse()
        .ok()
}
