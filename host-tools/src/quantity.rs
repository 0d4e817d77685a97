//! Quantities in options, commands and files: a number, and its unit if it is not the default.

use std::fmt::Display;
use std::str::FromStr;

/// The units of a kind of quantity.
#[derive(Debug)]
pub struct Units {
    /// Name of the quantity, for messages.
    name: &'static str,
    /// Each unit and its size in the first one, which is the default.
    units: &'static [(&'static str, f64)],
}

/// Stiffness: force per millimetre between HIP and proxy.
pub const STIFFNESS: Units = Units {
    name: "a stiffness",
    units: &[("N/mm", 1.0), ("N/m", 1e-3)],
};
/// Force.
pub const FORCE: Units = Units {
    name: "a force",
    units: &[("N", 1.0), ("mN", 1e-3)],
};
/// Length at the device.
pub const LENGTH: Units = Units {
    name: "a length at the device",
    units: &[("mm", 1.0), ("cm", 10.0), ("um", 1e-3), ("µm", 1e-3)],
};
/// Distance on the ground, without the units of a length at the device.
pub const GROUND_DISTANCE: Units = Units {
    name: "a distance on the ground",
    units: &[("m", 1.0), ("km", 1e3), ("ft", 0.3048)],
};
/// Length on the ground.
pub const GROUND: Units = Units {
    name: "a length on the ground",
    units: &[
        ("m", 1.0),
        ("km", 1e3),
        ("cm", 0.01),
        ("mm", 1e-3),
        ("ft", 0.3048),
    ],
};
/// Time.
pub const TIME: Units = Units {
    name: "a time",
    units: &[
        ("s", 1.0),
        ("ms", 1e-3),
        ("min", 60.0),
        ("h", 3600.0),
        ("us", 1e-6),
        ("µs", 1e-6),
    ],
};
/// Rate of the loop.
pub const FREQUENCY: Units = Units {
    name: "a rate",
    units: &[("Hz", 1.0), ("kHz", 1e3)],
};
/// Damping: force per unit of speed.
pub const DAMPING: Units = Units {
    name: "a damping",
    units: &[("Ns/m", 1.0), ("N·s/m", 1.0), ("Ns/mm", 1e3)],
};
/// Speed of the tip.
pub const SPEED: Units = Units {
    name: "a speed",
    units: &[("mm/s", 1.0), ("cm/s", 10.0), ("m/s", 1e3)],
};
/// Torque of a joint.
pub const TORQUE: Units = Units {
    name: "a torque",
    units: &[("Nm", 1.0), ("N·m", 1.0), ("mNm", 1e-3)],
};
/// Torque constant of a motor: torque for each ampere.
pub const TORQUE_CONSTANT: Units = Units {
    name: "a torque constant",
    units: &[("Nm/A", 1.0), ("N·m/A", 1.0), ("mNm/A", 1e-3)],
};
/// Current of a motor.
pub const CURRENT: Units = Units {
    name: "a current",
    units: &[("A", 1.0), ("mA", 1e-3)],
};
/// Angle.
pub const ANGLE: Units = Units {
    name: "an angle",
    units: &[("deg", 1.0), ("°", 1.0)],
};
/// Size in memory.
pub const MEMORY: Units = Units {
    name: "a size",
    units: &[("MB", 1.0), ("GB", 1024.0)],
};
/// Rate of data on the link; a megabyte is 10⁶ bytes.
pub const DATA_RATE: Units = Units {
    name: "a rate of the link",
    units: &[("MB/s", 1.0), ("kB/s", 1e-3)],
};
/// Scale: ground length per device millimetre.
pub const GROUND_SCALE: Units = Units {
    name: "a scale",
    units: &[("m/mm", 1.0), ("km/mm", 1e3), ("cm/mm", 0.01)],
};

impl Units {
    /// Parses a quantity and returns it in the default unit.
    ///
    /// # Errors
    /// The number is not finite, or the unit is unknown; the message lists the units.
    pub fn read(&self, text: &str) -> Result<f64, String> {
        let (number, unit) = split(text);
        let size = self.size_of(unit);
        let value = number
            .parse::<f64>()
            .ok()
            .filter(|number| number.is_finite());
        match (value, size) {
            (Some(value), Some(1.0)) => Ok(value),
            (Some(value), Some(size)) => Ok(value * size),
            _ => Err(self.expected(text)),
        }
    }

