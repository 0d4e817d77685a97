//! The weight on joints 2 and 3, from poses in which an instrument holds the arm still and measures
//! the force.

use glam::DVec3;
use hapterra_core::phantom::Calibration;

use super::arm::Arm;
use super::fit_error::FitError;

/// Newtons of a gram's weight, at the standard acceleration of free fall.
pub const N_PER_GRAM: f64 = 9.806_65e-3;

/// An arm held still, the motors off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticPose {
    /// Joint angles, rad.
    pub q_rad: [f64; 3],
    /// The holding force at the tip, N, device frame.
    pub force_n: [f64; 3],
}

/// The weights on joints 2 and 3 that fit the poses best, Nm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GravityFit {
    /// As [`Calibration::gravity_2_nm`].
    pub gravity_2_nm: f64,
    /// As [`Calibration::gravity_3_nm`].
    pub gravity_3_nm: f64,
    /// Root mean square of the residuals, Nm: the joints' friction.
    pub residual_nm: f64,
}

impl GravityFit {
    /// Sets the weights in a record.
    pub fn apply(&self, record: &mut Calibration) {
        record.gravity_2_nm = self.gravity_2_nm as f32;
        record.gravity_3_nm = self.gravity_3_nm as f32;
    }
}

/// Fits the weights to the poses by least squares. The joints' friction, 0.01 Nm, limits the
/// accuracy of each pose.
///
/// # Errors
/// [`FitError::NoWeight`]: all poses have joint 2 upright, or joint 3 hanging.
pub fn fit_gravity(record: &Calibration, poses: &[StaticPose]) -> Result<GravityFit, FitError> {
    let arm = Arm::of(record);
    // For each pose: the factor of the weight, and the torque.
    let torque_of = |pose: &StaticPose| {
        let (q_rad, force_n) = (DVec3::from(pose.q_rad), DVec3::from(pose.force_n));
        let torque = arm.torques_nm(q_rad, force_n);
        [
            (libm::cos(q_rad.y), torque.y),
            (libm::sin(q_rad.z), torque.z),
        ]
    };
    let torque_of: Vec<_> = poses.iter().map(torque_of).collect();
    let weight = |joint: usize| {
        let (share, torque) = torque_of.iter().fold((0.0, 0.0), |(share, torque), pose| {
            let (s, t) = pose[joint];
            (share + s * s, torque + s * t)
        });
        match share > 0.05 {
            true => Ok(torque / share),
            false => Err(FitError::NoWeight { joint: joint + 2 }),
        }
    };
    let (gravity_2_nm, gravity_3_nm) = (weight(0)?, weight(1)?);
    let weights = [gravity_2_nm, gravity_3_nm];
    let sum_of_squares: f64 = torque_of
        .iter()
        .flat_map(|pose| pose.iter().zip(weights))
        .map(|((share, torque), weight)| (torque - weight * share).powi(2))
        .sum();
    Ok(GravityFit {
        gravity_2_nm,
        gravity_3_nm,
        residual_nm: libm::sqrt(sum_of_squares / (2 * torque_of.len()) as f64),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the force at the tip that holds the weights in a pose with q1 = 0.
    fn holding(q: [f64; 3], weights: [f64; 2]) -> StaticPose {
        let record = Calibration::PREMIUM_1_5;
        let (l1, l2) = (
            1e-3 * f64::from(record.l1_mm),
            1e-3 * f64::from(record.l2_mm),
        );
        let (two, three) = (weights[0] * libm::cos(q[1]), weights[1] * libm::sin(q[2]));
        // τ2 = l1·(c2·z − s2·x), τ3 = l2·(c3·x + s3·z)
        let (a, b) = (-l1 * libm::sin(q[1]), l1 * libm::cos(q[1]));
        let (c, d) = (l2 * libm::cos(q[2]), l2 * libm::sin(q[2]));
        let whole = a * d - b * c;
        StaticPose {
            q_rad: q,
            force_n: [
                (two * d - b * three) / whole,
                0.0,
                (a * three - two * c) / whole,
            ],
        }
    }

    #[test]
    fn gravity_fit_recovers_the_true_weights() {
        let poses: Vec<_> = [[0.0, 0.2, 0.3], [0.0, -0.2, 0.6], [0.0, 0.5, 0.1]]
            .map(|q| holding(q, [0.07, -0.02]))
            .to_vec();
        let fit = fit_gravity(&Calibration::PREMIUM_1_5, &poses).expect("a fit");
        assert!((fit.gravity_2_nm - 0.07).abs() < 1e-6, "{fit:?}");
        assert!((fit.gravity_3_nm + 0.02).abs() < 1e-6, "{fit:?}");
        assert!(fit.residual_nm < 1e-6);
    }

    #[test]
    fn poses_without_load_on_a_joint_are_refused() {
        let hanging = holding([0.0, 0.1, 0.0], [0.07, 0.0]);
        let error = fit_gravity(&Calibration::PREMIUM_1_5, &[hanging]).expect_err("q3 is 0");
        assert_eq!(error, FitError::NoWeight { joint: 3 });
    }
}
