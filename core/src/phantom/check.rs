//! Checks of calibration records, with remedies.

use core::fmt;

use glam::{BVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::calibration::{Calibration, Model};

/// A number of the record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CalibrationField {
    /// [`Calibration::counts_per_turn`].
    CountsPerTurn,
    /// [`Calibration::ratio`].
    Ratio,
    /// [`Calibration::encoder_sign`].
    EncoderSign,
    /// [`Calibration::motor_sign`].
    MotorSign,
    /// [`Calibration::zero_rad`].
    Zero,
    /// [`Calibration::l1_mm`].
    L1,
    /// [`Calibration::l2_mm`].
    L2,
    /// The joint limits' minimum angles.
    MinAngle,
    /// The joint limits' maximum angles.
    MaxAngle,
    /// The linkage's maximum q2 − q3.
    Q2MinusQ3,
    /// The linkage's maximum q3 − q2.
    Q3MinusQ2,
    /// [`Calibration::gravity_2_nm`].
    Gravity2,
    /// [`Calibration::gravity_3_nm`].
    Gravity3,
    /// [`Calibration::torque_constant`].
    TorqueConstant,
    /// [`Calibration::peak_current_a`].
    PeakCurrent,
    /// [`Calibration::continuous_current_a`].
    ContinuousCurrent,
    /// Winding resistance.
    Resistance,
    /// Thermal resistance from winding to housing.
    WindingResistance,
    /// Thermal resistance from housing to air.
    HousingResistance,
    /// Time constant of the winding.
    WindingTime,
    /// Time constant of the housing.
    HousingTime,
    /// [`Calibration::max_force_n`].
    MaxForce,
    /// [`Calibration::max_speed_mm_s`].
    MaxSpeed,
}

impl CalibrationField {
    /// Returns the minimum and maximum of the valid range, and the unit.
    #[must_use]
    pub const fn range(self) -> (f32, f32, &'static str) {
        const PI: f32 = core::f32::consts::PI;
        match self {
            Self::CountsPerTurn => (100.0, 1e6, "counts"),
            Self::Ratio => (1.0, 100.0, "motor turns a joint turn"),
            Self::EncoderSign | Self::MotorSign => (-1.0, 1.0, "(−1 or +1)"),
            Self::Zero | Self::MinAngle | Self::MaxAngle => (-1.5 * PI, 1.5 * PI, "rad"),
            Self::L1 | Self::L2 => (30.0, 1000.0, "mm"),
            // Below π/2, where the links are in line and the arm is singular.
            Self::Q2MinusQ3 | Self::Q3MinusQ2 => (0.1, 1.5, "rad"),
            Self::Gravity2 | Self::Gravity3 => (-1.0, 1.0, "Nm"),
            Self::TorqueConstant => (1e-3, 1.0, "Nm/A"),
            Self::PeakCurrent | Self::ContinuousCurrent => (0.01, 20.0, "A"),
            Self::Resistance => (0.05, 100.0, "Ω"),
            Self::WindingResistance | Self::HousingResistance => (0.1, 100.0, "K/W"),
            Self::WindingTime => (0.5, 1e3, "s"),
            Self::HousingTime => (10.0, 1e5, "s"),
            Self::MaxForce => (0.1, 40.0, "N"),
            Self::MaxSpeed => (50.0, 3000.0, "mm/s"),
        }
    }

    /// Returns the number's meaning and its source.
    #[must_use]
    pub const fn advice(self) -> &'static str {
        match self {
            Self::CountsPerTurn => "use the encoder's lines times four",
            Self::Ratio => "measure with the ratio check, or count motor turns for a joint turn",
            Self::EncoderSign => "turn the joint towards larger angles: +1 if the counts rise",
            Self::MotorSign => "+1 if a positive current pushes the joint towards larger angles",
            Self::Zero => "enter the joint angles of the zero pose, inside the joint limits",
            Self::L1 => "measure the upper link between its joint axes",
            Self::L2 => "measure the fore link from its joint axis to the tip",
            Self::MinAngle | Self::MaxAngle => {
                "move the joint to its stops and note the angles; the smallest must be below the largest"
            }
            Self::Q2MinusQ3 | Self::Q3MinusQ2 => {
                "move the linkage to its stops; below 90°, where the links would be in line"
            }
            Self::Gravity2 | Self::Gravity3 => {
                "fit gravity again from still poses; the motors must hold the arm permanently"
            }
            Self::TorqueConstant => "use the motor's data sheet",
            Self::PeakCurrent | Self::ContinuousCurrent => {
                "use the motor's data sheet; the continuous current is not above the peak"
            }
            Self::Resistance
            | Self::WindingResistance
            | Self::HousingResistance
            | Self::WindingTime
            | Self::HousingTime => "use the thermal part of the motor's data sheet",
            Self::MaxForce => "use the device's peak force",
            Self::MaxSpeed => "a hand needs about 1000 mm/s",
        }
    }
}

/// Reason why a record is refused.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CalibrationError {
    /// The wrong number.
    pub field: CalibrationField,
    /// The axis, 1 to 3, for a number that each axis has.
    pub axis: Option<u8>,
    /// The number's value.
    pub value: f32,
    /// The violated bound.
    pub bound: Bound,
}

