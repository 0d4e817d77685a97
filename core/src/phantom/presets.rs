//! Calibration records to start from.
//!
//! Sources: `mahilab/Phantom` (a Premium 1.5 measured and driven, CAD and motor
//! data), Çavuşoğlu, Feygin & Tendick (Presence, 2002), CHAI3D's device limits.
//! A number with one weak source or none is marked *uncertain*: measure it before the first force.

use glam::Vec3;

use super::calibration::{Calibration, JointLimits, Model, Thermal};

/// Converts degrees to radians, as a constant function.
const fn rad(degrees: f32) -> f32 {
    degrees * (core::f32::consts::PI / 180.0)
}

/// The stops of a Premium 1.5 (CAD).
const PREMIUM_STOPS: JointLimits = JointLimits {
    min_rad: Vec3::new(rad(-90.0), rad(-124.0), rad(-29.0)),
    max_rad: Vec3::new(rad(90.0), rad(119.0), rad(214.0)),
    q2_minus_q3_max_rad: rad(65.0),
    q3_minus_q2_max_rad: rad(55.0),
};

/// Maxon RE25 118743 (data sheet): 2.18 Ω at 25 °C, hot 2.82 Ω.
const RE25: Thermal = Thermal {
    resistance_ohm: 2.82,
    winding_k_per_w: 3.1,
    housing_k_per_w: 14.0,
    winding_s: 12.0,
    housing_s: 612.0,
};

impl Model {
    /// Returns the record to start from; for [`Model::Other`], that of a Premium 1.5.
    #[must_use]
    pub const fn preset(self) -> Calibration {
        match self {
            Self::Premium10 => Calibration::PREMIUM_1_0,
            Self::Premium15 => Calibration::PREMIUM_1_5,
            Self::Premium30 => Calibration::PREMIUM_3_0,
            Self::Omni => Calibration::OMNI,
            Self::Other => Calibration {
                model: Self::Other,
                ..Calibration::PREMIUM_1_5
            },
        }
    }
}

impl Calibration {
    /// Returns true if the cable ratios are still those of a preset without a published
    /// measurement, that is, of every model but the Premium 1.5. The ratios' error is also the
    /// error of positions and forces, so a calibration measures them.
    #[must_use]
    pub fn has_guessed_ratios(&self) -> bool {
        let is_published = matches!(self.model, Model::Premium15 | Model::Other);
        !is_published && self.ratio == self.model.preset().ratio
    }

    /// Phantom Premium 1.5. Link lengths, stops and motors from CAD and data
    /// sheet (C2002 has 215 and 170 mm); gravity without stylus from C2002
    /// (−0.0117 and −0.0873 Nm by CAD). Uncertain: the cable ratios; the signs,
    /// which depend on the wiring.
    pub const PREMIUM_1_5: Self = Self {
        model: Model::Premium15,
        counts_per_turn: 4096.0,
        ratio: Vec3::new(13.3, 11.2, 11.2),
        encoder_sign: Vec3::ONE,
        motor_sign: Vec3::ONE,
        zero_rad: Vec3::ZERO,
        l1_mm: 209.55,
        l2_mm: 169.545,
        limits: PREMIUM_STOPS,
        gravity_2_nm: -0.0163,
        gravity_3_nm: -0.0738,
        torque_constant: Vec3::splat(0.0234),
        peak_current_a: Vec3::splat(5.5),
        continuous_current_a: Vec3::splat(1.24),
        thermal: RE25,
        max_force_n: 8.5,
        max_speed_mm_s: 1000.0,
    };

    /// Phantom Premium 1.0: 8.5 N. Uncertain: link lengths (140 mm), and everything else, which is
    /// copied from a Premium 1.5. Gravity must be measured.
    ///
    /// The ratios contradict the published resolution of 0.03 mm for this model. No source shows
    /// which is wrong, so the ruler of the calibration decides. Encoder counts per millimetre of
    /// the tip near the home pose:
    ///
    /// | axis | with this preset's 13.3, 11.2, 11.2 | with 7.2, 7.2, 7.2 |
    /// | --- | --- | --- |
    /// | 1, tip to the right | 62 counts (16 µm a count) | 34 counts (30 µm) |
    /// | 2, tip up | 52 counts (19 µm) | 34 counts (30 µm) |
    /// | 3, tip towards the user | 52 counts (19 µm) | 34 counts (30 µm) |
    ///
    /// With the wrong ratios, motions and forces are rendered 1.6 to 1.8 times too large or too
    /// small. The absolute limits permit both.
    pub const PREMIUM_1_0: Self = Self {
        model: Model::Premium10,
        l1_mm: 140.0,
        l2_mm: 140.0,
        gravity_2_nm: 0.0,
        gravity_3_nm: 0.0,
        ..Self::PREMIUM_1_5
    };

