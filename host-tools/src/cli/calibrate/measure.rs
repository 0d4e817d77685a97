//! Measurements, for `--measure`.

use std::str::FromStr;

/// Measurements of an arm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Measure {
    /// The zero pose, the first step of every measurement.
    pub(super) zero: bool,
    /// The cable ratios and encoder signs.
    pub(super) ratios: bool,
    /// The weights on joints 2 and 3.
    pub(super) gravity: bool,
    /// True if guessed ratios are accepted without a measurement.
    pub(super) takes_guessed_ratios: bool,
}

impl FromStr for Measure {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut measure = Self::default();
        let mut measures_nothing = false;
        for word in text.split(',') {
            match word.trim() {
                "all" => (measure.zero, measure.ratios, measure.gravity) = (true, true, true),
                "none" => measures_nothing = true,
                "zero" => measure.zero = true,
                "ratios" => measure.ratios = true,
                "gravity" => measure.gravity = true,
                "guessed-ratios" => measure.takes_guessed_ratios = true,
                _ => {
                    return Err(
                        "all, none, or a list of zero, ratios, gravity and guessed-ratios".into(),
                    );
                }
            }
        }
        let Self {
            zero,
            ratios,
            gravity,
            takes_guessed_ratios,
        } = measure;
        if measures_nothing == (zero || ratios || gravity) {
            return Err("either none, or a list of measurements, as zero,gravity".into());
        }
        if (ratios || gravity) && !zero {
            return Err("the zero pose is measured first: add zero".into());
        }
        if ratios && takes_guessed_ratios {
            return Err("ratios or guessed-ratios, not both".into());
        }
        Ok(measure)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurement_lists_are_parsed() {
        let read = |text: &str| {
            let measure = text.parse::<Measure>().expect(text);
            let guessed = measure.takes_guessed_ratios;
            [measure.zero, measure.ratios, measure.gravity, guessed]
        };
        assert_eq!(read("all"), [true, true, true, false]);
        assert_eq!(read("none"), [false; 4]);
        assert_eq!(read("zero, gravity"), [true, false, true, false]);
        assert_eq!(read("zero,guessed-ratios"), [true, false, false, true]);
        assert_eq!(read("none,guessed-ratios"), [false, false, false, true]);
        for bad in [
            "",
            "weights",
            "none,zero",
            "gravity",
            "ratios",
            "guessed-ratios",
            "all,guessed-ratios",
        ] {
            assert!(bad.parse::<Measure>().is_err(), "{bad}");
        }
    }
}
