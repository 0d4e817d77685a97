//! Numbers of a calibration record by name, for `--set`.

use std::str::FromStr;

use hapterra_core::Vec3;
use hapterra_core::phantom::Calibration;

/// A number of the record and its new value.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    name: &'static str,
    axis: usize,
    value: f32,
}

/// Names, and whether each axis has one of its own (`ratio-1`).
const NAMES: [(&str, bool); 15] = [
    ("counts-per-turn", false),
    ("ratio", true),
    ("encoder-sign", true),
    ("motor-sign", true),
    ("zero-deg", true),
    ("min-deg", true),
    ("max-deg", true),
    ("l1-mm", false),
    ("l2-mm", false),
    ("gravity-2-nm", false),
    ("gravity-3-nm", false),
    ("torque-constant", true),
    ("peak-a", true),
    ("max-force-n", false),
    ("max-speed-mm-s", false),
];

impl FromStr for Setting {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').ok_or("a setting is NAME=VALUE")?;
        let value = value.trim().parse();
        let value = value.map_err(|_| format!("{name}: the value is no number"))?;
        let known = NAMES.iter().find_map(|(known, by_axis)| match by_axis {
            false => (*known == name).then_some((*known, 0)),
            true => {
                let axis = name.strip_prefix(known)?.strip_prefix('-')?;
                let axis: usize = axis.parse().ok()?;
                (1..=3).contains(&axis).then(|| (*known, axis - 1))
            }
        });
        let (name, axis) = known.ok_or_else(|| {
            let names = NAMES.map(|(name, by_axis)| match by_axis {
                true => format!("{name}-1…3"),
                false => name.to_owned(),
            });
            format!("no number is called {name}: there are {}", names.join(", "))
        })?;
        Ok(Self { name, axis, value })
    }
}

impl Setting {
    /// Changes the record; whether it makes sense is looked at as a whole.
    pub(super) fn apply(&self, record: &mut Calibration) {
        let value = self.value;
        let put = |vector: &mut Vec3, value| vector[self.axis] = value;
        match self.name {
            "counts-per-turn" => record.counts_per_turn = value,
            "ratio" => put(&mut record.ratio, value),
            "encoder-sign" => put(&mut record.encoder_sign, value),
            "motor-sign" => put(&mut record.motor_sign, value),
            "zero-deg" => put(&mut record.zero_rad, value.to_radians()),
            "min-deg" => put(&mut record.limits.min_rad, value.to_radians()),
            "max-deg" => put(&mut record.limits.max_rad, value.to_radians()),
            "l1-mm" => record.l1_mm = value,
            "l2-mm" => record.l2_mm = value,
            "gravity-2-nm" => record.gravity_2_nm = value,
            "gravity-3-nm" => record.gravity_3_nm = value,
            "torque-constant" => put(&mut record.torque_constant, value),
            "peak-a" => put(&mut record.peak_current_a, value),
            "max-force-n" => record.max_force_n = value,
            _ => record.max_speed_mm_s = value,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_by_name() {
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
        for (name, by_axis) in NAMES {
            let name = if by_axis {
                format!("{name}-3")
            } else {
                name.into()
            };
            let mut record = Calibration::PREMIUM_1_5;
            let setting: Setting = format!("{name}=0.123").parse().expect("a setting");
            setting.apply(&mut record);
            assert_ne!(record, Calibration::PREMIUM_1_5, "{name}");
        }
    }

    #[test]
    fn what_is_no_setting_is_told() {
        for bad in ["ratio-1", "ratio-4=1", "ratio=1", "l1-mm=long", "colour=1"] {
            assert!(bad.parse::<Setting>().is_err(), "{bad}");
        }
    }
}
