//! Numbers of a calibration record by name, for `--set`.

use std::str::FromStr;

use hapterra_core::Vec3;
use hapterra_core::phantom::Calibration;

/// A number of the record and its new value.
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

/// Names of all numbers that can be set; `ratio` is `ratio-1` to `ratio-3`.
const NUMBERS: [(&str, Number); 15] = [
    ("counts-per-turn", One(|r| &mut r.counts_per_turn)),
    ("ratio", Joint(|r| &mut r.ratio)),
    ("encoder-sign", Joint(|r| &mut r.encoder_sign)),
    ("motor-sign", Joint(|r| &mut r.motor_sign)),
    ("zero-deg", JointDegrees(|r| &mut r.zero_rad)),
    ("min-deg", JointDegrees(|r| &mut r.limits.min_rad)),
    ("max-deg", JointDegrees(|r| &mut r.limits.max_rad)),
    ("l1-mm", One(|r| &mut r.l1_mm)),
    ("l2-mm", One(|r| &mut r.l2_mm)),
    ("gravity-2-nm", One(|r| &mut r.gravity_2_nm)),
    ("gravity-3-nm", One(|r| &mut r.gravity_3_nm)),
    ("torque-constant", Joint(|r| &mut r.torque_constant)),
    ("peak-a", Joint(|r| &mut r.peak_current_a)),
    ("max-force-n", One(|r| &mut r.max_force_n)),
    ("max-speed-mm-s", One(|r| &mut r.max_speed_mm_s)),
];

impl FromStr for Setting {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').ok_or("a setting is NAME=VALUE")?;
        let value = value.trim().parse();
        let value = value.map_err(|_| format!("{name}: the value is no number"))?;
        let known = NUMBERS.iter().find_map(|(known, number)| {
            let rest = name.strip_prefix(known)?;
            let axis = match (number, rest) {
                (One(_), "") => 0,
                (Joint(_) | JointDegrees(_), "-1" | "-2" | "-3") => {
                    usize::from(rest.as_bytes()[1] - b'1')
                }
                _ => return None,
            };
            Some((*number, axis))
        });
        let (number, axis) = known.ok_or_else(|| {
            let names = NUMBERS.map(|(name, number)| match number {
                One(_) => name.to_owned(),
                Joint(_) | JointDegrees(_) => format!("{name}-1…3"),
            });
            format!("no number is called {name}: there are {}", names.join(", "))
        })?;
        Ok(Self {
            number,
            axis,
            value,
        })
    }
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
            "l1-mm=215",
            "gravity-3-nm=-0.08",
            "motor-sign-1=-1",
        ] {
            text.parse::<Setting>().expect(text).apply(&mut record);
        }
        assert_eq!((record.ratio.y, record.l1_mm), (10.5, 215.0));
        assert_eq!((record.gravity_3_nm, record.motor_sign.x), (-0.08, -1.0));
    }

    #[test]
    fn every_name_changes_something() {
        for (name, number) in NUMBERS {
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
    fn invalid_setting_is_refused() {
        for bad in ["ratio-1", "ratio-4=1", "ratio=1", "l1-mm=long", "colour=1"] {
            assert!(bad.parse::<Setting>().is_err(), "{bad}");
        }
    }
}
