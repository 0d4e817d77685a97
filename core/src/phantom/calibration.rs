//! The numbers that make one Phantom differ from the next.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// A Phantom's calibration record. Lengths in millimetres, axes 1 to 3.
///
/// Published values differ by a few per cent and cable ratios by rig, so these
/// are data, never constants in code.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    /// Encoder counts a motor turn, four edges a line.
    pub counts_per_turn: f32,
    /// Motor turns a joint turn; negative where counts fall as the joint's
    /// angle grows.
    pub ratio: Vec3,
    /// Counts read in the home pose (all joint angles zero).
    pub home_counts: [i32; 3],
    /// Length of the upper link, mm.
    pub l1_mm: f32,
    /// Length of the fore link, mm.
    pub l2_mm: f32,
    /// Motor torque constant, Nm/A.
    pub torque_constant: f32,
    /// Largest current a cool motor may be given, A.
    pub peak_current_a: f32,
    /// Current a motor can bear for ever, A.
    pub continuous_current_a: f32,
}

impl Calibration {
    /// Phantom Premium 1.5: CAD link lengths and ratios from
    /// `mahilab/Phantom`, Maxon RE25 motors.
    pub const PREMIUM_1_5: Self = Self {
        counts_per_turn: 4096.0,
        ratio: Vec3::new(13.3, 11.2, 11.2),
        home_counts: [0; 3],
        l1_mm: 209.55,
        l2_mm: 169.545,
        torque_constant: 0.0234,
        peak_current_a: 5.5,
        continuous_current_a: 1.24,
    };

    /// Radians of each joint for a count of its encoder.
    #[must_use]
    pub fn radians_per_count(&self) -> Vec3 {
        core::f32::consts::TAU / (self.counts_per_turn * self.ratio)
    }
}
