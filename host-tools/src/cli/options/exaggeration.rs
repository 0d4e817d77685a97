//! Height of a rendered terrain.

use std::fmt;
use std::str::FromStr;

use crate::place::Heights;

/// Unit of a height: device millimetres per vertical unit of the file.
const MM_PER_UNIT: &str = "mm/unit";

/// Height of a rendered terrain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exaggeration {
    /// Factor to the height that is true to scale; negative is upside down. Every command's default
    /// is 1.
    Times(f64),
    /// The factor that makes the relief high enough: [`crate::place::suited_height`].
    Auto,
    /// Device millimetres per vertical unit of the file.
    MmPerUnit(f64),
}

impl Default for Exaggeration {
    fn default() -> Self {
        Self::Times(1.0)
    }
}

impl From<Exaggeration> for Heights {
    fn from(exaggeration: Exaggeration) -> Self {
        match exaggeration {
            Exaggeration::Times(times) => Self::Exaggerated(times),
            Exaggeration::Auto => Self::Suited,
            Exaggeration::MmPerUnit(height) => Self::MmPerUnit(height),
        }
    }
}

impl FromStr for Exaggeration {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        if text == "auto" {
            return Ok(Self::Auto);
        }
        let (number, make): (_, fn(f64) -> Self) = match text.strip_suffix(MM_PER_UNIT) {
            Some(number) => (number.trim_end(), Self::MmPerUnit),
            None => (text, Self::Times),
        };
        let number = number
            .parse()
            .ok()
            .filter(|number: &f64| number.is_finite());
        number.map(make).ok_or_else(|| {
            "a number, as 2 or 0.5, auto, or millimetres a vertical unit, as 0.05mm/unit".into()
        })
    }
}

impl fmt::Display for Exaggeration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Times(times) => write!(f, "{times}"),
            Self::Auto => f.write_str("auto"),
            Self::MmPerUnit(height) => write!(f, "{height}{MM_PER_UNIT}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exaggerations_are_parsed() {
        for (text, expected) in [
            ("auto", Exaggeration::Auto),
            ("2.5", Exaggeration::Times(2.5)),
            ("-1", Exaggeration::Times(-1.0)),
            ("0.0485mm/unit", Exaggeration::MmPerUnit(0.0485)),
            ("-0.5 mm/unit", Exaggeration::MmPerUnit(-0.5)),
        ] {
            assert_eq!(text.parse(), Ok(expected));
            assert_eq!(expected.to_string().parse(), Ok(expected));
        }
        for bad in ["much", "inf", "nan", "", "2mm", "nanmm/unit", "mm/unit"] {
            assert!(bad.parse::<Exaggeration>().is_err(), "{bad}");
        }
    }
}
