//! Inverse kinematics: from a tip position to joint angles.
//!
//! Not used by the tick: it is for planning, calibration and tests, and costs `libm`'s arc
//! tangents.
//!
//! A tip position has up to four poses: the arm turned towards it or leaning over backwards, each
//! with the elbow on either side. The linkage keeps |q2 − q3| below 90°, which leaves one elbow;
//! the joint limits select one of the two directions, first the arm turned towards the tip.
//!
//! # Near singular poses
//!
//! On the base's axis (r = 0) every q1 has the same tip; the result is one of them. With the
//! links nearly in line, the joint angles change as the square root of the tip's distance; the
//! *tip* of the result is still within 1 µm of the requested one (tested by a sweep).

use core::f32::consts::{FRAC_PI_2, TAU};

use glam::Vec3;
use libm::{atan2f, sqrtf};

use super::calibration::Calibration;

/// Reason why no pose has this tip position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Unreachable {
    /// A coordinate is not a finite number.
    #[error("the position is not a number")]
    NotFinite,
    /// Farther away than both links in line.
    #[error("farther out than the links reach")]
    TooFar,
    /// Nearer than the folded links reach.
    #[error("nearer than the links can fold")]
    TooNear,
    /// Only poses beyond the stops have this tip.
    #[error("only poses beyond the joint limits reach it")]
    BeyondLimits,
}

/// Rounding by which the cosine of the elbow may exceed its range.
const ROUNDING: f32 = 4.0 * f32::EPSILON;

impl Calibration {
    /// Returns joint angles inside the limits that put the tip at `tip_mm` (device frame).
    ///
    /// # Errors
    /// Returns [`Unreachable`] with the reason.
    pub fn joints_at(&self, tip_mm: Vec3) -> Result<Vec3, Unreachable> {
        if !tip_mm.is_finite() {
            return Err(Unreachable::NotFinite);
        }
        let Vec3 { x, y, z } = tip_mm;
        let r = libm::hypotf(x, y);
        let elbow = self.elbow(r, z)?;
        let (sin, cos) = super::sin_cos(elbow);
        let inner = atan2f(self.l2_mm * sin, self.l1_mm + self.l2_mm * cos);
        let pose = |q1: f32, r: f32| {
            let q2 = atan2f(z, r) + inner;
            Vec3::new(q1, q2, q2 - elbow + FRAC_PI_2)
        };
        let candidates = [pose(atan2f(y, x), r), pose(atan2f(-y, -x), -r)];
        let found = candidates.into_iter().find_map(|q| self.turned_inside(q));
        found.ok_or(Unreachable::BeyondLimits)
    }

    /// Returns q2 − q3 + 90°, between 0 and 180°, from r² + z² = l1² + l2² + 2·l1·l2·cos(elbow).
    fn elbow(&self, r: f32, z: f32) -> Result<f32, Unreachable> {
        let (l1, l2) = (self.l1_mm, self.l2_mm);
        // Differences of squares as products: no digits are lost with the links nearly in line,
        // folded or stretched.
        let distance = libm::hypotf(r, z);
        let short_of_full = (l1 + l2 - distance) * (l1 + l2 + distance) / (2.0 * l1 * l2);
        let past_folded = (distance - (l1 - l2)) * (distance + (l1 - l2)) / (2.0 * l1 * l2);
        if short_of_full < -ROUNDING {
            return Err(Unreachable::TooFar);
        }
        if past_folded < -ROUNDING {
            return Err(Unreachable::TooNear);
        }
        // 1 − cos and 1 + cos: the half angle's tangent.
        let (less, more) = (short_of_full.max(0.0), past_folded.max(0.0));
        Ok(2.0 * atan2f(sqrtf(less), sqrtf(more)))
    }

    /// Returns the same pose with whole turns added or subtracted, if that moves it inside the
    /// limits.
    fn turned_inside(&self, q: Vec3) -> Option<Vec3> {
        let turn = Vec3::new(0.0, TAU, TAU);
        [q, q + turn, q - turn]
            .into_iter()
            .find(|q| self.limits.contains(*q, 1e-5))
    }
}

#[cfg(test)]
#[path = "inverse_tests.rs"]
mod tests;
