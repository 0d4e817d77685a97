//! A calibration record prepared for the tick: constants are computed once, outside of it.

use glam::Vec3;

use super::calibration::Calibration;
use super::check::CalibrationError;
use super::kinematics::Pose;

/// A valid calibration record and the constants derived from it.
///
/// Converts encoder counts to the tip position, and a force at the tip to motor currents:
///
/// ```
/// use hapterra_core::Vec3;
/// use hapterra_core::phantom::{Calibration, Kinematics};
///
/// let mechanism = Kinematics::new(&Calibration::PREMIUM_1_5)?;
/// let pose = mechanism.pose([0, 0, 0], [0, 0, 0]); // in the zero pose
/// // Device frame: x toward the user, z up; the fore link hangs down.
/// assert!((pose.tip_mm() - Vec3::new(209.55, 0.0, -169.545)).length() < 1e-3);
/// // One newton up at the end of the upper link: 0.20955 Nm in joint 2.
/// let torques_nm = pose.torques_nm(Vec3::Z);
/// assert!((torques_nm - Vec3::Y * 0.209_55).length() < 1e-6);
/// let amperes = mechanism.currents_a(torques_nm);
/// assert!((amperes.y - 0.209_55 / (11.2 * 0.0234)).abs() < 1e-4);
///
/// // And back from a tip to angles and counts.
/// let angles = mechanism.calibration().joints_at(pose.tip_mm()).expect("in reach");
/// assert_eq!(mechanism.counts(angles, [0, 0, 0]), [0, 0, 0]);
/// # Ok::<(), hapterra_core::phantom::CalibrationError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kinematics {
    calibration: Calibration,
    radians_per_count: Vec3,
    amperes_per_nm: Vec3,
    home_mm: Vec3,
}

impl Kinematics {
    /// Checks a record and prepares it.
    ///
    /// # Errors
    /// Returns a [`CalibrationError`] with the invalid number.
    pub fn new(calibration: &Calibration) -> Result<Self, CalibrationError> {
        calibration.validate()?;
        let per_ampere = calibration.motor_sign * calibration.ratio * calibration.torque_constant;
        Ok(Self {
            calibration: *calibration,
            radians_per_count: calibration.counts_per_radian().recip(),
            amperes_per_nm: per_ampere.recip(),
            home_mm: Pose::from_angles(calibration, Vec3::ZERO).tip_mm(),
        })
    }

    /// Returns the calibration record.
    #[must_use]
    pub const fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Returns the radians of each joint per count of its encoder, with their signs.
    #[must_use]
    pub const fn radians_per_count(&self) -> Vec3 {
        self.radians_per_count
    }

    /// Returns the tip position with all joint angles zero, device frame, mm.
    #[must_use]
    pub const fn home_mm(&self) -> Vec3 {
        self.home_mm
    }

    /// Returns the joint angles at encoder counts, given the counts in the zero pose.
    #[must_use]
    pub fn angles(&self, counts: [i32; 3], zero: [i32; 3]) -> Vec3 {
        let turned = |axis: usize| counts[axis].wrapping_sub(zero[axis]) as f32;
        let turned = Vec3::new(turned(0), turned(1), turned(2));
        self.calibration.zero_rad + turned * self.radians_per_count
    }

    /// Returns the pose at encoder counts, given the counts in the zero pose.
    ///
    /// Its tip is within 1 µm of f64 over the whole workspace of every preset (tested by a sweep).
    #[must_use]
    pub fn pose(&self, counts: [i32; 3], zero: [i32; 3]) -> Pose {
        Pose::from_angles(&self.calibration, self.angles(counts, zero))
    }

    /// Returns the counts nearest to a pose, given the counts in the zero pose.
    #[must_use]
    pub fn counts(&self, q: Vec3, zero: [i32; 3]) -> [i32; 3] {
        let turned = (q - self.calibration.zero_rad) / self.radians_per_count;
        let turned = turned.to_array().map(libm::roundf);
        core::array::from_fn(|axis| zero[axis].wrapping_add(turned[axis] as i32))
    }

    /// Returns the torques in Nm that hold the arm against its weight.
    #[must_use]
    pub fn gravity_nm(&self, pose: &Pose) -> Vec3 {
        let record = &self.calibration;
        Vec3::new(
            0.0,
            record.gravity_2_nm * pose.cos.y,
            record.gravity_3_nm * pose.sin.z,
        )
    }

    /// Returns the motor currents in amperes for joint torques in Nm.
    #[must_use]
    pub fn currents_a(&self, torques_nm: Vec3) -> Vec3 {
        torques_nm * self.amperes_per_nm
    }
}

#[cfg(test)]
#[path = "mechanism_tests.rs"]
mod tests;