    /// The same in single precision, so that a number in the default unit is rounded once.
    ///
    /// # Errors
    /// As [`Units::read`].
    pub fn read_single(&self, text: &str) -> Result<f32, String> {
        let (number, unit) = split(text);
        match (number.parse::<f32>(), self.size_of(unit)) {
            (Ok(value), Some(1.0)) if value.is_finite() => Ok(value),
            _ => self.read(text).map(|value| value as f32),
        }
    }

    /// Parses a quantity within a range.
    ///
    /// # Errors
    /// As [`Units::read`]; the quantity is out of range.
    pub fn read_within(&self, text: &str, range: [f64; 2]) -> Result<f64, String> {
        let value = self.read(text)?;
        let [min, max] = range;
        let unit = self.default_unit();
        (min..=max)
            .contains(&value)
            .then_some(value)
            .ok_or_else(|| format!("{} from {min} to {max} {unit}", self.name))
    }

    /// Formats a quantity as on the command line.
    #[must_use]
    pub fn format(&self, value: impl Display) -> String {
        format!("{value}{}", self.default_unit())
    }

    fn default_unit(&self) -> &'static str {
        self.units.first().map_or("", |(unit, _)| unit)
    }

    fn size_of(&self, unit: &str) -> Option<f64> {
        if unit.is_empty() {
            return Some(1.0);
        }
        let known = self.units.iter().find(|(known, _)| *known == unit);
        known.map(|(_, size)| *size)
    }

    fn expected(&self, text: &str) -> String {
        let units: Vec<_> = self.units.iter().map(|(unit, _)| *unit).collect();
        let (name, units) = (self.name, units.join(", "));
        let default_unit = self.default_unit();
        match split(text) {
            ("", _) => format!("{name} is a number in {default_unit}, or with its unit: {units}"),
            (_, "") => format!("{name} is a finite number in {default_unit}"),
            (_, unit) => format!("{name} is not in `{unit}`: its units are {units}"),
        }
    }
}

/// Splits a text into a number and the rest.
fn split(text: &str) -> (&str, &str) {
    let text = text.trim();
    let ends = (0..=text.len())
        .rev()
        .filter(|end| text.is_char_boundary(*end));
    let mut numbers = ends.filter(|end| f64::from_str(&text[..*end]).is_ok());
    match numbers.next() {
        Some(end) => (&text[..end], text[end..].trim()),
        None => ("", text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn number_alone_is_in_the_first_unit() {
        assert_eq!(STIFFNESS.read("0.5"), Ok(0.5));
        assert_eq!(STIFFNESS.read(" 0.5 N/mm "), Ok(0.5));
        assert_eq!(STIFFNESS.read("500N/m"), Ok(0.5));
        assert_eq!(LENGTH.read("2e-1cm"), Ok(2.0));
        assert_eq!(TIME.read("2min"), Ok(120.0));
        assert_eq!(DAMPING.read("2N·s/m"), Ok(2.0));
        assert_eq!(GROUND_SCALE.read("5m/mm"), Ok(5.0));
        assert_eq!(DATA_RATE.read("200kB/s"), Ok(0.2));
        assert_eq!(SPEED.read("0.5m/s"), Ok(500.0));
        assert_eq!(TORQUE_CONSTANT.read("20mNm/A"), Ok(0.02));
    }

    #[test]
    fn invalid_unit_error_names_the_valid_ones() {
        for (units, text, part) in [
            (&STIFFNESS, "0.5N", "N/mm, N/m"),
            (&LENGTH, "2m", "mm, cm"),
            (&TIME, "soon", "s, ms, min, h"),
            (&FORCE, "", "a number in N"),
            (&FORCE, "nan", "finite"),
            (&FORCE, "inf", "finite"),
            (&FORCE, "1e999", "finite"),
            (&ANGLE, "1 2deg", "deg"),
        ] {
            let why = units.read(text).expect_err(text);
            assert!(why.contains(part), "{text}: {why}");
        }
        let why = TIME.read_within("0.5s", [1.0, 60.0]).expect_err("short");
        assert_eq!(why, "a time from 1 to 60 s");
    }

    #[test]
    fn written_quantity_is_read_back_bit_for_bit() {
        for value in [0.1_f32, 0.3, 1.0 / 3.0, 8.5, f32::MIN_POSITIVE] {
            assert_eq!(STIFFNESS.read_single(&STIFFNESS.format(value)), Ok(value));
            let value = f64::from(value);
            assert_eq!(LENGTH.read(&LENGTH.format(value)), Ok(value));
        }
    }
}
