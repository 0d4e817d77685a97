//! Absolute limits of each model and of the board, which no calibration record can raise.
//!
//! The guard enforces the values of a record. A mistyped or hostile record could state a motor that
//! bears 20 A or that never warms, which would disable the protection. So the numbers that protect
//! a person's hand and the motors are limited on the dangerous side by those of the model's preset.
//! A record may be more careful, never less. Users of stronger motors change the presets and build
//! the firmware.
//!
//! [`Calibration::validate`] checks all of these but the board's, so they hold wherever a record is
//! set, stored or read.

use glam::Vec3;

use super::calibration::Calibration;
use super::check::{Bound, CalibrationError, CalibrationField, check};

/// Maximum ratio of a record's speed limit to the preset's: at twice the limit no force is left,
/// which must be below the speed at which counts are a jump.
const SPEED_SHARE: f32 = 1.25;
/// Minimum torque of a joint per ampere, as a share of the preset's: below it the joint's real
/// force would be more than twice the one that the force limits assume. Ratios and torque constants
/// of one model differ by less.
const LEVERAGE_SHARE: f32 = 0.5;
/// Maximum ratio of a link's length to the preset's: for the same torque a longer link means a
/// smaller computed force, so the true force would exceed the clamped one.
const LINK_SHARE: f32 = 1.15;
/// Valid counts per radian, as shares of the preset's. A record with more counts under-reads every
/// angle and speed by the same factor; half of them fits another encoder.
const COUNTS_SHARE: (f32, f32) = (0.5, 1.25);
/// The same if the preset's ratios are estimates.
const COUNTS_SHARE_OF_A_GUESS: (f32, f32) = (0.5, 2.0);
/// Maximum by which stops may be wider than the preset's: 5°.
const STOPS_RAD: f32 = 5.0 * (core::f32::consts::PI / 180.0);
/// Tolerance for the rounding of numbers that were written in other units.
const ROUNDING: f32 = 1e-4;

impl Calibration {
    /// Checks that the record stays within its model's absolute limits.
    pub(super) fn check_absolute_limits(&self) -> Result<(), CalibrationError> {
        let preset = self.model.preset();
        let (mine, theirs) = (&self.thermal, &preset.thermal);
        let (peak, continuous) = (self.peak_current_a, self.continuous_current_a);
        self.check_each_max(CalibrationField::PeakCurrent, peak, preset.peak_current_a)?;
        let max = preset.continuous_current_a;
        self.check_each_max(CalibrationField::ContinuousCurrent, continuous, max)?;
        // A motor model that warms less than the preset's, or later, is dangerous.
        self.check_min(
            CalibrationField::Resistance,
            mine.resistance_ohm,
            theirs.resistance_ohm,
        )?;
        self.check_min(
            CalibrationField::WindingResistance,
            mine.winding_k_per_w,
            theirs.winding_k_per_w,
        )?;
        self.check_min(
            CalibrationField::HousingResistance,
            mine.housing_k_per_w,
            theirs.housing_k_per_w,
        )?;
        self.check_max(
            CalibrationField::WindingTime,
            mine.winding_s,
            theirs.winding_s,
        )?;
        self.check_max(
            CalibrationField::HousingTime,
            mine.housing_s,
            theirs.housing_s,
        )?;
        self.check_max(
            CalibrationField::MaxForce,
            self.max_force_n,
            preset.max_force_n,
        )?;
        self.check_max(
            CalibrationField::MaxSpeed,
            self.max_speed_mm_s,
            SPEED_SHARE * preset.max_speed_mm_s,
        )?;
        self.check_geometry(&preset)?;
        let leverage = preset.ratio * preset.torque_constant;
        let min = LEVERAGE_SHARE * leverage / self.ratio;
        for axis in 0..3 {
            let (value, min) = (self.torque_constant[axis], min[axis]);
            let bound = self.bound(min, f32::INFINITY);
            let good = value >= min * (1.0 - ROUNDING);
            check(
                CalibrationField::TorqueConstant,
                Some(axis),
                value,
                bound,
                good,
            )?;
        }
        Ok(())
    }

