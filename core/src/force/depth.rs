//! Depth of a tip.

use glam::Vec3;

use crate::scalar::larger;

/// Depth of a tip, and its motion along the force.
#[derive(Clone, Copy, Debug)]
pub(super) struct Depth {
    pub(super) mm: f32,
    /// Speed at which the depth decreases, mm/s.
    pub(super) exit_speed_mm_s: f32,
}

impl Depth {
    /// Returns the depth of a tip with this displacement to its proxy, at a velocity.
    pub(super) fn of(displacement_mm: Vec3, velocity_mm_s: Vec3) -> Self {
        let mm = displacement_mm.length();
        let along = velocity_mm_s.dot(displacement_mm);
        let exit_speed_mm_s = if mm > 0.0 { along / mm } else { 0.0 };
        Self {
            mm,
            exit_speed_mm_s,
        }
    }

    /// Returns the depth after a time at constant velocity; zero if the tip leaves the surface.
    pub(super) fn after_mm(&self, seconds: f32) -> f32 {
        larger(self.mm - self.exit_speed_mm_s * seconds, 0.0)
    }
}
