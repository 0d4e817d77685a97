//! Tip position and Jacobian of the parallel linkage.
//!
//! The second and third joint angles are absolute link angles, because of the linkage (notes of
//! Çavuşoğlu, Feygin & Tendick 2002):
//!
//! ```text
//! r = l1·cos q2 + l2·sin q3
//! x = cos q1·r     y = sin q1·r     z = l1·sin q2 − l2·cos q3
//! ```
//!
//! # Singular poses
//!
//! `det J = ±l1·l2·r·cos(q2 − q3)`: at r = 0 the tip is on the base's axis, at |q2 − q3| = 90° the
//! links are in line. Forces become torques by *Jᵀ*, a product without an inverse, so nothing grows
//! there; [`Pose::torques_nm`] states the bound. Only the computation of joint angles from a tip
//! ([`super::inverse`]) divides, and documents these poses.

use glam::Vec3;

use super::calibration::Calibration;
use super::trig::sin_cos;

/// A pose of the arm: the terms of the Jacobian and of the tip position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    angles: Vec3,
    pub(super) sin: Vec3,
    pub(super) cos: Vec3,
    l1_mm: f32,
    l2_mm: f32,
}

impl Pose {
    /// Creates a pose from joint angles in radians.
    #[must_use]
    pub fn from_angles(calibration: &Calibration, q: Vec3) -> Self {
        let (s1, c1) = sin_cos(q.x);
        let (s2, c2) = sin_cos(q.y);
        let (s3, c3) = sin_cos(q.z);
        Self {
            angles: q,
            sin: Vec3::new(s1, s2, s3),
            cos: Vec3::new(c1, c2, c3),
            l1_mm: calibration.l1_mm,
            l2_mm: calibration.l2_mm,
        }
    }

    /// Returns the joint angles, rad.
    #[must_use]
    pub const fn angles(&self) -> Vec3 {
        self.angles
    }

    /// Returns the distance of the tip from the base's axis, mm; negative behind it.
    #[must_use]
    pub fn reach_mm(&self) -> f32 {
        self.l1_mm * self.cos.y + self.l2_mm * self.sin.z
    }

    /// Returns the tip position in the device frame, mm, within 0.2 µm of f64 for a Premium 1.5's
    /// links over the whole workspace (tested by a sweep).
    #[must_use]
    pub fn tip_mm(&self) -> Vec3 {
        let r = self.reach_mm();
        Vec3::new(
            self.cos.x * r,
            self.sin.x * r,
            self.l1_mm * self.sin.y - self.l2_mm * self.cos.z,
        )
    }

    /// Returns the joint torques in Nm that produce `force_n` (device frame) at the tip: τ = Jᵀ·F.
    ///
    /// Bounded in every pose, including singular ones: |τ1| ≤ (l1 + l2)·|F|, |τ2| ≤ l1·|F|, |τ3| ≤
    /// l2·|F|, because each column of J is a joint's lever and no lever is longer (tested by a
    /// sweep).
    #[must_use]
    pub fn torques_nm(&self, force_n: Vec3) -> Vec3 {
        let (s, c) = (self.sin, self.cos);
        let tangential = c.x * force_n.y - s.x * force_n.x;
        let radial = c.x * force_n.x + s.x * force_n.y;
        Vec3::new(
            self.reach_mm() * tangential,
            self.l1_mm * (c.y * force_n.z - s.y * radial),
            self.l2_mm * (c.z * radial + s.z * force_n.z),
        ) * 1e-3
    }

    /// Returns the velocity of the tip in the device frame, mm/s, for joint rates in rad/s: v =
    /// J·q̇.
    #[must_use]
    pub fn tip_velocity_mm_s(&self, rates: Vec3) -> Vec3 {
        let (s, c) = (self.sin, self.cos);
        let around = self.reach_mm() * rates.x;
        let outward = self.l2_mm * c.z * rates.z - self.l1_mm * s.y * rates.y;
        Vec3::new(
            c.x * outward - s.x * around,
            s.x * outward + c.x * around,
            self.l1_mm * c.y * rates.y + self.l2_mm * s.z * rates.z,
        )
    }
}

/// Converts a vector from the device frame to the terrain frame: east is the device's y, north its
/// −x.
#[must_use]
pub fn to_terrain_frame(device: Vec3) -> Vec3 {
    Vec3::new(device.y, -device.x, device.z)
}

/// Converts a vector from the terrain frame to the device frame.
#[must_use]
pub(crate) fn to_device_frame(terrain: Vec3) -> Vec3 {
    Vec3::new(-terrain.y, terrain.x, terrain.z)
}

#[cfg(test)]
#[path = "kinematics_tests.rs"]
mod tests;
