//! Dynamics of the joints: the mass matrix, its velocity-dependent torques, gravity and the stops.
//!
//! `M(q)·q̈ + c(q, q̇) + G(q) + B·q̇ + friction = τ + Jᵀ·F`, with `c` derived from `M` by
//! Lagrange's equations, so that energy is conserved.

use glam::{DMat3, DVec3};

use super::kinematics::Pose;
use super::model::PhantomModel;

/// The equations of motion of one model.
#[derive(Clone, Copy, Debug)]
pub struct Dynamics {
    model: PhantomModel,
    /// Rotor inertia at the joint, `J·η²`, kg·m².
    rotor: DVec3,
}

impl Dynamics {
    /// Creates the equations for `model`.
    #[must_use]
    pub fn new(model: PhantomModel) -> Self {
        let rotor = model
            .drive
            .map(|axis| axis.motor.rotor_kg_m2 * axis.ratio * axis.ratio);
        Self {
            model,
            rotor: DVec3::from(rotor),
        }
    }

    /// Returns the mass matrix in a pose, kg·m²; symmetric.
    pub(super) fn mass(&self, pose: &Pose) -> DMat3 {
        let l = &self.model.lumped;
        let ([_, s2, s3], [_, c2, c3]) = (pose.s, pose.c);
        let (cos_2q2, cos_2q3) = (c2 * c2 - s2 * s2, c3 * c3 - s3 * s3);
        let m11 = l.m11 + l.m11_c2 * cos_2q2 + l.m11_c3 * cos_2q3 + 2.0 * l.m23 * c2 * s3;
        let m23 = -l.m23 * (s2 * c3 - c2 * s3);
        DMat3::from_cols(
            DVec3::new(m11 + self.rotor.x, 0.0, 0.0),
            DVec3::new(0.0, l.m22 + self.rotor.y, m23),
            DVec3::new(0.0, m23, l.m33 + self.rotor.z),
        )
    }

    /// Returns the torque that balances the arm's weight in a pose, N·m.
    pub(super) fn gravity(&self, pose: &Pose) -> DVec3 {
        let (g, l) = (self.model.gravity_m_s2, &self.model.lumped);
        DVec3::new(0.0, g * l.g2 * pose.c[1], g * l.g3 * pose.s[2])
    }

    /// Returns the Coriolis and centrifugal torque `c(q, q̇)`.
    pub(super) fn coriolis(&self, pose: &Pose, rate: DVec3) -> DVec3 {
        let l = &self.model.lumped;
        let ([_, s2, s3], [_, c2, c3]) = (pose.s, pose.c);
        // ∂M11/∂q2, ∂M11/∂q3 and ∂M23/∂q3 = −∂M23/∂q2.
        let along_2 = -4.0 * l.m11_c2 * s2 * c2 - 2.0 * l.m23 * s2 * s3;
        let along_3 = -4.0 * l.m11_c3 * s3 * c3 + 2.0 * l.m23 * c2 * c3;
        let couple = l.m23 * (c2 * c3 + s2 * s3);
        DVec3::new(
            rate.x * (along_2 * rate.y + along_3 * rate.z),
            -0.5 * along_2 * rate.x * rate.x + couple * rate.z * rate.z,
            -0.5 * along_3 * rate.x * rate.x - couple * rate.y * rate.y,
        )
    }

    /// Returns the viscous friction torque of the joints.
    pub(super) fn viscous(&self, rate: DVec3) -> DVec3 {
        -DVec3::from(self.model.viscous_nms_per_rad) * rate
    }

    /// Returns the torque of the mechanical stops: a spring and damper that only push.
    pub(super) fn stops(&self, q: DVec3, rate: DVec3) -> DVec3 {
        let limits = &self.model.limits;
        let press = |past: f64, speed: f64| {
            if past > 0.0 {
                (limits.stop_nm_per_rad * past + limits.stop_nms_per_rad * speed).max(0.0)
            } else {
                0.0
            }
        };
        let one = |i: usize| {
            press(limits.min_rad[i] - q[i], -rate[i]) - press(q[i] - limits.max_rad[i], rate[i])
        };
        let (spread, speed) = (q.y - q.z, rate.y - rate.z);
        let linkage = press(-spread - limits.q3_minus_q2_max_rad, -speed)
            - press(spread - limits.q2_minus_q3_max_rad, speed);
        DVec3::new(one(0), one(1) + linkage, one(2) - linkage)
    }

