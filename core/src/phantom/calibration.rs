//! The numbers in which one Phantom differs from another.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// The model of a record, whose preset it started from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Model {
    /// Phantom Premium 1.0.
    Premium10,
    /// Phantom Premium 1.5.
    #[default]
    Premium15,
    /// Phantom Premium 3.0.
    Premium30,
    /// Phantom Omni, later Touch.
    Omni,
    /// Anything else with this linkage.
    Other,
}

/// A Phantom's calibration record. Lengths in millimetres, angles in radians,
/// vectors hold axes 1 to 3.
///
/// Published values differ by a few per cent, and cable ratios by rig, so these are data, never
/// constants in code. [`Calibration::validate`] checks them; nothing checks them again.
///
/// The encoders have no index pulse: the joint angles are known only after the arm was in its zero
/// pose since power-up. So the record stores the *angles* of that pose
/// ([`zero_rad`](Self::zero_rad)), and the loop receives the counts in that pose after each
/// power-up ([`crate::tick::Command::Zero`]).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// The Phantom's model.
    pub model: Model,
    /// Encoder counts per motor turn, four edges per line.
    pub counts_per_turn: f32,
    /// Motor turns per joint turn, positive.
    pub ratio: Vec3,
    /// +1 if counts increase with the joint's angle, −1 if they decrease.
    pub encoder_sign: Vec3,
    /// +1 if a positive current turns the joint towards larger angles, −1 otherwise.
    pub motor_sign: Vec3,
    /// Joint angles of the pose in which the arm is zeroed.
    pub zero_rad: Vec3,
    /// Length of the upper link, mm.
    pub l1_mm: f32,
    /// Length of the fore link, mm.
    pub l2_mm: f32,
    /// Joint angles within the stops.
    pub limits: JointLimits,
    /// Torque that holds joint 2 against the arm's weight at cos q2 = 1, Nm.
    pub gravity_2_nm: f32,
    /// Torque that holds joint 3 against the arm's weight at sin q3 = 1, Nm.
    pub gravity_3_nm: f32,
    /// Motor torque constants, Nm/A.
    pub torque_constant: Vec3,
    /// Maximum current of a cool motor, A.
    pub peak_current_a: Vec3,
    /// Continuous current of a motor, A.
    pub continuous_current_a: Vec3,
    /// Thermal model of the motors.
    pub thermal: Thermal,
    /// Maximum force at the tip, N.
    pub max_force_n: f32,
    /// Speed of the tip from which force is reduced, mm/s. At twice this speed no force is left,
    /// and a longer time above that is a fault.
    pub max_speed_mm_s: f32,
}

/// Joint angles within the stops. The second and third are absolute link angles, so the parallel
/// linkage also limits their difference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointLimits {
    /// Minimum angle of each joint, rad.
    pub min_rad: Vec3,
    /// Maximum angle of each joint, rad.
    pub max_rad: Vec3,
    /// Maximum q2 − q3, rad; below π/2, where the links would be in line.
    pub q2_minus_q3_max_rad: f32,
    /// Maximum q3 − q2, rad; below π/2.
    pub q3_minus_q2_max_rad: f32,
}

/// Two thermal nodes: winding to housing, housing to air. One type of motor on
/// all three axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Thermal {
    /// Winding resistance at 100 °C, Ω: the hot value, which errs on the warm side.
    pub resistance_ohm: f32,
    /// Thermal resistance from winding to housing, K/W.
    pub winding_k_per_w: f32,
    /// Thermal resistance from housing to air, K/W.
    pub housing_k_per_w: f32,
    /// Time constant of the winding, s.
    pub winding_s: f32,
    /// Time constant of the housing, s.
    pub housing_s: f32,
}

impl Calibration {
    /// Returns the encoder counts per radian of each joint, with their signs.
    #[must_use]
    pub fn counts_per_radian(&self) -> Vec3 {
        self.encoder_sign * self.ratio * (self.counts_per_turn / core::f32::consts::TAU)
    }
}

impl JointLimits {
    /// Limits that contain no pose.
    pub(crate) const EMPTY: Self = Self {
        min_rad: Vec3::INFINITY,
        max_rad: Vec3::NEG_INFINITY,
        q2_minus_q3_max_rad: f32::NEG_INFINITY,
        q3_minus_q2_max_rad: f32::NEG_INFINITY,
    };

    /// Returns the same limits, with `margin_rad` more room at every end.
    #[must_use]
    pub fn widened(&self, margin_rad: f32) -> Self {
        let margin = Vec3::splat(margin_rad);
        Self {
            min_rad: self.min_rad - margin,
            max_rad: self.max_rad + margin,
            q2_minus_q3_max_rad: self.q2_minus_q3_max_rad + margin_rad,
            q3_minus_q2_max_rad: self.q3_minus_q2_max_rad + margin_rad,
        }
    }

    /// Returns true if a pose lies inside, within `margin_rad`. Not-a-number lies outside.
    #[must_use]
    pub fn contains(&self, q: Vec3, margin_rad: f32) -> bool {
        let wide = self.widened(margin_rad);
        wide.contains_joints(q) && wide.contains_linkage(q)
    }

    /// Returns true if each joint alone lies inside.
    #[must_use]
    #[inline]
    pub fn contains_joints(&self, q: Vec3) -> bool {
        q.cmpge(self.min_rad).all() && q.cmple(self.max_rad).all()
    }

    /// Returns true if the linkage allows q2 and q3 together.
    #[must_use]
    #[inline]
    pub fn contains_linkage(&self, q: Vec3) -> bool {
        let spread = q.y - q.z;
        spread <= self.q2_minus_q3_max_rad && -spread <= self.q3_minus_q2_max_rad
    }
}
