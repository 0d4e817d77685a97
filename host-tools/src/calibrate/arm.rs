//! The arm's geometry in `f64`, with the lengths of a calibration record.

use glam::{DMat3, DVec3};
use hapterra_core::phantom::Calibration;

use crate::phantom::{PhantomModel, kinematics};

/// A linkage whose encoders count from its zero pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arm {
    model: PhantomModel,
    /// Joint angles of the zero pose, rad.
    pub zero_rad: DVec3,
}

impl Arm {
    /// Returns an arm with a record's lengths and zero pose.
    #[must_use]
    pub fn of(record: &Calibration) -> Self {
        Self {
            model: PhantomModel {
                l1_m: 1e-3 * f64::from(record.l1_mm),
                l2_m: 1e-3 * f64::from(record.l2_mm),
                ..PhantomModel::premium_1_5()
            },
            zero_rad: record.zero_rad.as_dvec3(),
        }
    }

    /// Returns the joint angles after the encoders turned by `counts` from the zero pose, rad.
    #[must_use]
    pub fn angles(&self, rad_per_count: DVec3, counts: [i32; 3]) -> DVec3 {
        self.zero_rad + DVec3::from(counts.map(f64::from)) * rad_per_count
    }

    /// Returns the tip's position, device frame, mm: x towards the user, y to the right, z up.
    #[must_use]
    pub fn tip_mm(&self, q_rad: DVec3) -> DVec3 {
        1e3 * DVec3::from(kinematics::tip(&self.model, q_rad.to_array()))
    }

    /// Returns the joint torques of a force at the tip (N, device frame), Nm.
    #[must_use]
    pub fn torques_nm(&self, q_rad: DVec3, force_n: DVec3) -> DVec3 {
        let rows = kinematics::jacobian(&self.model, q_rad.to_array());
        // The array's rows are glam's columns, so this is already the transpose.
        DMat3::from_cols_array_2d(&rows) * force_n
    }
}
