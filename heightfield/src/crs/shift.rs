//! Shifts from a datum's longitudes and latitudes to those of WGS 84.

use super::transform::Transform;

use crate::globe::Globe;

/// A shift to WGS 84.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shift {
    /// No shift: the datum is treated as WGS 84.
    None,
    /// A shift with its ellipsoid, in PROJ's syntax.
    Parameters {
        /// From longitude and latitude of the datum to WGS 84.
        transform: Transform,
        /// Usual max error, m.
        within_m: f64,
    },
}

/// Max error of a modern datum that is treated as WGS 84, m: plate motion since its epoch.
const SAME_WITHIN_M: f64 = 4.0;
/// Max error of nine of ten shifts by three and by seven parameters, m, by
/// `tests/data/shift_errors.py`.
const THREE_WITHIN_M: f64 = 45.0;
const SEVEN_WITHIN_M: f64 = 10.0;

/// NAD27's true shift is a grid; these are EPSG's three parameters for the contiguous states.
const NAD27: [f64; 3] = [-8.0, 160.0, 176.0];

/// Geographic systems whose shift in `crs-definitions` differs from PROJ's by more than 100 m.
const UNTRUSTED: [u16; 5] = [4161, 4240, 4688, 4805, 4751];

impl Shift {
    /// Creates a shift from three or seven parameters for an ellipsoid: metres, seconds of arc, and
    /// parts per million, as in PROJ.
    pub(super) fn of_numbers(globe: &Globe, numbers: &[f64]) -> Option<Self> {
        if !matches!(numbers.len(), 3 | 7) || !numbers.iter().all(|number| number.is_finite()) {
            return None;
        }
        let is_zero = |numbers: &[f64]| numbers.iter().all(|number| *number == 0.0);
        if is_zero(numbers) && globe.is_wgs84() {
            return Some(Self::None);
        }
        let listed: Vec<String> = numbers.iter().map(f64::to_string).collect();
        Self::by(
            &format!("{} +towgs84={}", globe.in_proj(), listed.join(",")),
            match is_zero(&numbers[3..]) {
                true => THREE_WITHIN_M,
                false => SEVEN_WITHIN_M,
            },
        )
    }

    fn by(words: &str, within_m: f64) -> Option<Self> {
        let from = format!("+proj=longlat {words}");
        let transform = Transform::new(from, "+proj=longlat +datum=WGS84".into())?;
        Some(Self::Parameters {
            transform,
            within_m,
        })
    }

    /// Returns the shift of the system with an EPSG code.
    pub(super) fn of_code(code: u16) -> Option<Self> {
        if UNTRUSTED.contains(&code) {
            return None;
        }
        let text = crs_definitions::from_code(code)?.proj4;
        let words = || text.split_whitespace();
        let value = |key: &str| words().find_map(|word| word.strip_prefix(key));
        if let Some(datum) = value("+datum=") {
            return Self::by_datum(datum);
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
        match Self::of_numbers(&Globe::EARTH, &numbers)? {
            Self::None => Some(Self::None),
            Self::Parameters { within_m, .. } => Self::by(
                &format!("{globe} +towgs84={}", value("+towgs84=")?),
                within_m,
            ),
        }
    }

    /// Returns the shift of a datum that `proj4rs` supports by name.
    fn by_datum(datum: &str) -> Option<Self> {
        match datum {
            "WGS84" | "NAD83" => Some(Self::None),
            "NAD27" => {
                let [x, y, z] = NAD27;
                Self::by(
                    &format!("+ellps=clrk66 +towgs84={x},{y},{z}"),
                    THREE_WITHIN_M,
                )
            }
            "carthage" | "GGRS87" => Self::by(&format!("+datum={datum}"), THREE_WITHIN_M),
            datum => Self::by(&format!("+datum={datum}"), SEVEN_WITHIN_M),
        }
    }

    /// Returns the usual max error, m.
    pub(super) const fn within_m(&self) -> f64 {
        match self {
            Self::None => SAME_WITHIN_M,
            Self::Parameters { within_m, .. } => *within_m,
        }
    }

    /// Converts longitude and latitude of the datum to WGS 84, degrees.
    pub(super) fn to_wgs84(&self, own: (f64, f64)) -> Option<(f64, f64)> {
        match self {
            Self::None => Some(own),
            Self::Parameters { transform, .. } => in_degrees(own, |place| transform.forward(place)),
        }
    }

    /// Inverts [`Shift::to_wgs84`].
    pub(super) fn of_wgs84(&self, lonlat: (f64, f64)) -> Option<(f64, f64)> {
        match self {
            Self::None => Some(lonlat),
            Self::Parameters { transform, .. } => {
                in_degrees(lonlat, |place| transform.inverse(place))
            }
        }
    }
}

fn in_degrees(
    (longitude, latitude): (f64, f64),
    moved: impl Fn((f64, f64)) -> Option<(f64, f64)>,
) -> Option<(f64, f64)> {
    let (longitude, latitude) = moved((longitude.to_radians(), latitude.to_radians()))?;
    Some((longitude.to_degrees(), latitude.to_degrees()))
}
