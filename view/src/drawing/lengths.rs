//! Round lengths for scale bars, and their texts.

/// Returns the largest of 1, 2 and 5 times a power of ten up to a limit; `None` if the limit is no
/// positive number.
pub(super) fn round_below(limit: f64) -> Option<f64> {
    if !limit.is_finite() || limit <= 0.0 {
        return None;
    }
    // The logarithm of a power of ten may be rounded to the wrong side.
    let limit = limit * (1.0 + 1e-9);
    let power = 10_f64.powf(limit.log10().floor());
    let mut lengths = [5.0, 2.0, 1.0].into_iter().map(|digit| digit * power);
    lengths.find(|length| *length <= limit)
}

/// Returns the text of a length in the picture's units: metres on the ground, or millimetres of the
/// tip.
pub(super) fn written(length: f64, is_on_ground: bool) -> String {
    let (value, unit) = match is_on_ground {
        false => (length, "mm"),
        true if length >= 1000.0 => (length / 1000.0, "km"),
        true if length < 1.0 => (100.0 * length, "cm"),
        true => (length, "m"),
    };
    // Further digits are errors of the division.
    format!("{} {unit}", (value * 1e6).round() / 1e6)
}

/// Returns the text of the distances from another position to the east and the north, in the
/// picture's units.
pub(super) fn distances(place: [f64; 2], is_on_ground: bool) -> String {
    let unit = if is_on_ground { "m" } else { "mm" };
    // Zero is written as 0 and not as -0.
    let [east, north] = place.map(|at| (at * 1e3).round() / 1e3 + 0.0);
    format!("{east}, {north} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_round_and_close_below_the_limit() {
        let cases = [
            (0.0999, 0.05),
            (1.0, 1.0),
            (1.99, 1.0),
            (2.0, 2.0),
            (49.0, 20.0),
            (1000.0, 1000.0),
            (7.3e4, 5e4),
        ];
        for (limit, length) in cases {
            let found = round_below(limit).expect("positive");
            assert!((found / length - 1.0).abs() < 1e-12, "{limit}: {found}");
        }
        let mut limit = 1e-7;
        while limit < 1e7 {
            let length = round_below(limit).expect("positive");
            assert!(length <= limit * (1.0 + 1e-8) && limit < 2.5 * length * (1.0 + 1e-8));
            limit *= 1.37;
        }
        for none in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(round_below(none), None);
        }
    }

    #[test]
    fn lengths_are_written_in_the_unit_that_maps_have() {
        let ground = [
            (0.2, "20 cm"),
            (5.0, "5 m"),
            (500.0, "500 m"),
            (2e4, "20 km"),
        ];
        for (metres, text) in ground {
            assert_eq!(written(metres, true), text);
        }
        assert_eq!(written(20.0, false), "20 mm");
        assert_eq!(distances([-1e-9, 1022.0], true), "0, 1022 m");
        assert_eq!(distances([12.5, -3.0], false), "12.5, -3 mm");
    }
}
