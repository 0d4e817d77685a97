//! The proxy's way when the hand has hardly moved: the closest point of the
//! patch it rests on, by Newton's method in both variables.
//!
//! Nearly every tick in contact is of this kind. What is answered here is the
//! point that the general search ([`super::descent`]) would come to rest at;
//! as soon as that is not plain, the general search decides.
//!
//! While a·z is small the squared distance is convex between the last proxy
//! and the new one, so there is one minimum to be found there and it does not
//! matter where the search starts. A hand close under the surface starts it at
//! the point above itself: ticks then do not wait for one another's results,
//! and the first step has a closed form.

// `!(a <= b)` is how what is not a number is left to the general search, too.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

use glam::Vec3;

use super::patch::Patch;
use super::spot::{Hand, Spot};
use crate::grid::GridPoint;
use crate::terrain::{Corners, Ground, Window};

/// |a| + |b| + |c| at most, cells a cell: what the rounding of the height then
/// costs is below 1e-6 cell.
const GENTLE: f32 = 6.0;
/// A hand starts the search while its depth times the slope is below this.
const SHALLOW: f32 = 0.25;
/// Error that may be left, cells.
const LEFT: f32 = 5e-8;
/// Newton steps at most, after the start.
const STEPS: u32 = 4;
/// Largest |a·z|: the Hessian's eigenvalues are then ½ at least.
const CONVEX: f32 = 0.5;
/// Distance from the patch's border below which the general search decides.
const BORDER: f32 = 1e-6;

/// A patch that a proxy rests on and may be followed over.
#[derive(Clone, Copy, Debug)]
pub(super) struct Track {
    /// Heights above `base` cells.
    patch: Patch,
    base: i32,
    /// |a| + |b| + |c|: no two points of the patch differ by more in height.
    steepest: f32,
    /// Change of the Hessian, at most, for a step of a cell: Newton's error
    /// after a step s is `bend`·s² at most.
    bend: f32,
    /// How far, in steps, a way downhill may swing out.
    swing: f32,
    /// A column known to hold a patch, for the hand to be over.
    over: [i32; 2],
}

impl Track {
    /// The patch of these corners, for a hand over `over`; `None` if it is too
    /// steep.
    pub(super) fn new(corners: &Corners, over: [i32; 2]) -> Option<Self> {
        let patch = Patch::new(corners.heights);
        let steepest = patch.a.abs() + patch.b.abs() + patch.c.abs();
        if !(steepest <= GENTLE) {
            return None;
        }
        Some(Self {
            patch,
            base: corners.base,
            steepest,
            // The rows of the Hessian's derivative are 2a(zv, …) and 2a(zu, zu + zv).
            bend: 6.0 * patch.a.abs() * steepest,
            // A sublevel set around a minimum, of a function whose curvature
            // lies between ½ and L, is √(2L) times as wide as it is narrow.
            swing: 2.0 * libm::sqrtf(1.5 + 2.0 * steepest * steepest),
            over,
        })
    }

    /// Whether a patch lies under a hand in `column`, so that the force needs
    /// no fading.
    #[inline]
    pub(super) fn is_under<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        column: [i32; 2],
    ) -> bool {
        if self.over == column {
            return true;
        }
        let there = matches!(window.ground(column), Ground::Patch(_));
        if there {
            self.over = column;
        }
        there
    }

    /// Moves the spot to the closest point for a hand at `hip`, and tells how
    /// far it is from the hand; `None`, and the spot as it was, where it takes
    /// the general search to tell.
    #[inline]
    pub(super) fn follow(&self, hip: &GridPoint, spot: &mut Spot) -> Option<Vec3> {
        let hand = Hand::new(*hip);
        let patch = self.patch.seen_from(hand.altitude(), self.base);
        let (p, q) = hand.in_patch(spot.cell);
        let above = patch.height(p, q);
        // How high the tangent plane in the spot passes over the hand.
        if !(above >= patch.a * ((p - spot.u) * (q - spot.v))) {
            return None;
        }
        let (u, v) = self.closest(&patch, (p, q), above, (spot.u, spot.v))?;
        let z = patch.height(u, v);
        if !(z >= 0.0 && is_inside(u) && is_inside(v)) {
            return None;
        }
        if !(patch.a.abs() * (z + self.steepest) <= CONVEX) {
            let moved = (u - spot.u).abs().max((v - spot.v).abs());
            let reach = self.steepest * (self.swing * moved);
            if !(patch.a.abs() * (z + reach) <= CONVEX) {
                return None;
            }
        }
        (spot.u, spot.v) = (u, v);
        Some(Vec3::new(u - p, v - q, z))
    }

    /// Newton's method for the closest point, from above the hand at `(p, q)`
    /// or from `last`.
    #[inline]
    fn closest(
        &self,
        patch: &Patch,
        (p, q): (f32, f32),
        above: f32,
        last: (f32, f32),
    ) -> Option<(f32, f32)> {
        let (mut u, mut v) = last;
        if above * self.steepest <= SHALLOW {
            let step = from_above(patch, (p, q), above);
            (u, v) = (p + step.0, q + step.1);
            if self.is_last(step) {
                return Some((u, v));
            }
        }
        for _ in 0..STEPS {
            let step = newton(patch, (p - u, q - v), (u, v));
            (u, v) = (u + step.0, v + step.1);
            if self.is_last(step) {
                return Some((u, v));
            }
        }
        None
    }

    /// Whether the error left after this step is negligible.
    #[inline]
    fn is_last(&self, (du, dv): (f32, f32)) -> bool {
        self.bend * (du * du + dv * dv) <= LEFT
    }
}

/// The first step, from the point above the hand: [`newton`] without the terms
/// that are zero there.
#[inline]
fn from_above(patch: &Patch, (p, q): (f32, f32), z: f32) -> (f32, f32) {
    let (zu, zv) = (patch.slope_u(q), patch.slope_v(p));
    let za = patch.a * z;
    let det = (1.0 + zu * zu) + (zv * zv - za * (za + 2.0 * (zu * zv)));
    let down = -z / det;
    ((zu - zv * za) * down, (zv - zu * za) * down)
}

/// One step of Newton's method (eq. 8-11) from (u, v), for a hand `(east,
/// north)` of there.
#[inline]
fn newton(patch: &Patch, (east, north): (f32, f32), (u, v): (f32, f32)) -> (f32, f32) {
    let (zu, zv) = (patch.slope_u(v), patch.slope_v(u));
    let z = (patch.d + patch.b * u) + zv * v;
    // Half the gradient and the Hessian of the squared distance.
    let (gu, gv) = (z * zu - east, z * zv - north);
    let (uu, vv) = (1.0 + zu * zu, 1.0 + zv * zv);
    let uv = zu * zv + patch.a * z;
    let scale = 1.0 / (uu * vv - uv * uv);
    ((gv * uv - gu * vv) * scale, (gu * uv - gv * uu) * scale)
}

#[inline]
fn is_inside(x: f32) -> bool {
    x > BORDER && x < 1.0 - BORDER
}

#[cfg(test)]
#[path = "track_tests.rs"]
mod tests;