    /// Checks that the arm has about the size, the count resolution and the range of its model.
    fn check_geometry(&self, preset: &Self) -> Result<(), CalibrationError> {
        self.check_max(CalibrationField::L1, self.l1_mm, LINK_SHARE * preset.l1_mm)?;
        self.check_max(CalibrationField::L2, self.l2_mm, LINK_SHARE * preset.l2_mm)?;
        self.check_counts(preset)?;
        let (mine, theirs) = (&self.limits, &preset.limits);
        let widest = theirs.max_rad + Vec3::splat(STOPS_RAD);
        self.check_each_max(CalibrationField::MaxAngle, mine.max_rad, widest)?;
        for axis in 0..3 {
            let (value, min) = (mine.min_rad[axis], theirs.min_rad[axis] - STOPS_RAD);
            let bound = self.bound(min, CalibrationField::MinAngle.range().1);
            let good = value >= min - ROUNDING;
            check(CalibrationField::MinAngle, Some(axis), value, bound, good)?;
        }
        self.check_max(
            CalibrationField::Q2MinusQ3,
            mine.q2_minus_q3_max_rad,
            theirs.q2_minus_q3_max_rad + STOPS_RAD,
        )?;
        self.check_max(
            CalibrationField::Q3MinusQ2,
            mine.q3_minus_q2_max_rad,
            theirs.q3_minus_q2_max_rad + STOPS_RAD,
        )
    }

    /// Checks that each joint has about as many counts per radian as the model's. If not, the error
    /// contains the number that is farther from the preset's.
    fn check_counts(&self, preset: &Self) -> Result<(), CalibrationError> {
        let (min, max) = match preset.has_guessed_ratios() {
            true => COUNTS_SHARE_OF_A_GUESS,
            false => COUNTS_SHARE,
        };
        let within =
            |share: f32| share >= min * (1.0 - ROUNDING) && share <= max * (1.0 + ROUNDING);
        let of_encoder = self.counts_per_turn / preset.counts_per_turn;
        for axis in 0..3 {
            let of_ratio = self.ratio[axis] / preset.ratio[axis];
            let good = within(of_encoder * of_ratio);
            let (field, at, value) = match within(of_encoder) {
                true => (CalibrationField::Ratio, Some(axis), self.ratio[axis]),
                false => (CalibrationField::CountsPerTurn, None, self.counts_per_turn),
            };
            // The number that would result in the preset's counts, with the other number unchanged.
            let unit = value / (of_encoder * of_ratio);
            check(field, at, value, self.bound(min * unit, max * unit), good)?;
        }
        Ok(())
    }

    /// Checks that the board can command every current of the record. `full_scale_a` is the current
    /// at the ends of its outputs' range, A.
    ///
    /// # Errors
    /// Returns a [`CalibrationError`] with the axis.
    pub fn check_board(&self, full_scale_a: f32) -> Result<(), CalibrationError> {
        for axis in 0..3 {
            let value = self.peak_current_a[axis];
            let bound = Bound::Board { max: full_scale_a };
            let good = value <= full_scale_a * (1.0 + ROUNDING);
            check(
                CalibrationField::PeakCurrent,
                Some(axis),
                value,
                bound,
                good,
            )?;
        }
        Ok(())
    }

    const fn bound(&self, min: f32, max: f32) -> Bound {
        Bound::Model {
            model: self.model,
            min,
            max,
        }
    }

    fn check_each_max(
        &self,
        field: CalibrationField,
        values: Vec3,
        max: Vec3,
    ) -> Result<(), CalibrationError> {
        for axis in 0..3 {
            let (value, max) = (values[axis], max[axis]);
            let bound = self.bound(field.range().0, max);
            let good = value <= max * (1.0 + ROUNDING);
            check(field, Some(axis), value, bound, good)?;
        }
        Ok(())
    }

    fn check_max(
        &self,
        field: CalibrationField,
        value: f32,
        max: f32,
    ) -> Result<(), CalibrationError> {
        let bound = self.bound(field.range().0, max);
        check(field, None, value, bound, value <= max * (1.0 + ROUNDING))
    }

