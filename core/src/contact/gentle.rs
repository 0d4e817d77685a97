//! A patch so gentle that the closest point is found by Newton's method in both
//! variables.
//!
//! While a·z is small the squared distance is convex, so there is one minimum to
//! be found and it does not matter where the search starts. A hand close under
//! the surface starts it at the point above itself: ticks then do not wait for one
//! another's results, and the first step has a closed form.

// `!(a <= b)` is how what is not a number is left to the general search, too.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

use glam::Vec3;

use super::patch::Patch;
use super::spot::{Hand, Spot};
use crate::terrain::Corners;

/// |a| + |b| + |c| at most, cells a cell: what the rounding of the height then
/// costs is below 1e-6 cell.
const GENTLE: f32 = 6.0;
/// A hand starts the search while its depth times the slope is below this.
const SHALLOW: f32 = 0.25;
/// Error that may be left, cells.
const LEFT: f32 = 5e-8;
/// Newton steps at most where the start was not good enough.
const STEPS: u32 = 4;
/// Largest |a·z|: the Hessian's eigenvalues are then ½ at least.
const CONVEX: f32 = 0.5;

/// A gentle patch, and what is worth knowing about it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gentle {
    /// Heights above `base` cells.
    pub(super) patch: Patch,
    base: i32,
    /// |a| + |b| + |c|: no two points of the patch differ by more in height.
    steepest: f32,
    /// Depth of the hand, in cells, up to which the search starts from it.
    shallow: f32,
    /// Depth of the hand under any one point of the patch, in cells, up to
    /// which the squared distance is convex all over the patch.
    convex: f32,
    /// Change of the Hessian, at most, over a step of a cell: Newton's error
    /// after a step s is `bend`·s² at most.
    bend: f32,
}

impl Gentle {
    /// The patch of these corners; `None` if it is too steep.
    #[inline]
    pub(super) fn new(corners: &Corners) -> Option<Self> {
        let patch = Patch::new(corners.heights);
        let twist = patch.a.abs();
        let steepest = twist + patch.b[0].abs() + patch.c[0].abs();
        if !(steepest <= GENTLE) {
            return None;
        }
        Some(Self {
            patch,
            base: corners.base,
            steepest,
            shallow: SHALLOW / steepest,
            convex: CONVEX / twist - steepest,
            // The rows of the Hessian's derivative are 2a(zv, …) and 2a(zu, zu + zv).
            bend: 6.0 * twist * steepest,
        })
    }

    /// The patch with its heights counted from the hand.
    #[inline]
    pub(super) fn seen_by(&self, hand: &Hand) -> Patch {
        self.patch.seen_from(hand.altitude(), self.base)
    }

    /// Whether a hand so far under the patch starts the search.
    #[inline]
    pub(super) fn is_shallow(&self, above: f32) -> bool {
        above <= self.shallow
    }

    /// Whether the squared distance is convex all over the patch, for a hand
    /// `z` cells under any one point of it.
    #[inline]
    pub(super) fn is_convex(&self, z: f32) -> bool {
        z <= self.convex
    }

    /// Whether the squared distance is convex from a spot to (u, v), `z` cells
    /// above the hand, and wherever a way downhill might swing out to.
    pub(super) fn is_convex_between(&self, from: &Spot, z: f32, (u, v): (f32, f32)) -> bool {
        let moved = (u - from.u).abs().max((v - from.v).abs());
        // A sublevel set around a minimum, of a function whose curvature lies
        // between ½ and L, is √(2L) times as wide as it is narrow.
        let swing = 2.0 * libm::sqrtf(1.5 + 2.0 * self.steepest * self.steepest);
        let reach = (self.steepest * (swing * moved)).min(self.steepest);
        self.patch.a.abs() * (z + reach) <= CONVEX
    }

    /// About how far from a hand at `(p, q)`, `above` cells under the patch there,
    /// the patch and what it would be beyond its borders are closest to it, and
    /// whether that is within the error that may be left.
    #[inline(always)]
    pub(super) fn guess(
        &self,
        patch: &Patch,
        (p, q): (f32, f32),
        above: f32,
        from: &Spot,
    ) -> (Vec3, bool) {
        if self.is_shallow(above) {
            self.leap(patch, (p, q), above)
        } else {
            (Vec3::new(from.u - p, from.v - q, above), false)
        }
    }

    /// From a hand at `(p, q)`, `above` cells under the patch there, to the
    /// closest point, and whether it is within the error that may be left: one
    /// step of Newton's method and one more with the same Hessian.
    #[inline(always)]
    pub(super) fn leap(&self, patch: &Patch, (p, q): (f32, f32), above: f32) -> (Vec3, bool) {
        let slope = patch.b[0] + patch.a * q;
        let (zu, zv) = (slope, patch.c[0] + patch.a * p);
        // Where the distance is only height, half its gradient is z·(zu, zv).
        let (uu, vv) = (1.0 + zu * zu, 1.0 + zv * zv);
        let uv = zu * zv + patch.a * above;
        let scale = 1.0 / (uu * vv - uv * uv);
        let drop = above * scale;
        let (du, dv) = ((zv * uv - zu * vv) * drop, (zu * uv - zv * uu) * drop);
        // The gradient that is left there, and what the same Hessian makes of it.
        let (zu, zv) = (zu + patch.a * dv, zv + patch.a * du);
        let z = above + (slope * du + zv * dv);
        let (gu, gv) = (z * zu + du, z * zv + dv);
        let (eu, ev) = ((gv * uv - gu * vv) * scale, (gu * uv - gv * uu) * scale);
        // The first step's error, less by what the Hessian has changed over it.
        let (first, second) = (du * du + dv * dv, eu * eu + ev * ev);
        let is_exact = (self.bend * self.bend) * (first * second) <= LEFT * LEFT;
        (
            Vec3::new(du + eu, dv + ev, z + (zu * eu + zv * ev)),
            is_exact,
        )
    }

    /// Newton's method from the point `(du, dv)` of the hand.
    pub(super) fn by_newton(
        &self,
        patch: &Patch,
        (p, q): (f32, f32),
        (mut du, mut dv): (f32, f32),
    ) -> Option<Vec3> {
        for _ in 0..STEPS {
            let (eu, ev) = newton(patch, (-du, -dv), (p + du, q + dv));
            (du, dv) = (du + eu, dv + ev);
            if self.bend * (eu * eu + ev * ev) <= LEFT {
                return Some(Vec3::new(du, dv, patch.polynomial(p + du, q + dv)));
            }
        }
        None
    }
}

/// One step of Newton's method (eq. 8-11) from (u, v), for a hand `(east,
/// north)` of there.
#[inline]
fn newton(patch: &Patch, (east, north): (f32, f32), (u, v): (f32, f32)) -> (f32, f32) {
    let (zu, zv) = (patch.b[0] + patch.a * v, patch.c[0] + patch.a * u);
    let z = (patch.corners[0] + patch.b[0] * u) + zv * v;
    // Half the gradient and the Hessian of the squared distance.
    let (gu, gv) = (z * zu - east, z * zv - north);
    let (uu, vv) = (1.0 + zu * zu, 1.0 + zv * zv);
    let uv = zu * zv + patch.a * z;
    let scale = 1.0 / (uu * vv - uv * uv);
    ((gv * uv - gu * vv) * scale, (gu * uv - gv * uu) * scale)
}
