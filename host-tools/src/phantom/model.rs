//! The parameters of a Phantom: one record for each model, with their sources.
//!
//! Two open sources describe a Premium 1.5 in full. *CAD* is the solid model
//! and motor data of `mahilab/Phantom`, taken from an opened device; *C2002*
//! is the identification of Çavuşoğlu, Feygin and Tendick, "A critical study
//! of the mechanical and electrical properties of the PHANToM haptic
//! interface" (Presence, 2002). They differ by up to 2.6 % in length and 25 %
//! in mass, so these are defaults of a calibration record, not truths.

/// Standard acceleration of free fall, m/s².
pub const STANDARD_GRAVITY: f64 = 9.80665;

/// A three-joint Phantom as the simulation needs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhantomModel {
    /// Upper link (shoulder to elbow), metres.
    pub l1_m: f64,
    /// Fore link (elbow to tip), metres.
    pub l2_m: f64,
    /// Mechanical stops.
    pub limits: JointLimits,
    /// Inertia and gravity of the links, without the rotors.
    pub lumped: Lumped,
    /// Acceleration of free fall, m/s². Zero removes the arm's weight.
    pub gravity_m_s2: f64,
    /// Coulomb friction of each joint, N·m.
    pub coulomb_nm: [f64; 3],
    /// Viscous friction of each joint, N·m·s/rad.
    pub viscous_nms_per_rad: [f64; 3],
    /// Cable drive, motor and encoder of each joint.
    pub drive: [AxisDrive; 3],
}

/// Stops of the joints, radians. `q2` and `q3` are absolute link angles, so the parallel linkage
/// adds a bound on their difference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimits {
    /// Lowest angle of each joint.
    pub min_rad: [f64; 3],
    /// Highest angle of each joint.
    pub max_rad: [f64; 3],
    /// Highest `q2 - q3`.
    pub q2_minus_q3_max_rad: f64,
    /// Highest `q3 - q2`.
    pub q3_minus_q2_max_rad: f64,
    /// Stiffness of a stop, N·m/rad.
    pub stop_nm_per_rad: f64,
    /// Damping of a stop while it is pressed, N·m·s/rad.
    pub stop_nms_per_rad: f64,
}

/// The link inertias collected into the coefficients of the mass matrix
///
/// ```text
/// M11 = m11 + m11_c2·cos 2q2 + m11_c3·cos 2q3 + 2·m23·cos q2·sin q3
/// M22 = m22        M33 = m33        M23 = −m23·sin(q2 − q3)
/// G2  = g·g2·cos q2                 G3  = g·g3·sin q3
/// ```
///
/// in kg·m² and, for `g2` and `g3`, kg·m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lumped {
    /// Pose-independent inertia about the vertical axis.
    pub m11: f64,
    /// Part of the inertia that depends on the upper link's angle.
    pub m11_c2: f64,
    /// Part of the inertia that depends on the fore link's angle.
    pub m11_c3: f64,
    /// Inertia about joint 2.
    pub m22: f64,
    /// Coupling of the two links.
    pub m23: f64,
    /// Inertia about joint 3.
    pub m33: f64,
    /// First moment about joint 2 (negative: the counterweight dominates).
    pub g2: f64,
    /// First moment about joint 3.
    pub g3: f64,
}

/// One joint's conversion from current to torque and from angle to counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisDrive {
    /// Motor turns per joint turn.
    pub ratio: f64,
    /// +1 or −1: direction of the motor and of its encoder against the joint.
    pub sign: f64,
    /// Counts per motor turn after quadrature.
    pub counts_per_rev: f64,
    /// The motor.
    pub motor: Motor,
}

/// A direct-current motor with its two thermal nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor {
    /// Torque constant, N·m/A.
    pub kt_nm_per_a: f64,
    /// Rotor inertia, kg·m².
    pub rotor_kg_m2: f64,
    /// Winding resistance at 25 °C, Ω.
    pub resistance_ohm: f64,
    /// Continuous current limit, A.
    pub continuous_a: f64,
    /// Peak current limit of the amplifier, A.
    pub peak_a: f64,
    /// Time constant of the current loop, s.
    pub current_lag_s: f64,
    /// Thermal resistance winding to housing, K/W.
    pub winding_k_per_w: f64,
    /// Thermal resistance housing to air, K/W.
    pub housing_k_per_w: f64,
    /// Thermal time constant of the winding, s.
    pub winding_tau_s: f64,
    /// Thermal time constant of the housing, s.
    pub housing_tau_s: f64,
    /// Hottest allowed winding, °C.
    pub winding_max_c: f64,
}

impl PhantomModel {
    /// Multiplies the friction by `part`.
    #[must_use]
    pub fn with_friction(self, part: f64) -> Self {
        Self {
            coulomb_nm: self.coulomb_nm.map(|nm| nm * part),
            viscous_nms_per_rad: self.viscous_nms_per_rad.map(|nms| nms * part),
            ..self
        }
    }