/// The bound that a number violates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Bound {
    /// [`CalibrationField::range`], or its part that the record's other numbers permit.
    Range,
    /// The absolute limit of the record's model, which no record can raise.
    Model {
        /// The model.
        model: Model,
        /// The minimum.
        min: f32,
        /// The maximum.
        max: f32,
    },
    /// The current that the board's outputs can command.
    Board {
        /// The maximum, A.
        max: f32,
    },
}

impl fmt::Display for CalibrationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (min, max, unit) = self.field.range();
        write!(f, "{:?}", self.field)?;
        if let Some(axis) = self.axis {
            write!(f, " of axis {axis}")?;
        }
        write!(f, " is {}, ", self.value)?;
        match self.bound {
            Bound::Range => {
                let advice = self.field.advice();
                write!(f, "expected {min} to {max} {unit}: {advice}")
            }
            Bound::Model { model, min, max } if max.is_finite() => write!(
                f,
                "but a {model:?} may have {min} to {max} {unit}: a record cannot change that; \
                 its model's preset in the firmware can"
            ),
            Bound::Model { model, min, .. } => write!(
                f,
                "but with its ratio a {model:?} has at least {min} {unit}: check the ratio \
                 and the torque constant"
            ),
            Bound::Board { max } => write!(
                f,
                "but this board commands at most {max} {unit}: make the record's peak \
                 current smaller"
            ),
        }
    }
}

impl core::error::Error for CalibrationError {}

impl Calibration {
    /// Checks that every number is in its valid range, and within the model's absolute limits.
    ///
    /// # Errors
    /// Returns a [`CalibrationError`] for the first number that is not.
    pub fn validate(&self) -> Result<(), CalibrationError> {
        let (limits, thermal) = (&self.limits, &self.thermal);
        let (min, max) = (limits.min_rad, limits.max_rad);
        check_number(CalibrationField::CountsPerTurn, self.counts_per_turn)?;
        check_axes(CalibrationField::Ratio, self.ratio)?;
        check_axes_if(
            CalibrationField::EncoderSign,
            self.encoder_sign,
            self.encoder_sign.abs().cmpeq(Vec3::ONE),
        )?;
        check_axes_if(
            CalibrationField::MotorSign,
            self.motor_sign,
            self.motor_sign.abs().cmpeq(Vec3::ONE),
        )?;
        check_number(CalibrationField::L1, self.l1_mm)?;
        check_number(CalibrationField::L2, self.l2_mm)?;
        check_axes(CalibrationField::MinAngle, min)?;
        check_axes(CalibrationField::MaxAngle, max)?;
        check_number(CalibrationField::Q2MinusQ3, limits.q2_minus_q3_max_rad)?;
        check_number(CalibrationField::Q3MinusQ2, limits.q3_minus_q2_max_rad)?;
        check_axes_if(CalibrationField::MaxAngle, max, max.cmpgt(min))?;
        check_axes(CalibrationField::Zero, self.zero_rad)?;
        // Some rigs are zeroed with the arm against its stops.
        let inside = limits.contains(self.zero_rad, 0.05);
        check_axes_if(CalibrationField::Zero, self.zero_rad, BVec3::splat(inside))?;
        check_axes(CalibrationField::TorqueConstant, self.torque_constant)?;
        let (peak, continuous) = (self.peak_current_a, self.continuous_current_a);
        check_axes(CalibrationField::PeakCurrent, peak)?;
        check_axes(CalibrationField::ContinuousCurrent, continuous)?;
        check_axes_if(
            CalibrationField::ContinuousCurrent,
            continuous,
            continuous.cmple(peak),
        )?;
        // Motors that hold the arm must keep a reserve to push: half of their continuous current.
        let max_holding_nm = 0.5 * continuous * self.ratio * self.torque_constant;
        let (gravity_2, gravity_3) = (self.gravity_2_nm, self.gravity_3_nm);
        check_number(CalibrationField::Gravity2, gravity_2)?;
        check_number(CalibrationField::Gravity3, gravity_3)?;
        for (field, value, max) in [
            (CalibrationField::Gravity2, gravity_2, max_holding_nm.y),
            (CalibrationField::Gravity3, gravity_3, max_holding_nm.z),
        ] {
            check(field, None, value, Bound::Range, value.abs() <= max)?;
        }
        check_number(CalibrationField::Resistance, thermal.resistance_ohm)?;
        check_number(CalibrationField::WindingResistance, thermal.winding_k_per_w)?;
        check_number(CalibrationField::HousingResistance, thermal.housing_k_per_w)?;
        check_number(CalibrationField::WindingTime, thermal.winding_s)?;
        check_number(CalibrationField::HousingTime, thermal.housing_s)?;
        check_number(CalibrationField::MaxForce, self.max_force_n)?;
        check_number(CalibrationField::MaxSpeed, self.max_speed_mm_s)?;
        self.check_absolute_limits()
    }
}

