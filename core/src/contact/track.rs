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
use super::presence::is_far;
use super::spot::{Hand, Spot, is_inside, tile_of};
use crate::terrain::{Corners, Ground, Window};

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

/// A proxy at rest on a patch, and what is worth knowing about the patch to
/// follow it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Track {
    pub(super) spot: Spot,
    /// Whether the spot is well inside the patch.
    inside: bool,
    /// A column known to hold a patch, for the hand to be over.
    pub(super) over: [i32; 2],
    /// Heights above `base` cells.
    patch: Patch,
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

/// What lies under a hand.
pub(super) enum Under {
    /// A patch, or nothing that matters: the force needs no fading.
    Patch,
    /// No surface.
    Hole,
    /// The tile (column, row) is not here.
    Missing([i32; 2]),
}

impl Track {
    /// A proxy at `spot`, on the patch of these corners, for a hand over
    /// `over`; `None` if the patch is too steep.
    pub(super) fn new(corners: &Corners, over: [i32; 2], spot: Spot) -> Option<Self> {
        let patch = Patch::new(corners.heights);
        let twist = patch.a.abs();
        let steepest = twist + patch.b[0].abs() + patch.c[0].abs();
        if !(steepest <= GENTLE) {
            return None;
        }
        Some(Self {
            spot,
            inside: is_inside(spot.u) && is_inside(spot.v),
            over,
            patch,
            base: corners.base,
            steepest,
            shallow: SHALLOW / steepest,
            convex: CONVEX / twist - steepest,
            // The rows of the Hessian's derivative are 2a(zv, …) and 2a(zu, zu + zv).
            bend: 6.0 * twist * steepest,
        })
    }

    /// The same with the proxy at another spot of the patch.
    #[inline]
    pub(super) fn at(self, spot: Spot) -> Self {
        Self {
            spot,
            inside: is_inside(spot.u) && is_inside(spot.v),
            ..self
        }
    }

    /// The patch with its heights counted from the hand.
    #[inline]
    pub(super) fn seen_by(&self, hand: &Hand) -> Patch {
        self.patch.seen_from(hand.altitude(), self.base)
    }

    /// Whether the squared distance is convex all over the patch, for a hand
    /// `z` cells under any one point of it.
    #[inline]
    pub(super) fn is_convex(&self, z: f32) -> bool {
        z <= self.convex
    }

    /// What lies under a hand in `column`, as far as the force depends on it.
    pub(super) fn is_under<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        column: [i32; 2],
    ) -> Under {
        if self.over == column || is_far(self.spot.cell, column) {
            return Under::Patch;
        }
        match window.ground(column) {
            Ground::Patch(_) => {
                self.over = column;
                Under::Patch
            }
            Ground::Hole => Under::Hole,
            Ground::Missing => Under::Missing(tile_of(column)),
        }
    }

    /// Moves the spot to the closest point for a shallow hand, and tells how far
    /// it is from the hand; `None`, and the spot as it was, where more has to be
    /// looked at.
    #[inline]
    pub(super) fn follow(&mut self, hand: &Hand) -> Option<Vec3> {
        let patch = self.seen_by(hand);
        let (p, q) = hand.in_patch(self.spot.cell);
        let above = patch.polynomial(p, q);
        // How high the tangent plane in the spot passes over the hand.
        let stays = above >= patch.a * ((p - self.spot.u) * (q - self.spot.v));
        if !(self.inside && stays && above <= self.shallow) {
            return None;
        }
        let (to, is_exact) = self.leap(&patch, (p, q), above);
        let (u, v) = (p + to.x, q + to.y);
        let plain = is_exact && to.z >= 0.0 && self.is_convex(to.z);
        if !(plain && is_inside(u) && is_inside(v)) {
            return None;
        }
        (self.spot.u, self.spot.v) = (u, v);
        Some(to)
    }

    /// From a hand at `(p, q)`, `above` cells under the patch there, to the
    /// closest point, and whether it is within the error that may be left: one
    /// step of Newton's method and one more with the same Hessian.
    #[inline(always)]
    fn leap(&self, patch: &Patch, (p, q): (f32, f32), above: f32) -> (Vec3, bool) {
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

    /// From a hand at `(p, q)` to the closest point of the patch and of what it
    /// would be beyond its borders; `None` if Newton's method does not end.
    pub(super) fn closest(&self, patch: &Patch, (p, q): (f32, f32)) -> Option<Vec3> {
        let above = patch.polynomial(p, q);
        let mut start = (self.spot.u - p, self.spot.v - q);
        if above <= self.shallow {
            let (to, is_exact) = self.leap(patch, (p, q), above);
            if is_exact {
                return Some(to);
            }
            start = (to.x, to.y);
        }
        self.by_newton(patch, (p, q), start)
    }

    /// Whether the squared distance is convex from the last spot to (u, v),
    /// `z` cells above the hand, and wherever a way downhill might swing out to.
    pub(super) fn is_convex_between(&self, z: f32, (u, v): (f32, f32)) -> bool {
        let moved = (u - self.spot.u).abs().max((v - self.spot.v).abs());
        // A sublevel set around a minimum, of a function whose curvature lies
        // between ½ and L, is √(2L) times as wide as it is narrow.
        let swing = 2.0 * libm::sqrtf(1.5 + 2.0 * self.steepest * self.steepest);
        let reach = (self.steepest * (swing * moved)).min(self.steepest);
        self.patch.a.abs() * (z + reach) <= CONVEX
    }

    /// Newton's method from the point `(du, dv)` of the hand.
    fn by_newton(
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

#[cfg(test)]
#[path = "track_tests.rs"]
mod tests;