    /// Phantom Premium 3.0: 22 N, 0.02 mm a count. Uncertain: everything. The links are a Premium
    /// 1.5's scaled by the workspaces' widths (838/381 mm), the ratios follow from 0.02 mm a count,
    /// motors and stops are a Premium 1.5's. Gravity must be measured.
    pub const PREMIUM_3_0: Self = Self {
        model: Model::Premium30,
        ratio: Vec3::new(35.0, 35.0, 29.0),
        l1_mm: 461.0,
        l2_mm: 373.0,
        gravity_2_nm: 0.0,
        gravity_3_nm: 0.0,
        max_force_n: 22.0,
        ..Self::PREMIUM_1_5
    };

    /// Phantom Omni (Touch): 133.35 mm links, 3.3 N, 0.055 mm a count. Uncertain: the ratios, which
    /// follow from that, and stops and motors, which are cautious estimates. Gravity must be
    /// measured.
    pub const OMNI: Self = Self {
        model: Model::Omni,
        ratio: Vec3::splat(3.72),
        l1_mm: 133.35,
        l2_mm: 133.35,
        limits: JointLimits {
            min_rad: Vec3::new(rad(-55.0), rad(-60.0), rad(-29.0)),
            max_rad: Vec3::new(rad(55.0), rad(105.0), rad(120.0)),
            ..PREMIUM_STOPS
        },
        gravity_2_nm: 0.0,
        gravity_3_nm: 0.0,
        torque_constant: Vec3::splat(0.02),
        peak_current_a: Vec3::splat(2.0),
        continuous_current_a: Vec3::splat(0.5),
        max_force_n: 3.3,
        ..Self::PREMIUM_1_5
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the tables here and in docs/reference/hardware.md.
    ///
    /// Safety: images.
    #[test]
    fn premium_1_0_resolution_matches_tables_for_both_ratios() {
        let counts_a_mm = |ratio: Vec3| {
            let record = Calibration {
                ratio,
                ..Calibration::PREMIUM_1_0
            };
            assert_eq!(record.validate(), Ok(()));
            // In the home pose the levers of the three axes are l1, l1 and l2.
            let levers_mm = Vec3::new(record.l1_mm, record.l1_mm, record.l2_mm);
            (record.counts_per_radian() / levers_mm).to_array()
        };
        let preset = counts_a_mm(Calibration::PREMIUM_1_0.ratio).map(libm::roundf);
        assert_eq!(preset, [62.0, 52.0, 52.0]);
        let other = counts_a_mm(Vec3::splat(7.2));
        assert_eq!(other.map(libm::roundf), [34.0, 34.0, 34.0]);
        // 0.03 mm a count.
        assert!((1.0 / other[0] - 0.03).abs() < 2e-4, "{other:?}");
    }

    #[test]
    fn ratios_are_a_guess_until_they_were_measured() {
        for model in [Model::Premium10, Model::Premium30, Model::Omni] {
            let mut record = model.preset();
            assert!(record.has_guessed_ratios(), "{model:?}");
            record.ratio.x *= 1.01;
            assert!(!record.has_guessed_ratios(), "{model:?}");
        }
        assert!(!Calibration::PREMIUM_1_5.has_guessed_ratios());
    }

    #[test]
    fn every_preset_is_valid_and_names_its_model() {
        for model in [
            Model::Premium10,
            Model::Premium15,
            Model::Premium30,
            Model::Omni,
            Model::Other,
        ] {
            let preset = model.preset();
            assert_eq!(preset.model, model);
            assert_eq!(preset.validate(), Ok(()), "{model:?}");
        }
    }
}
