//! Scale of a rendered terrain.

use std::fmt;
use std::str::FromStr;

use crate::place::Sizing;
use crate::quantity::GROUND_SCALE;

/// Unit of the cell size at the device.
const MM_PER_CELL: &str = "mm/cell";

/// Scale of a rendered terrain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MapScale {
    /// Ground metres per device millimetre.
    GroundMPerMm(f64),
    /// Device millimetres per haptic cell of level 0.
    CellMm(f64),
}

impl MapScale {
    /// Returns the sizing of a terrain in front of an arm.
    #[must_use]
    pub const fn sizing(scale: Option<Self>) -> Sizing {
        match scale {
            None => Sizing::Fit,
            Some(Self::GroundMPerMm(metres)) => Sizing::GroundMPerMm(metres),
            Some(Self::CellMm(cell_mm)) => Sizing::CellMm(cell_mm),
        }
    }

    /// Returns the device millimetres per cell with a side of `side_m` on the ground; `None` if the
    /// side is required but unknown.
    #[must_use]
    pub fn cell_mm(self, side_m: Option<f64>) -> Option<f64> {
        match self {
            Self::CellMm(cell_mm) => Some(cell_mm),
            Self::GroundMPerMm(metres) => side_m.map(|side| side / metres),
        }
    }
}

impl FromStr for MapScale {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let cell = text.trim().strip_suffix(MM_PER_CELL);
        let scale = match cell {
            Some(number) => number
                .trim_end()
                .parse()
                .map(Self::CellMm)
                .map_err(|_| "a scale is a number with its unit".to_owned()),
            None => GROUND_SCALE.read(text).map(Self::GroundMPerMm),
        };
        let is_size = |number: f64| number.is_finite() && number > 0.0;
        match scale {
            Ok(Self::GroundMPerMm(number) | Self::CellMm(number)) if !is_size(number) => {
                Err(format!("{number} is no size: above zero, and finite"))
            }
            Ok(scale) => Ok(scale),
            Err(why) => Err(format!(
                "{why}; ground metres per device millimetre, as 5m/mm, or the size of a haptic cell, as 1.5mm/cell"
            )),
        }
    }
}

impl fmt::Display for MapScale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::GroundMPerMm(metres) => f.write_str(&GROUND_SCALE.format(metres)),
            Self::CellMm(cell_mm) => write!(f, "{cell_mm}{MM_PER_CELL}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn map_scales_are_parsed() {
        for (text, expected) in [
            ("5", MapScale::GroundMPerMm(5.0)),
            ("5m/mm", MapScale::GroundMPerMm(5.0)),
            ("0.25 km/mm", MapScale::GroundMPerMm(250.0)),
            ("1.5mm/cell", MapScale::CellMm(1.5)),
            ("0.1 mm/cell", MapScale::CellMm(0.1)),
        ] {
            assert_eq!(text.parse(), Ok(expected));
            assert_eq!(expected.to_string().parse(), Ok(expected));
        }
        for bad in [
            "",
            "5mm",
            "0",
            "-2m/mm",
            "nanmm/cell",
            "0mm/cell",
            "infm/mm",
            "1/5",
        ] {
            let why = bad.parse::<MapScale>().expect_err(bad);
            assert!(why.contains("size"), "{bad}: {why}");
        }
    }
}
