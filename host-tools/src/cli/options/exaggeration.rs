//! How much higher than true to scale a terrain is felt.

use std::str::FromStr;

/// Times that heights are higher than true to scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exaggeration {
    /// So many times; below zero upside down. One where nothing is stated, for every
    /// command.
    Times(f64),
    /// As many as make the relief large enough to be felt: [`crate::place::suited_height`].
    Auto,
}

impl Default for Exaggeration {
    fn default() -> Self {
        Self::Times(1.0)
    }
}

impl FromStr for Exaggeration {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.parse::<f64>()) {
            ("auto", _) => Ok(Self::Auto),
            (_, Ok(times)) if times.is_finite() => Ok(Self::Times(times)),
            _ => Err("a number, as 2 or 0.5, or auto".into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_auto() {
        assert_eq!("auto".parse(), Ok(Exaggeration::Auto));
        assert_eq!("2.5".parse(), Ok(Exaggeration::Times(2.5)));
        assert_eq!("-1".parse(), Ok(Exaggeration::Times(-1.0)));
        for bad in ["much", "inf", "nan", ""] {
            assert!(bad.parse::<Exaggeration>().is_err(), "{bad}");
        }
    }
}