/// Returns an error with `field`, `axis`, counted from 0, `value` and the violated `bound`, unless
/// the number is `good`.
pub(super) fn check(
    field: CalibrationField,
    axis: Option<usize>,
    value: f32,
    bound: Bound,
    good: bool,
) -> Result<(), CalibrationError> {
    match good {
        true => Ok(()),
        false => Err(CalibrationError {
            field,
            axis: axis.map(|axis| axis as u8 + 1),
            value,
            bound,
        }),
    }
}

/// Checks a number against its range.
fn check_number(field: CalibrationField, value: f32) -> Result<(), CalibrationError> {
    let (min, max, _) = field.range();
    let good = (min..=max).contains(&value);
    check(field, None, value, Bound::Range, good)
}

/// Checks a number of each axis against its range.
fn check_axes(field: CalibrationField, values: Vec3) -> Result<(), CalibrationError> {
    let (min, max, _) = field.range();
    let (min, max) = (Vec3::splat(min), Vec3::splat(max));
    check_axes_if(field, values, values.cmpge(min) & values.cmple(max))
}

/// Checks a number of each axis against a condition.
fn check_axes_if(
    field: CalibrationField,
    values: Vec3,
    good: BVec3,
) -> Result<(), CalibrationError> {
    (0..3).try_for_each(|axis| {
        let (value, good) = (values[axis], good.test(axis));
        check(field, Some(axis), value, Bound::Range, good)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;

    /// A record with one fault, and the expected message.
    type Case = (fn(&mut Calibration), CalibrationField, Option<u8>);

    /// Safety: 17.
    #[test]
    fn error_names_each_wrong_number() {
        let cases: [Case; 24] = [
            (
                |c| c.counts_per_turn = 0.0,
                CalibrationField::CountsPerTurn,
                None,
            ),
            (|c| c.ratio.y = -11.2, CalibrationField::Ratio, Some(2)),
            (
                |c| c.encoder_sign.x = 0.5,
                CalibrationField::EncoderSign,
                Some(1),
            ),
            (
                |c| c.motor_sign.z = 0.0,
                CalibrationField::MotorSign,
                Some(3),
            ),
            (|c| c.zero_rad.x = 1.7, CalibrationField::Zero, Some(1)),
            (|c| c.zero_rad.z = f32::NAN, CalibrationField::Zero, Some(3)),
            (|c| c.l1_mm = f32::INFINITY, CalibrationField::L1, None),
            (|c| c.l2_mm = 0.17, CalibrationField::L2, None),
            (
                |c| c.limits.min_rad.x = -90.0,
                CalibrationField::MinAngle,
                Some(1),
            ),
            (
                |c| c.limits.max_rad.z = -1.0,
                CalibrationField::MaxAngle,
                Some(3),
            ),
            (
                |c| c.limits.q2_minus_q3_max_rad = 1.6,
                CalibrationField::Q2MinusQ3,
                None,
            ),
            (
                |c| c.limits.q3_minus_q2_max_rad = 0.0,
                CalibrationField::Q3MinusQ2,
                None,
            ),
            (|c| c.gravity_2_nm = 2.0, CalibrationField::Gravity2, None),
            // In range, but more than the motor can hold.
            (|c| c.gravity_3_nm = 0.9, CalibrationField::Gravity3, None),
            (
                |c| c.torque_constant.x = 0.0,
                CalibrationField::TorqueConstant,
                Some(1),
            ),
            (
                |c| c.peak_current_a.y = 99.0,
                CalibrationField::PeakCurrent,
                Some(2),
            ),
            (
                |c| c.continuous_current_a.z = 6.0,
                CalibrationField::ContinuousCurrent,
                Some(3),
            ),
            (
                |c| c.thermal.resistance_ohm = -1.0,
                CalibrationField::Resistance,
                None,
            ),
            (
                |c| c.thermal.winding_k_per_w = f32::NAN,
                CalibrationField::WindingResistance,
                None,
            ),
            (
                |c| c.thermal.housing_k_per_w = 0.0,
                CalibrationField::HousingResistance,
                None,
            ),
            (
                |c| c.thermal.winding_s = 0.0,
                CalibrationField::WindingTime,
                None,
            ),
            (
                |c| c.thermal.housing_s = 1.0,
                CalibrationField::HousingTime,
                None,
            ),
            (|c| c.max_force_n = 100.0, CalibrationField::MaxForce, None),
            (|c| c.max_speed_mm_s = 0.0, CalibrationField::MaxSpeed, None),
        ];
        for (spoil, field, axis) in cases {
            let mut record = Calibration::PREMIUM_1_5;
            spoil(&mut record);
            let bad = record.validate().expect_err("spoilt");
            assert_eq!((bad.field, bad.axis), (field, axis), "{bad}");
        }
    }

    #[test]
    fn range_error_names_value_range_and_remedy() {
        let record = Calibration {
            l1_mm: 3.0,
            ..Calibration::PREMIUM_1_5
        };
        let message = format!("{}", record.validate().expect_err("too short"));
        assert_eq!(
            message,
            "L1 is 3, expected 30 to 1000 mm: measure the upper link between its joint axes"
        );
    }
}
