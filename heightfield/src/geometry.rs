//! Size of a cell on the ground, and of a vertical unit in metres.

use super::globe::Globe;
use super::numbers::beginning;

/// The unit of a cell's sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CellUnit {
    /// A length, in metres each.
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
    /// The file states it, or its format has no other.
    #[default]
    Stated,
    /// It follows from a code of a reference system in the file.
    FromCode,
    /// Nothing states it: it is taken to be the usual one.
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
    /// perpendicular, positive where columns lean to the east. Most maps shear the ground.
    pub lean: f64,
    /// Unit of both.
    pub unit: CellUnit,
    /// Ground metres in a metre of [`CellSize::metres`] along rows and columns, in the middle
    /// of the field: a projected system is true to scale in few places, and a turned grid of
    /// degrees is neither as wide as one of longitude nor as high as one of latitude.
    pub map_scale: (f64, f64),
    /// Latitude of the middle of the field in degrees, where known.
    pub latitude: Option<f64>,
    /// Globe of the degrees.
    pub globe: Globe,
    /// Source of the unit.
    pub certainty: Certainty,
}

impl CellSize {
    /// A size whose unit the file states, east and north; `latitude` is that of the
    /// middle of the field, in degrees.
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

    /// The cell's sides (east, north) in metres: degrees by the radii of curvature of its
    /// globe at the latitude. Where the latitude is not known, a degree of longitude counts
    /// as long as one of latitude at 45°.
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

    /// The cell's sides (east, north) on the ground, m: [`CellSize::metres`] of the map,
    /// at the scale that the map has in the middle of the field.
    pub fn ground_metres(&self) -> (f64, f64) {
        let (east, north) = self.metres();
        (east * self.map_scale.0, north * self.map_scale.1)
    }

    /// The side in metres of the square cell that stands for this one.
    ///
    /// It has the same area on the ground, so that the mean slope of cells that are rendered as
    /// they are stored is kept.
    pub fn square_metres(&self) -> f64 {
        let (east, north) = self.ground_metres();
        let sine = (1.0 - self.lean * self.lean).sqrt();
        (east * north * sine).sqrt()
    }

    /// A size in a unit that the file leaves open: degrees when numbers this
    /// small, at such a place, can hardly be a length, else metres.
    ///
    /// `corner` is the south-west corner in the same unit, `extent` the size of
    /// the whole field.
    pub(super) fn guessed(
        (east, north): (f64, f64),
        corner: Option<(f64, f64)>,
        extent: (f64, f64),
    ) -> Self {
        let on_earth = corner.is_some_and(|(x, y)| {
            // An origin of zero is a local frame, not a point in the Atlantic.
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
    /// EPSG's code for it, where it is known.
    pub code: Option<u16>,
}

/// Returns the remark on a unit of heights that [`metres_in`] does not know.
pub(super) fn unknown_unit(name: &str) -> String {
    let name = beginning(name);
    format!(
        "it states the unit of heights '{name}', which is not known here (--input height-unit=…)"
    )
}

/// Metres in a unit of length by the name files give it, as `ft` or `metre`.
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
