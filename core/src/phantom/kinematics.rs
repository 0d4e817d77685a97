//! Tip position and Jacobian of the parallel linkage.
//!
//! The second and third joint angles are absolute link angles, as the linkage
//! makes them (notes of Çavuşoğlu, Feygin & Tendick 2002):
//!
//! ```text
//! r = l1·cos q2 + l2·sin q3
//! x = cos q1·r     y = sin q1·r     z = l1·sin q2 − l2·cos q3
//! ```

use glam::Vec3;

use super::calibration::Calibration;
use super::trig::sin_cos;

/// A pose of the arm: what the Jacobian and the tip are computed from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    sin: Vec3,
    cos: Vec3,
    l1_mm: f32,
    l2_mm: f32,
}

impl Pose {
    /// From encoder counts.
    #[must_use]
    pub fn from_counts(calibration: &Calibration, counts: [i32; 3]) -> Self {
        let home = calibration.home_counts;
        let from_home = |axis: usize| counts[axis].wrapping_sub(home[axis]) as f32;
        let turned = Vec3::new(from_home(0), from_home(1), from_home(2));
        Self::from_angles(calibration, turned * calibration.radians_per_count())
    }

    /// From joint angles in radians.
    #[must_use]
    pub fn from_angles(calibration: &Calibration, q: Vec3) -> Self {
        let (s1, c1) = sin_cos(q.x);
        let (s2, c2) = sin_cos(q.y);
        let (s3, c3) = sin_cos(q.z);
        Self {
            sin: Vec3::new(s1, s2, s3),
            cos: Vec3::new(c1, c2, c3),
            l1_mm: calibration.l1_mm,
            l2_mm: calibration.l2_mm,
        }
    }

    fn reach_mm(&self) -> f32 {
        self.l1_mm * self.cos.y + self.l2_mm * self.sin.z
    }

    /// Tip position in the device frame, mm. Within 0.2 µm of f64 over the
    /// whole workspace (swept in the tests).
    #[must_use]
    pub fn tip_mm(&self) -> Vec3 {
        let r = self.reach_mm();
        Vec3::new(
            self.cos.x * r,
            self.sin.x * r,
            self.l1_mm * self.sin.y - self.l2_mm * self.cos.z,
        )
    }

    /// Joint torques in Nm that make `force_n` (device frame) at the tip:
    /// τ = Jᵀ·F. Bounded in every pose, singular ones included.
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
}

/// A device-frame vector in the terrain frame: east is the device's y, north
/// its −x.
#[must_use]
pub fn to_terrain_frame(device: Vec3) -> Vec3 {
    Vec3::new(device.y, -device.x, device.z)
}

/// A terrain-frame vector in the device frame.
#[must_use]
pub(crate) fn to_device_frame(terrain: Vec3) -> Vec3 {
    Vec3::new(-terrain.y, terrain.x, terrain.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PREMIUM: Calibration = Calibration::PREMIUM_1_5;

    /// Every 7th degree or so of the joint limits.
    fn workspace() -> impl Iterator<Item = [f64; 3]> {
        let steps = |from: i32, to: i32| (from..=to).step_by(7).map(|d| f64::from(d).to_radians());
        steps(-90, 90).flat_map(move |q1| {
            steps(-124, 119).flat_map(move |q2| steps(-29, 214).map(move |q3| [q1, q2, q3]))
        })
    }

    fn tip_f64([q1, q2, q3]: [f64; 3]) -> [f64; 3] {
        let (l1, l2) = (f64::from(PREMIUM.l1_mm), f64::from(PREMIUM.l2_mm));
        let r = l1 * q2.cos() + l2 * q3.sin();
        [q1.cos() * r, q1.sin() * r, l1 * q2.sin() - l2 * q3.cos()]
    }

    #[test]
    fn the_tip_is_within_its_bound_over_the_workspace() {
        let mut worst = 0.0_f64;
        for q in workspace() {
            // The angle as f32 holds it is the input; its rounding is not ours.
            let angles = Vec3::new(q[0] as f32, q[1] as f32, q[2] as f32);
            let truth = tip_f64(angles.to_array().map(f64::from));
            let tip = Pose::from_angles(&PREMIUM, angles).tip_mm();
            for axis in 0..3 {
                worst = worst.max((f64::from(tip[axis]) - truth[axis]).abs());
            }
        }
        assert!(worst < 2e-4, "{worst} mm");
    }

    #[test]
    fn torques_are_the_transposed_jacobian() {
        let force = Vec3::new(1.5, -0.7, 2.2);
        for q in workspace().step_by(97) {
            let angles = Vec3::new(q[0] as f32, q[1] as f32, q[2] as f32);
            let torques = Pose::from_angles(&PREMIUM, angles).torques_nm(force);
            for joint in 0..3 {
                let h = 1e-6;
                let (mut lo, mut hi) = (q, q);
                lo[joint] -= h;
                hi[joint] += h;
                let (lo, hi) = (tip_f64(lo), tip_f64(hi));
                let power: f64 = (0..3)
                    .map(|a| (hi[a] - lo[a]) / (2.0 * h) * 1e-3 * f64::from(force[a]))
                    .sum();
                assert!((power - f64::from(torques[joint])).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn one_count_moves_the_tip_by_what_the_data_sheet_says() {
        let home = Pose::from_counts(&PREMIUM, [0; 3]).tip_mm();
        let resolution = [24.2, 28.7, 23.2];
        for (axis, expected_um) in resolution.into_iter().enumerate() {
            let mut counts = [0; 3];
            counts[axis] = 1;
            let moved = Pose::from_counts(&PREMIUM, counts).tip_mm() - home;
            assert!((moved.length() * 1e3 - expected_um).abs() < 0.2, "{moved}");
        }
    }

    #[test]
    fn frames_turn_into_each_other() {
        let v = Vec3::new(1.0, 2.0, 3.0);
        assert_eq!(to_terrain_frame(to_device_frame(v)), v);
        // Away from the user is north, and that is toward the base.
        assert_eq!(to_terrain_frame(Vec3::NEG_X), Vec3::Y);
    }
}