    /// Returns the Premium 1.5: link lengths, stops, ratios and friction from CAD; inertia and
    /// gravity identified in C2002 (with C2002's own lengths, as they were fitted together).
    #[must_use]
    pub fn premium_1_5() -> Self {
        Self {
            l1_m: 0.209_55,
            l2_m: 0.169_545,
            limits: JointLimits::premium_1_5(),
            lumped: Lumped::cavusoglu_2002(),
            gravity_m_s2: STANDARD_GRAVITY,
            coulomb_nm: [0.01; 3],
            viscous_nms_per_rad: [0.0005; 3],
            drive: [13.3, 11.2, 11.2].map(|ratio| AxisDrive {
                ratio,
                sign: 1.0,
                counts_per_rev: 4096.0,
                motor: Motor::maxon_118743(),
            }),
        }
    }
}

impl JointLimits {
    /// Angles from CAD. The stop's stiffness and damping are chosen: 30 N at the tip press a stop
    /// by 3°, and a stop does not oscillate.
    fn premium_1_5() -> Self {
        Self {
            min_rad: [-90.0, -124.0, -29.0].map(f64::to_radians),
            max_rad: [90.0, 119.0, 214.0].map(f64::to_radians),
            q2_minus_q3_max_rad: 65f64.to_radians(),
            q3_minus_q2_max_rad: 55f64.to_radians(),
            stop_nm_per_rad: 100.0,
            stop_nms_per_rad: 0.5,
        }
    }
}

impl Lumped {
    /// C2002's inertia matrix and gravity vector, terms collected.
    #[must_use]
    pub fn cavusoglu_2002() -> Self {
        let (l1, l2, l3, l5, l6) = (0.215, 0.170, 0.0325, -0.0368, 0.0527);
        let (ma, mc, mbe, mdf) = (0.0202, 0.0249, 0.2359, 0.1906);
        let [axx, ayy, azz] = [0.4864e-4, 0.001_843e-4, 0.4864e-4];
        let [cxx, cyy, czz] = [0.959e-4, 0.959e-4, 0.0051e-4];
        let [bxx, byy, bzz] = [11.09e-4, 10.06e-4, 0.591e-4];
        let [dxx, dyy, dzz] = [7.11e-4, 0.629e-4, 6.246e-4];
        let base_yy = 11.87e-4;
        let reach = 4.0 * l1 * l1 * ma + l1 * l1 * mc;
        let fore = l2 * l2 * ma + 4.0 * l3 * l3 * mc;
        let spin = 4.0 * (ayy + azz + 2.0 * base_yy + byy + bzz + cyy + czz + dyy + dzz);
        Self {
            m11: (spin + reach + fore) / 8.0,
            m11_c2: (4.0 * (byy - bzz + cyy - czz) + reach) / 8.0,
            m11_c3: (4.0 * (ayy - azz + dyy - dzz) - fore) / 8.0,
            m22: bxx + cxx + reach / 4.0,
            m23: 0.5 * l1 * (l2 * ma + l3 * mc),
            m33: axx + dxx + fore / 4.0,
            g2: 0.5 * (2.0 * l1 * ma + 2.0 * l5 * mbe + l1 * mc),
            g3: 0.5 * (l2 * ma + 2.0 * l3 * mc - 2.0 * l6 * mdf),
        }
    }
}

impl Motor {
    /// Returns the Maxon RE25 118743, as in a Premium 1.5 (data sheet; rotor inertia between the
    /// 10.3 and 10.8 g·cm² of two sources). The current loop's lag is chosen: the electrical time
    /// constant L/R = 0.238 mH / 2.18 Ω.
    #[must_use]
    pub fn maxon_118743() -> Self {
        Self {
            kt_nm_per_a: 0.0234,
            rotor_kg_m2: 1.06e-6,
            resistance_ohm: 2.18,
            continuous_a: 1.24,
            peak_a: 5.5,
            current_lag_s: 0.238e-3 / 2.18,
            winding_k_per_w: 3.1,
            housing_k_per_w: 14.0,
            winding_tau_s: 12.0,
            housing_tau_s: 612.0,
            winding_max_c: 100.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl PhantomModel {
        /// Removes the arm's weight.
        pub(in crate::phantom) fn weightless(self) -> Self {
            Self {
                gravity_m_s2: 0.0,
                ..self
            }
        }

        /// Removes the Coulomb and viscous friction.
        pub(in crate::phantom) fn frictionless(self) -> Self {
            Self {
                coulomb_nm: [0.0; 3],
                viscous_nms_per_rad: [0.0; 3],
                ..self
            }
        }
    }

    #[test]
    fn lumped_terms_agree_with_the_published_sums() {
        let l = Lumped::cavusoglu_2002();
        assert!((l.m22 - 2.43e-3).abs() < 0.01e-3, "{}", l.m22);
        assert!((l.m33 - 9.3e-4).abs() < 0.05e-4, "{}", l.m33);
        assert!((STANDARD_GRAVITY * l.g2 + 0.0163).abs() < 0.0001);
        assert!((STANDARD_GRAVITY * l.g3 + 0.0738).abs() < 0.0001);
    }
}
