//! Motor forces at the tip, in f64: joint torques through an arm's levers.

use hapterra::phantom::{PhantomModel, kinematics};
use hapterra_core::phantom::Calibration;

/// The levers of an arm in a pose, and the joint torques of its weight.
#[derive(Clone, Copy, Debug)]
pub struct Levers {
    jacobian: [[f64; 3]; 3],
    weight_nm: [f64; 3],
}

impl Levers {
    /// Computes the levers at joint angles; `None` near a singular pose, where small torques are
    /// large forces.
    #[must_use]
    pub fn at(model: &PhantomModel, record: &Calibration, q_rad: [f64; 3]) -> Option<Self> {
        if is_near_singular(model, q_rad) {
            return None;
        }
        let [_, q2, q3] = q_rad;
        Some(Self {
            jacobian: kinematics::jacobian(model, q_rad),
            weight_nm: [
                0.0,
                f64::from(record.gravity_2_nm) * libm::cos(q2),
                f64::from(record.gravity_3_nm) * libm::sin(q3),
            ],
        })
    }

    /// Returns the least force at the tip that explains these joint torques with any share of the
    /// arm's weight compensated, N. The share is unknown while the force ramps up or down.
    #[must_use]
    pub fn force_n(&self, torque_nm: [f64; 3]) -> f64 {
        let [all, weight] = [torque_nm, self.weight_nm].map(|t| force(&self.jacobian, t));
        let share = (dot(all, weight) / dot(weight, weight).max(1e-12)).clamp(0.0, 1.0);
        let rest = std::array::from_fn(|i| all[i] - share * weight[i]);
        libm::sqrt(dot(rest, rest))
    }
}

/// Returns the joint torques (Nm) of motor currents (A).
#[must_use]
pub fn torques_nm(model: &PhantomModel, currents_a: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| {
        let axis = &model.drive[i];
        currents_a[i] * axis.ratio * axis.sign * axis.motor.kt_nm_per_a
    })
}

/// Returns true if the links are within 30° of being in line, or the tip within 80 mm of
/// the base's axis: there small torques are large forces.
#[must_use]
pub fn is_near_singular(model: &PhantomModel, q: [f64; 3]) -> bool {
    let spread = libm::cos(q[1] - q[2]);
    let reach_m = model.l1_m * libm::cos(q[1]) + model.l2_m * libm::sin(q[2]);
    spread.abs() < 0.5 || reach_m.abs() < 0.08
}

/// Solves Jᵀ·F = τ for F by Cramer's rule.
#[must_use]
pub fn force(jacobian: &[[f64; 3]; 3], torque: [f64; 3]) -> [f64; 3] {
    // Rows of Jᵀ are the columns of J.
    let row = |i: usize| [jacobian[0][i], jacobian[1][i], jacobian[2][i]];
    let [a, b, c] = [row(0), row(1), row(2)];
    let (bc, ca, ab) = (cross(b, c), cross(c, a), cross(a, b));
    let whole = dot(a, bc);
    std::array::from_fn(|i| (torque[0] * bc[i] + torque[1] * ca[i] + torque[2] * ab[i]) / whole)
}

fn cross(u: [f64; 3], v: [f64; 3]) -> [f64; 3] {
    [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ]
}

fn dot(u: [f64; 3], v: [f64; 3]) -> f64 {
    u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
}
