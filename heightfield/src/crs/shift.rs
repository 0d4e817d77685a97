//! The way from one datum's longitudes and latitudes to those of WGS 84.

use proj4rs::Proj;
use proj4rs::transform::transform;

use super::names::code_of_datum;
use crate::globe::Globe;

/// A way to WGS 84.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shift {
    /// No way at all: the datum counts as WGS 84.
    None,
    /// A shift, as PROJ writes it, with the ellipsoid that it is for.
    Parameters {
        /// `+ellps=intl +towgs84=-87,-98,-121`
        words: String,
        /// Usually not farther off than this, m.
        within_m: f64,
    },
}

/// How far the datum of a modern system that counts as WGS 84 may be off, m: as far as
/// plates have moved since.
const SAME_WITHIN_M: f64 = 4.0;
/// How far off nine of ten shifts by three and by seven parameters are at most, m, by
/// `tests/data/shift_errors.py`.
const THREE_WITHIN_M: f64 = 45.0;
const SEVEN_WITHIN_M: f64 = 10.0;

/// NAD27's shift is a grid; these three parameters are EPSG's for the contiguous states.
const NAD27: [f64; 3] = [-8.0, 160.0, 176.0];

/// Geographic systems whose shift in `crs-definitions` is more than 100 m from PROJ's.
const NOT_TRUSTED: [u16; 5] = [4161, 4240, 4688, 4805, 4751];

impl Shift {
    /// Of a datum by its name, or by the code of a system that has it.
    pub(crate) fn of(name: &str, code: Option<u16>) -> Option<Self> {
        let of_code = code.and_then(Self::by_code);
        of_code.or_else(|| Self::by_code(code_of_datum(name)?))
    }

    /// Three or seven parameters for an ellipsoid: metres, seconds of arc, and parts in a
    /// million, as PROJ has them.
    pub(crate) fn by_numbers(globe: &Globe, numbers: &[f64]) -> Option<Self> {
        if !matches!(numbers.len(), 3 | 7) || !numbers.iter().all(|number| number.is_finite()) {
            return None;
        }
        let is_zero = |numbers: &[f64]| numbers.iter().all(|number| *number == 0.0);
        if is_zero(numbers) && globe.is_wgs84() {
            return Some(Self::None);
        }
        let listed: Vec<String> = numbers.iter().map(f64::to_string).collect();
        Some(Self::Parameters {
            words: format!("{} +towgs84={}", globe.in_proj(), listed.join(",")),
            within_m: match is_zero(&numbers[3..]) {
                true => THREE_WITHIN_M,
                false => SEVEN_WITHIN_M,
            },
        })
    }

    /// Of the system with a code of EPSG's.
    fn by_code(code: u16) -> Option<Self> {
        if NOT_TRUSTED.contains(&code) {
            return None;
        }
        let text = crs_definitions::from_code(code)?.proj4;
        let words = || text.split_whitespace();
        let value = |key: &str| words().find_map(|word| word.strip_prefix(key));
        if let Some(datum) = value("+datum=") {
            return Some(Self::by_datum(datum));
        }
        let numbers: Option<Vec<f64>> = value("+towgs84=")?
            .split(',')
            .map(|number| number.parse().ok())
            .collect();
        let numbers = numbers?;
        let globe = words().filter(|word| {
            let keys = ["+ellps=", "+a=", "+b=", "+rf=", "+R="];
            keys.iter().any(|key| word.starts_with(key))
        });
        let globe = globe.collect::<Vec<_>>().join(" ");
        match Self::by_numbers(&Globe::EARTH, &numbers)? {
            Self::None => Some(Self::None),
            Self::Parameters { within_m, .. } => Some(Self::Parameters {
                words: format!("{globe} +towgs84={}", value("+towgs84=")?),
                within_m,
            }),
        }
    }

    /// Of a datum that `proj4rs` has a name for.
    fn by_datum(datum: &str) -> Self {
        match datum {
            "WGS84" | "NAD83" => Self::None,
            "NAD27" => {
                let [x, y, z] = NAD27;
                Self::Parameters {
                    words: format!("+ellps=clrk66 +towgs84={x},{y},{z}"),
                    within_m: THREE_WITHIN_M,
                }
            }
            datum => Self::Parameters {
                words: format!("+datum={datum}"),
                within_m: match datum {
                    "carthage" | "GGRS87" => THREE_WITHIN_M,
                    _ => SEVEN_WITHIN_M,
                },
            },
        }
    }

    /// Usually not farther off than this, m.
    pub(super) const fn within_m(&self) -> f64 {
        match self {
            Self::None => SAME_WITHIN_M,
            Self::Parameters { within_m, .. } => *within_m,
        }
    }

    /// Longitude and latitude of WGS 84 of those of the datum, degrees.
    pub(super) fn to_wgs84(&self, own: (f64, f64)) -> Option<(f64, f64)> {
        between(&self.own()?, &wgs84()?, own)
    }

    /// The inverse of [`Shift::to_wgs84`].
    pub(super) fn of_wgs84(&self, lonlat: (f64, f64)) -> Option<(f64, f64)> {
        between(&wgs84()?, &self.own()?, lonlat)
    }

    fn own(&self) -> Option<Proj> {
        match self {
            Self::None => wgs84(),
            Self::Parameters { words, .. } => {
                Proj::from_proj_string(&format!("+proj=longlat {words}")).ok()
            }
        }
    }
}

fn wgs84() -> Option<Proj> {
    Proj::from_proj_string("+proj=longlat +datum=WGS84").ok()
}

fn between(from: &Proj, to: &Proj, (longitude, latitude): (f64, f64)) -> Option<(f64, f64)> {
    let mut place = (longitude.to_radians(), latitude.to_radians(), 0.0);
    transform(from, to, &mut place).ok()?;
    let found = (place.0.to_degrees(), place.1.to_degrees());
    (found.0.is_finite() && found.1.is_finite()).then_some(found)
}