    fn check_min(
        &self,
        field: CalibrationField,
        value: f32,
        min: f32,
    ) -> Result<(), CalibrationError> {
        let bound = self.bound(min, field.range().1);
        check(field, None, value, bound, value >= min * (1.0 - ROUNDING))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::phantom::Model;
    use std::format;

    const MODELS: [Model; 5] = [
        Model::Premium10,
        Model::Premium15,
        Model::Premium30,
        Model::Omni,
        Model::Other,
    ];

    /// A change to the dangerous side, and the field and axis of the expected error.
    type Case = (fn(&mut Calibration), CalibrationField, Option<u8>);

    /// Each number is within its own range, so that only the absolute limit can refuse it.
    const RAISED: [Case; 19] = [
        (
            |c| c.peak_current_a.x *= 1.01,
            CalibrationField::PeakCurrent,
            Some(1),
        ),
        (
            |c| c.continuous_current_a.y *= 1.01,
            CalibrationField::ContinuousCurrent,
            Some(2),
        ),
        (
            |c| c.thermal.resistance_ohm *= 0.99,
            CalibrationField::Resistance,
            None,
        ),
        (
            |c| c.thermal.winding_k_per_w *= 0.99,
            CalibrationField::WindingResistance,
            None,
        ),
        (
            |c| c.thermal.housing_k_per_w = 0.1,
            CalibrationField::HousingResistance,
            None,
        ),
        (
            |c| c.thermal.winding_s *= 1.01,
            CalibrationField::WindingTime,
            None,
        ),
        (
            |c| c.thermal.housing_s *= 1.01,
            CalibrationField::HousingTime,
            None,
        ),
        (|c| c.max_force_n *= 1.01, CalibrationField::MaxForce, None),
        (
            |c| c.max_speed_mm_s *= 1.26,
            CalibrationField::MaxSpeed,
            None,
        ),
        (
            |c| c.torque_constant.z *= 0.49,
            CalibrationField::TorqueConstant,
            Some(3),
        ),
        (
            |c| {
                c.ratio.x *= 0.6;
                c.torque_constant.x *= 0.8;
            },
            CalibrationField::TorqueConstant,
            Some(1),
        ),
        (|c| c.l1_mm *= 1.2, CalibrationField::L1, None),
        (|c| c.l2_mm *= 2.0, CalibrationField::L2, None),
        (
            |c| {
                c.ratio.y *= 2.5;
                c.torque_constant.y /= 2.5;
            },
            CalibrationField::Ratio,
            Some(2),
        ),
        (|c| c.ratio.x *= 0.49, CalibrationField::Ratio, Some(1)),
        (
            |c| c.counts_per_turn *= 10.0,
            CalibrationField::CountsPerTurn,
            None,
        ),
        (
            |c| c.limits.max_rad.z += 0.1,
            CalibrationField::MaxAngle,
            Some(3),
        ),
        (
            |c| c.limits.min_rad.y -= 0.1,
            CalibrationField::MinAngle,
            Some(2),
        ),
        (
            |c| c.limits.q2_minus_q3_max_rad += 0.1,
            CalibrationField::Q2MinusQ3,
            None,
        ),
    ];

    /// Safety: 18, images.
    #[test]
    fn record_beyond_any_model_limit_is_refused() {
        for model in MODELS {
            for (raise, field, axis) in RAISED {
                let mut record = model.preset();
                raise(&mut record);
                let bad = record.validate().expect_err("raised");
                assert_eq!((bad.field, bad.axis), (field, axis), "{model:?}: {bad}");
                assert!(matches!(bad.bound, Bound::Model { .. }), "{bad}");
            }
        }
    }

    #[test]
    fn record_below_its_model_limits_is_valid() {
        for model in MODELS {
            let mut record = model.preset();
            record.peak_current_a *= 0.5;
            record.continuous_current_a *= 0.5;
            record.thermal.resistance_ohm *= 1.2;
            record.thermal.winding_s *= 0.5;
            record.max_force_n *= 0.5;
            record.max_speed_mm_s *= 0.5;
            record.torque_constant *= 1.1;
            assert_eq!(record.validate(), Ok(()), "{model:?}");
        }
    }

    /// Safety: 18.
    #[test]
    fn peak_current_above_board_limit_is_refused() {
        let record = Calibration::PREMIUM_1_5;
        assert_eq!(record.check_board(5.5), Ok(()));
        let bad = record.check_board(4.83).expect_err("too much");
        assert_eq!(
            (bad.field, bad.axis),
            (CalibrationField::PeakCurrent, Some(1))
        );
        assert_eq!(
            format!("{bad}"),
            "PeakCurrent of axis 1 is 5.5, but this board commands at most 4.83 A: \
             make the record's peak current smaller"
        );
    }

    #[test]
    fn limit_error_names_the_model_and_its_range() {
        let mut record = Calibration::PREMIUM_1_5;
        record.max_force_n = 20.0;
        assert_eq!(
            format!("{}", record.validate().expect_err("raised")),
            "MaxForce is 20, but a Premium15 may have 0.1 to 8.5 N: a record cannot change \
             that; its model's preset in the firmware can"
        );
    }
}