    /// Returns the kinetic plus potential energy, J, without the stops' springs.
    #[must_use]
    pub fn energy_j(&self, q_rad: [f64; 3], rate_rad_s: [f64; 3]) -> f64 {
        let pose = Pose::new(DVec3::from(q_rad));
        let rate = DVec3::from(rate_rad_s);
        let lumped = &self.model.lumped;
        let lift = lumped.g2 * pose.s[1] - lumped.g3 * pose.c[2];
        0.5 * rate.dot(self.mass(&pose) * rate) + self.model.gravity_m_s2 * lift
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const Q: [f64; 3] = [0.3, 0.4, -0.2];

    #[test]
    fn tip_inertia_near_home_is_a_few_tens_of_grams() {
        let model = PhantomModel::premium_1_5();
        let mass = Dynamics::new(model).mass(&Pose::new(DVec3::ZERO));
        let grams = |joint: usize, arm: f64| 1e3 * mass.col(joint)[joint] / (arm * arm);
        for (joint, arm) in [(0, model.l1_m), (1, model.l1_m), (2, model.l2_m)] {
            let tip = grams(joint, arm);
            // Joint 1 also rotates the base with its two motors.
            assert!((35.0..90.0).contains(&tip), "joint {joint}: {tip} g");
        }
    }

    #[test]
    fn gravity_is_the_slope_of_the_energy() {
        let dynamics = Dynamics::new(PhantomModel::premium_1_5());
        let torque = dynamics.gravity(&Pose::new(DVec3::from(Q)));
        for joint in 0..3 {
            let (mut low, mut high) = (Q, Q);
            low[joint] -= 1e-5;
            high[joint] += 1e-5;
            let energy = |q| dynamics.energy_j(q, [0.0; 3]);
            let slope = (energy(high) - energy(low)) / 2e-5;
            assert!((slope - torque[joint]).abs() < 1e-9);
        }
    }

    /// `c = Ṁ·q̇ − ½·∂(q̇ᵀ·M·q̇)/∂q`, with the derivatives taken numerically.
    #[test]
    fn coriolis_follows_from_the_mass_matrix() {
        let dynamics = Dynamics::new(PhantomModel::premium_1_5());
        let (q, rate) = (DVec3::from(Q), DVec3::new(1.5, -2.0, 3.0));
        let mass = |q| dynamics.mass(&Pose::new(q));
        let slope = |along: DVec3| (mass(q + 1e-5 * along) - mass(q - 1e-5 * along)) * (0.5 / 1e-5);
        let mut expected = slope(rate) * rate;
        for joint in 0..3 {
            let mut along = DVec3::ZERO;
            along[joint] = 1.0;
            expected[joint] -= 0.5 * rate.dot(slope(along) * rate);
        }
        let got = dynamics.coriolis(&Pose::new(q), rate);
        assert!((got - expected).length() < 1e-8, "{got} {expected}");
    }

    #[test]
    fn stops_push_inwards_and_never_pull() {
        let dynamics = Dynamics::new(PhantomModel::premium_1_5());
        let past = DVec3::new(1.6, 0.0, 0.0);
        assert!(dynamics.stops(past, DVec3::ZERO).x < 0.0);
        assert_eq!(dynamics.stops(past, DVec3::new(-90.0, 0.0, 0.0)).x, 0.0);
        let folded = dynamics.stops(DVec3::new(0.0, 0.0, 1.0), DVec3::ZERO);
        assert!(folded.y > 0.0 && folded.z < 0.0);
        assert_eq!(dynamics.stops(DVec3::from(Q), DVec3::ONE), DVec3::ZERO);
    }
}
