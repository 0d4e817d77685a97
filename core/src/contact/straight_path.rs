//! A straight path through one patch, and the first minimum of the distance from the HIP on it.
//!
//! In the coordinates of the patch the path is `(u, v) + t·(du, dv)`. The height over it is a
//! quadratic in `t`, half the squared distance a quartic, and its slope the cubic
//!
//! ```text
//! h(t) = (off + t·d)·d + (z + s·t + w·t²)·(s + 2w·t)        w = a·du·dv
//! ```
//!
//! So the first minimum is exact: a path that ends there has passed no crest.

use glam::Vec3;

use super::surface::Side;
use super::surface::patch::Patch;
use crate::scalar::{larger, smaller};

/// Maximum number of false-position steps. Three or four are usual.
const MAX_STEPS: u32 = 16;
/// Fraction of the start's slope below which a path may end.
const FLAT: f32 = 4e-3;

/// A straight path through one patch.
#[derive(Debug)]
pub(super) struct StraightPath {
    from: (f32, f32),
    direction: (f32, f32),
    /// Coefficients of h, constant first.
    slope: [f32; 4],
}

impl StraightPath {
    /// Creates a path from a place of the patch, for a HIP at `hip`, in patch coordinates; at
    /// `t = 1` it has covered all of `direction`.
    #[inline]
    pub(super) fn new(
        patch: &Patch,
        hip: (f32, f32),
        from: (f32, f32),
        direction: (f32, f32),
    ) -> Self {
        let (off_u, off_v) = (from.0 - hip.0, from.1 - hip.1);
        let z = patch.height(from.0, from.1);
        let s = patch.slope_u(from.1) * direction.0 + patch.slope_v(from.0) * direction.1;
        let w = patch.a * direction.0 * direction.1;
        let slope = [
            off_u * direction.0 + off_v * direction.1 + z * s,
            direction.0 * direction.0 + direction.1 * direction.1 + s * s + 2.0 * w * z,
            3.0 * s * w,
            2.0 * w * w,
        ];
        Self {
            from,
            direction,
            slope,
        }
    }

    /// Returns `t` at the borders eastward or westward, and northward or southward.
    #[inline]
    pub(super) fn to_borders(&self) -> (f32, f32) {
        let along = |from: f32, direction: f32| match direction {
            direction if direction > 0.0 => (1.0 - from) / direction,
            direction if direction < 0.0 => from / -direction,
            _ => f32::INFINITY,
        };
        let ((u, v), (du, dv)) = (self.from, self.direction);
        (along(u, du), along(v, dv))
    }

    /// Returns the place at `t`, in the patch.
    #[inline]
    pub(super) fn at(&self, t: f32) -> (f32, f32) {
        let place = |from: f32, direction: f32| larger(smaller(from + t * direction, 1.0), 0.0);
        let ((u, v), (du, dv)) = (self.from, self.direction);
        (place(u, du), place(v, dv))
    }

    /// Returns the place at the nearer of its [`Self::to_borders`], exactly on the border.
    #[inline]
    pub(super) fn on_border(&self, (to_east, to_north): (f32, f32)) -> (f32, f32) {
        let end = smaller(to_east, to_north);
        let (mut u, mut v) = self.at(end);
        if to_east <= end {
            u = if self.direction.0 > 0.0 { 1.0 } else { 0.0 };
        }
        if to_north <= end {
            v = if self.direction.1 > 0.0 { 1.0 } else { 0.0 };
        }
        (u, v)
    }

    /// Returns half the slope of the squared distance over `t`.
    #[inline]
    fn slope_at(&self, t: f32) -> f32 {
        let [c0, c1, c2, c3] = self.slope;
        c0 + t * (c1 + t * (c2 + t * c3))
    }

    /// Returns the first minimum of the distance up to `end`, within rounding; `None` if the
    /// distance falls all the way. It must fall at the start.
    pub(super) fn first_minimum(&self, end: f32) -> Option<f32> {
        let [c0, c1, c2, c3] = self.slope;
        let mut end = end;
        // h has a maximum before its minimum only where it bends down at first. A root before
        // that maximum is the first one.
        let bends = c2 * c2 - 3.0 * c1 * c3;
        if c2 < 0.0 && c1 > 0.0 && bends > 0.0 {
            let crest = c1 / (libm::sqrtf(bends) - c2);
            if crest < end && self.slope_at(crest) >= 0.0 {
                end = crest;
            }
        }
        let mut at_high = self.slope_at(end);
        if at_high < 0.0 || at_high.is_nan() {
            return None;
        }
        // False position (Illinois): an end that stays twice counts half.
        let (mut low, mut high, mut at_low) = (0.0, end, c0);
        let mut stayed = 0;
        for _ in 0..MAX_STEPS {
            let t = low + (high - low) * (at_low / (at_low - at_high));
            let at = self.slope_at(t);
            if at.abs() <= -FLAT * c0 {
                return Some(t);
            }
            if at < 0.0 {
                (low, at_low) = (t, at);
                at_high *= if stayed > 0 { 0.5 } else { 1.0 };
                stayed = 1;
            } else {
                (high, at_high) = (t, at);
                at_low *= if stayed < 0 { 0.5 } else { 1.0 };
                stayed = -1;
            }
        }
        Some(low)
    }

    /// Returns true if half the squared distance on the path up to `t = 1` surely never exceeds its
    /// start by more than `noise`.
    pub(super) fn never_rises_above_start(&self, noise: f32) -> bool {
        // Bernstein coefficients of the mean slope from the start to `t`; times `t` it is the rise.
        let [c0, c1, c2, c3] = self.slope;
        let [c1, c2, c3] = [c1 / 2.0, c2 / 3.0, c3 / 4.0];
        let bernstein = [
            c0,
            c0 + c1 / 3.0,
            c0 + (2.0 * c1 + c2) / 3.0,
            c0 + c1 + c2 + c3,
        ];
        bernstein.iter().all(|b| *b <= noise)
    }
}

/// Returns the component of a vector along the tangent plane of these slopes; for a point on a
/// border, along the direction into the patch with the largest component.
pub(super) fn steepest(su: f32, sv: f32, border: Side, displacement: Vec3) -> Vec3 {
    // The projection onto the plane, multiplied out so that a wall loses no bits.
    let (across, norm) = (su * sv, 1.0 + su * su + sv * sv);
    let free = Vec3::new(
        ((1.0 + sv * sv) * displacement.x - across * displacement.y + su * displacement.z) / norm,
        ((1.0 + su * su) * displacement.y - across * displacement.x + sv * displacement.z) / norm,
        ((su * su + sv * sv) * displacement.z + su * displacement.x + sv * displacement.y) / norm,
    );
    if points_inward(free, border) {
        return free;
    }
    let mut best = Vec3::ZERO;
    if border.north != 0 {
        let east = (displacement.x + su * displacement.z) / (1.0 + su * su);
        best = longer(best, Vec3::new(east, 0.0, su * east), border);
    }
    if border.east != 0 {
        let north = (displacement.y + sv * displacement.z) / (1.0 + sv * sv);
        best = longer(best, Vec3::new(0.0, north, sv * north), border);
    }
    best
}

/// Returns true if a direction leads into the patch of a point on this border.
fn points_inward(displacement: Vec3, border: Side) -> bool {
    displacement.x * border.east as f32 <= 0.0 && displacement.y * border.north as f32 <= 0.0
}

fn longer(best: Vec3, other: Vec3, border: Side) -> Vec3 {
    if points_inward(other, border) && other.length_squared() > best.length_squared() {
        other
    } else {
        best
    }
}
