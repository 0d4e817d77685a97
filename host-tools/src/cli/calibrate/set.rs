//! Numbers of a calibration record by name, for `--set`.

use std::str::FromStr;

use hapterra_core::Vec3;
use hapterra_core::phantom::Calibration;

use crate::quantity::{ANGLE, CURRENT, FORCE, LENGTH, SPEED, TORQUE, TORQUE_CONSTANT, Units};

/// A number of the record and its new value, in the record's unit.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    number: Number,
    /// The joint, 0 to 2, of a number that each joint has.
    axis: usize,
    value: f32,
}

/// Position of a number in the record.
#[derive(Clone, Copy, Debug)]
enum Number {
    /// One number for the whole arm.
    One(fn(&mut Calibration) -> &mut f32),
    /// One number per joint.
    Joint(fn(&mut Calibration) -> &mut Vec3),
    /// One number per joint, set in degrees and stored in radians.
    JointDegrees(fn(&mut Calibration) -> &mut Vec3),
}
use Number::{Joint, JointDegrees, One};

impl Number {
    /// Returns the joint of a name's end; `None` if the number has no such joint.
    fn axis(self, end: &str) -> Option<usize> {
        match (self, end) {
            (One(_), "") => Some(0),
            (Joint(_) | JointDegrees(_), "-1" | "-2" | "-3") => {
                Some(usize::from(end.as_bytes()[1] - b'1'))
            }
            _ => None,
        }
    }
}

/// Names of all numbers that can be set, with their units; `ratio` is `ratio-1` to `ratio-3`.
const NUMBERS: [(&str, Option<&Units>, Number); 15] = [
    ("counts-per-turn", None, One(|r| &mut r.counts_per_turn)),
    ("ratio", None, Joint(|r| &mut r.ratio)),
    ("encoder-sign", None, Joint(|r| &mut r.encoder_sign)),
    ("motor-sign", None, Joint(|r| &mut r.motor_sign)),
    (
        "zero-angle",
        Some(&ANGLE),
        JointDegrees(|r| &mut r.zero_rad),
    ),
    (
        "min-angle",
        Some(&ANGLE),
        JointDegrees(|r| &mut r.limits.min_rad),
    ),
    (
        "max-angle",
        Some(&ANGLE),
        JointDegrees(|r| &mut r.limits.max_rad),
    ),
    ("l1", Some(&LENGTH), One(|r| &mut r.l1_mm)),
    ("l2", Some(&LENGTH), One(|r| &mut r.l2_mm)),
    ("gravity-2", Some(&TORQUE), One(|r| &mut r.gravity_2_nm)),
    ("gravity-3", Some(&TORQUE), One(|r| &mut r.gravity_3_nm)),
    (
        "torque-constant",
        Some(&TORQUE_CONSTANT),
        Joint(|r| &mut r.torque_constant),
    ),
    (
        "peak-current",
        Some(&CURRENT),
        Joint(|r| &mut r.peak_current_a),
    ),
    ("max-force", Some(&FORCE), One(|r| &mut r.max_force_n)),
    ("max-speed", Some(&SPEED), One(|r| &mut r.max_speed_mm_s)),
];

/// Names of earlier versions, with the unit in the name, and an example of the present ones.
const RENAMED: [(&str, &str); 10] = [
    ("zero-deg", "zero-angle-1=10deg"),
    ("min-deg", "min-angle-1=-50deg"),
    ("max-deg", "max-angle-1=50deg"),
    ("l1-mm", "l1=215mm"),
    ("l2-mm", "l2=170mm"),
    ("gravity-2-nm", "gravity-2=0.1Nm"),
    ("gravity-3-nm", "gravity-3=0.1Nm"),
    ("peak-a", "peak-current-1=1A"),
    ("max-force-n", "max-force=4N"),
    ("max-speed-mm-s", "max-speed=500mm/s"),
];

impl FromStr for Setting {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').ok_or("a setting is NAME=VALUE")?;
        let known = NUMBERS.iter().find_map(|(known, units, number)| {
            let axis = number.axis(name.strip_prefix(known)?)?;
            Some((*number, *units, axis))
        });
        let (number, units, axis) = known.ok_or_else(|| unknown(name))?;
        let value = match units {
            Some(units) => units.read_single(value),
            None => value
                .trim()
                .parse()
                .map_err(|_| "the value is no number".into()),
        };
        Ok(Self {
            number,
            axis,
            value: value.map_err(|why| format!("{name}: {why}"))?,
        })
    }
}

/// Describes an unknown name: the present name of a renamed number, or all names.
fn unknown(name: &str) -> String {
    let is_renamed = |(old, _): &&(&str, &str)| {
        let end = name.strip_prefix(old);
        end.is_some_and(|end| matches!(end, "" | "-1" | "-2" | "-3"))
    };
    if let Some((_, example)) = RENAMED.iter().find(is_renamed) {
        return format!("{name} is now written with the unit in the value, such as {example}");
    }
    let names = NUMBERS.map(|(name, _, number)| match number {
        One(_) => name.to_owned(),
        Joint(_) | JointDegrees(_) => format!("{name}-1…3"),
    });
    format!("no number is called {name}: there are {}", names.join(", "))
}

impl Setting {
    /// Changes the record; the record is checked later as a whole.
    pub(super) fn apply(&self, record: &mut Calibration) {
        match self.number {
            One(number) => *number(record) = self.value,
            Joint(numbers) => numbers(record)[self.axis] = self.value,
            JointDegrees(numbers) => numbers(record)[self.axis] = self.value.to_radians(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calibration_numbers_are_found_by_name() {
        let mut record = Calibration::PREMIUM_1_5;
        for text in [
            "ratio-2=10.5",
            "l1=21.5cm",
            "gravity-3=-80mNm",
            "max-speed=500",
            "motor-sign-1=-1",
        ] {
            text.parse::<Setting>().expect(text).apply(&mut record);
        }
        assert_eq!((record.ratio.y, record.l1_mm), (10.5, 215.0));
        assert_eq!((record.gravity_3_nm, record.motor_sign.x), (-0.08, -1.0));
        assert_eq!(record.max_speed_mm_s, 500.0);
    }

    #[test]
    fn every_name_changes_something() {
        for (name, _, number) in NUMBERS {
            let name = match number {
                One(_) => name.to_owned(),
                Joint(_) | JointDegrees(_) => format!("{name}-3"),
            };
            let mut record = Calibration::PREMIUM_1_5;
            let setting: Setting = format!("{name}=0.123").parse().expect("a setting");
            setting.apply(&mut record);
            assert_ne!(record, Calibration::PREMIUM_1_5, "{name}");
        }
    }

    #[test]
    fn old_names_are_refused_with_the_present_ones() {
        for (old, example) in RENAMED {
            assert!(example.parse::<Setting>().is_ok(), "{example}");
            for name in [old.to_owned(), format!("{old}-2")] {
                let why = format!("{name}=1").parse::<Setting>().expect_err(&name);
                assert!(why.contains(example) && why.contains(&name), "{why}");
            }
        }
    }

    #[test]
    fn invalid_setting_is_refused() {
        for (bad, part) in [
            ("ratio-1", "NAME=VALUE"),
            ("ratio-4=1", "no number is called ratio-4"),
            ("ratio=1", "ratio-1…3"),
            ("ratio-1=long", "no number"),
            ("l1=long", "a number in mm"),
            ("max-force=4mm", "N, mN"),
            ("colour=1", "l1, l2"),
        ] {
            let why = bad.parse::<Setting>().expect_err(bad);
            assert!(why.contains(part), "{bad}: {why}");
        }
    }
}
