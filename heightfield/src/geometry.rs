//! Size of a cell on the ground, and of a vertical unit, in metres.

use super::globe::Globe;
use super::numbers::beginning;

/// The unit of a cell's sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CellUnit {
    /// A length.
    Length {
        /// Metres per unit.
        metres: f64,
    },
    /// Degrees of longitude and latitude.
    Degree,
}

/// Source of a unit, a reference system or a datum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Certainty {
    /// The file states it, or the format has no other.
    #[default]
    Stated,
    /// It follows from a code of a reference system in the file.
    FromCode,
    /// Not stated: the usual one is assumed.
    Assumed,
    /// The user states it.
    Given,
}

/// The size of a cell: the distance between neighbouring samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellSize {
    /// Along a row, west to east, in `unit`s; positive.
    pub east: f64,
    /// Along a column, south to north, in `unit`s; positive.
    pub north: f64,
    /// Cosine of the angle between a row and a column on the ground: zero where they are
    /// perpendicular, positive where columns lean to the east. Most projections shear the ground.
    pub lean: f64,
    /// Unit of `east` and `north`.
    pub unit: CellUnit,
    /// Ground metres per metre of [`CellSize::metres`] along rows and columns, in the middle of the
    /// field. A projected system is true to scale in few places, and the cells of a rotated grid in
    /// degrees have other sides than those along meridians and parallels.
    pub map_scale: (f64, f64),
    /// Latitude of the middle of the field in degrees, where known.
    pub latitude: Option<f64>,
    /// Globe to which the degrees refer.
    pub globe: Globe,
    /// Source of the unit.
    pub certainty: Certainty,
}

impl CellSize {
    /// Returns a size with a stated unit, east and north; `latitude` is the latitude of the middle
    /// of the field, degrees.
    pub(super) fn stated((east, north): (f64, f64), unit: CellUnit, latitude: Option<f64>) -> Self {
        Self {
            east,
            north,
            lean: 0.0,
            unit,
            map_scale: (1.0, 1.0),
            latitude,
            globe: Globe::EARTH,
            certainty: Certainty::Stated,
        }
    }

    /// Returns the cell's sides (east, north) in metres: degrees by the radii of curvature of the
    /// globe at the latitude. If the latitude is unknown, a degree of longitude counts as long as
    /// one of latitude at 45°.
    pub fn metres(&self) -> (f64, f64) {
        match self.unit {
            CellUnit::Length { metres } => (self.east * metres, self.north * metres),
            CellUnit::Degree => {
                let [east, north] = self.globe.metres_per_degree(self.latitude.unwrap_or(45.0));
                let east = self.latitude.map_or(north, |_| east);
                (self.east * east, self.north * north)
            }
        }
    }

    /// Returns the cell's sides (east, north) on the ground, m: [`CellSize::metres`] times the
    /// map's scale in the middle of the field.
    pub fn ground_metres(&self) -> (f64, f64) {
        let (east, north) = self.metres();
        (east * self.map_scale.0, north * self.map_scale.1)
    }

    /// Returns the side in metres of the square cell that is rendered in place of this one.
    ///
    /// Its area on the ground is the same, so the mean slope is kept for cells that are rendered as
    /// they are stored.
    pub fn square_metres(&self) -> f64 {
        let (east, north) = self.ground_metres();
        let sine = (1.0 - self.lean * self.lean).sqrt();
        (east * north * sine).sqrt()
    }

    /// Returns a size whose unit the file does not state: degrees if numbers this small, at such a
    /// position, can hardly be lengths, else metres.
    ///
    /// `corner` is the south-west corner in the same unit, `extent` the size of the whole field.
    pub(super) fn guessed(
        (east, north): (f64, f64),
        corner: Option<(f64, f64)>,
        extent: (f64, f64),
    ) -> Self {
        let on_earth = corner.is_some_and(|(x, y)| {
            // An origin of zero is a local frame, not a position in the Atlantic.
            (x, y) != (0.0, 0.0)
                && (-360.0..=360.0).contains(&x)
                && (-360.0..=360.5).contains(&(x + extent.0))
                && (-90.5..=90.5).contains(&y)
                && (-90.5..=90.5).contains(&(y + extent.1))
        });
        let degrees = on_earth && east < 0.5 && north < 0.5;
        let latitude = corner.map(|(_, y)| y + extent.1 / 2.0).filter(|_| degrees);
        let unit = match degrees {
            true => CellUnit::Degree,
            false => CellUnit::Length { metres: 1.0 },
        };
        Self {
            certainty: Certainty::Assumed,
            ..Self::stated((east, north), unit, latitude)
        }
    }

    /// Returns true if both sides are usable numbers.
    pub(super) fn is_valid(&self) -> bool {
        let (east, north) = self.metres();
        let usable = |side: f64| side.is_finite() && side > 1e-12 && side < 1e12;
        usable(east) && usable(north) && self.lean.abs() < 0.999
    }
}

/// Zero of heights.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VerticalDatum {
    /// Name of the vertical reference system, as `NAVD88 height`.
    pub name: String,
    /// EPSG's code for it, if it is known.
    pub code: Option<u16>,
}

/// Returns the remark on a unit of heights that is unknown to [`metres_in`].
pub(super) fn unknown_unit(name: &str) -> String {
    let name = beginning(name);
    format!(
        "it states the unit of heights '{name}', which is not supported (--input height-unit=…)"
    )
}

/// Returns the metres in a unit of length, by its name in files, as `ft` or `metre`.
pub fn metres_in(unit: &str) -> Option<f64> {
    let name: String = unit
        .to_lowercase()
        .chars()
        .filter(|c| c.is_ascii_alphanumeric())
        .collect();
    Some(match name.as_str() {
        "m" | "metre" | "metres" | "meter" | "meters" => 1.0,
        "cm" | "centimetre" | "centimetres" | "centimeter" | "centimeters" => 0.01,
        "mm" | "millimetre" | "millimetres" | "millimeter" | "millimeters" => 0.001,
        "dm" | "decimetre" | "decimeter" | "decimetres" | "decimeters" => 0.1,
        "km" | "kilometre" | "kilometres" | "kilometer" | "kilometers" => 1000.0,
        "ft" | "foot" | "feet" | "internationalfoot" | "footinternational" => 0.3048,
        "usft" | "ftus" | "ussurveyfoot" | "footus" | "surveyfoot" | "ussurveyfeet" | "usfoot"
        | "usfeet" | "sft" | "footussurvey" => 1200.0 / 3937.0,
        "fathom" | "fathoms" => 1.8288,
        _ => return None,
    })
}
