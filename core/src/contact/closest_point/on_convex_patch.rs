//! The closest point of a patch over which the squared distance is convex.
//!
//! While a·z is small, the squared distance to the HIP is convex: it has one minimum, and the start
//! of the search does not matter. The search starts at the place above a shallow HIP. There half
//! the gradient is z·∇z, so the Hessian's first step has a closed form.

// `!(a <= b)` passes NaN on to the search by rulings.
#![allow(clippy::neg_cmp_op_on_partial_ord)]

use crate::contact::surface::Side;
use crate::contact::surface::is_well_inside;
use crate::contact::surface::patch::Patch;
use crate::contact::tolerance::{CONVEX, LEVEL, NEWTON_ERROR, SHALLOW, STEEPEST_CONVEX};

/// Maximum number of Newton steps if the first two were not exact enough.
const MAX_NEWTON_STEPS: u32 = 4;

/// Conditions for Newton's method on a patch. They depend only on the patch's shape, not on its
/// height above the HIP.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) struct Convexity {
    /// |a| + |b| + |c|, the maximum difference in height of two points of the patch.
    steepest: f32,
    /// |a|
    twist: f32,
    /// Maximum depth of the HIP, in cells, at which the search starts above it.
    shallow: f32,
    /// Maximum height of a point of the patch above the HIP, in cells, at which the squared
    /// distance is convex all over the patch.
    convex: f32,
    /// Maximum change of the Hessian over a step of one cell: after a step s, the error of Newton's
    /// method is at most `bend`·s².
    bend: f32,
}

/// A place in a patch and its height above the HIP, cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::contact) struct PatchPoint {
    pub(in crate::contact) u: f32,
    pub(in crate::contact) v: f32,
    pub(in crate::contact) z: f32,
}

impl Convexity {
    /// Returns the conditions of a patch, or `None` if it is too steep.
    #[inline]
    pub(in crate::contact) fn of(patch: &Patch) -> Option<Self> {
        let twist = patch.a.abs();
        let steepest = twist + patch.b[0].abs() + patch.c[0].abs();
        if !(steepest <= STEEPEST_CONVEX) {
            return None;
        }
        Some(Self {
            steepest,
            twist,
            shallow: SHALLOW / steepest,
            convex: CONVEX / twist - steepest,
            // The rows of the Hessian's derivative are 2a(zv, …) and 2a(zu, zu + zv).
            bend: 6.0 * twist * steepest,
        })
    }

    /// Returns true if the squared distance is convex all over the patch, given one point `z` cells
    /// above the HIP.
    #[inline]
    fn is_convex_everywhere(&self, z: f32) -> bool {
        z <= self.convex
    }

    /// Returns true if the squared distance is convex between two places, the second `to.z` cells
    /// above the HIP, and everywhere that a path downhill may reach.
    fn is_convex_between(&self, (u, v): (f32, f32), to: &PatchPoint) -> bool {
        let moved = (to.u - u).abs().max((to.v - v).abs());
        // A sublevel set around a minimum, of a function whose curvature lies
        // between ½ and L, is √(2L) times as wide as it is narrow.
        let swing = 2.0 * libm::sqrtf(1.5 + 2.0 * self.steepest * self.steepest);
        let rise = (self.steepest * (swing * moved)).min(self.steepest);
        self.twist * (to.z + rise) <= CONVEX
    }

    /// Returns the closest point of the patch, extended beyond its borders, to a shallow HIP at
    /// `hip`, in patch coordinates, and true if it is exact; `None` if the HIP is not shallow.
    #[inline]
    pub(in crate::contact) fn closest_if_shallow(
        &self,
        patch: &Patch,
        hip: (f32, f32),
    ) -> Option<(PatchPoint, bool)> {
        let height = patch.polynomial(hip.0, hip.1);
        (height <= self.shallow).then(|| self.by_one_hessian(patch, hip, height))
    }

    /// Returns true if an exact place inside the patch is the closest point of the whole patch.
    #[inline]
    pub(in crate::contact) fn is_closest(&self, place: &PatchPoint) -> bool {
        place.z >= 0.0 && self.is_convex_everywhere(place.z)
    }

    /// Returns the closest point to a HIP at `hip`, in patch coordinates, for a proxy at `from`;
    /// `None` if only the search by rulings can decide.
    pub(super) fn closest(
        &self,
        patch: &Patch,
        hip: (f32, f32),
        from: (f32, f32),
    ) -> Option<PatchPoint> {
        let begin = self.closest_if_shallow(patch, hip).unwrap_or_else(|| {
            let z = patch.polynomial(hip.0, hip.1);
            let (u, v) = from;
            (PatchPoint { u, v, z }, false)
        });
        self.closest_from_start(patch, hip, from, begin)
    }

    /// Does the same as [`Self::closest`], with the result of [`Self::closest_if_shallow`].
    #[inline]
    pub(in crate::contact) fn closest_from_start(
        &self,
        patch: &Patch,
        hip: (f32, f32),
        from: (f32, f32),
        (mut place, mut is_exact): (PatchPoint, bool),
    ) -> Option<PatchPoint> {
        loop {
            let side = side_beyond(&place);
            if side != Side::NONE {
                let on_border = self.closest_on_border(patch, hip, side);
                if is_exact || on_border.is_some() {
                    return on_border;
                }
            } else if is_exact {
                let convex =
                    self.is_convex_everywhere(place.z) || self.is_convex_between(from, &place);
                return (place.z >= 0.0 && convex).then_some(place);
            }
            (place, is_exact) = (self.by_newton(patch, hip, place)?, true);
        }
    }

    /// Returns the closest point of the patch, extended beyond its borders, to the HIP, by two
    /// steps with one Hessian; and true if its error is within [`NEWTON_ERROR`].
    #[inline(always)]
    fn by_one_hessian(&self, patch: &Patch, (p, q): (f32, f32), height: f32) -> (PatchPoint, bool) {
        let slope = patch.b[0] + patch.a * q;
        let (zu, zv) = (slope, patch.c[0] + patch.a * p);
        // Where the distance is only height, half its gradient is z·(zu, zv).
        let (uu, vv) = (1.0 + zu * zu, 1.0 + zv * zv);
        let uv = zu * zv + patch.a * height;
        let scale = 1.0 / (uu * vv - uv * uv);
        let drop = height * scale;
        let (du, dv) = ((zv * uv - zu * vv) * drop, (zu * uv - zv * uu) * drop);
        // The remaining gradient, and the step by the same Hessian.
        let (zu, zv) = (zu + patch.a * dv, zv + patch.a * du);
        let z = height + (slope * du + zv * dv);
        let (gu, gv) = (z * zu + du, z * zv + dv);
        let (eu, ev) = ((gv * uv - gu * vv) * scale, (gu * uv - gv * uu) * scale);
        // The first step's error, corrected for the change of the Hessian over it.
        let (first, second) = (du * du + dv * dv, eu * eu + ev * ev);
        let is_exact = (self.bend * self.bend) * (first * second) <= NEWTON_ERROR * NEWTON_ERROR;
        let place = PatchPoint {
            u: p + (du + eu),
            v: q + (dv + ev),
            z: z + (zu * eu + zv * ev),
        };
        (place, is_exact)
    }

    /// Runs Newton's method (eq. 8-11) from a place; returns `None` if [`MAX_NEWTON_STEPS`] are not
    /// enough.
    fn by_newton(&self, patch: &Patch, (p, q): (f32, f32), from: PatchPoint) -> Option<PatchPoint> {
        let (mut u, mut v) = (from.u, from.v);
        for _ in 0..MAX_NEWTON_STEPS {
            let (zu, zv) = (patch.b[0] + patch.a * v, patch.c[0] + patch.a * u);
            let z = (patch.corners[0] + patch.b[0] * u) + zv * v;
            // Half the gradient and the Hessian of the squared distance.
            let (gu, gv) = (z * zu + (u - p), z * zv + (v - q));
            let (uu, vv) = (1.0 + zu * zu, 1.0 + zv * zv);
            let uv = zu * zv + patch.a * z;
            let scale = 1.0 / (uu * vv - uv * uv);
            let (eu, ev) = ((gv * uv - gu * vv) * scale, (gu * uv - gv * uu) * scale);
            (u, v) = (u + eu, v + ev);
            if self.bend * (eu * eu + ev * ev) <= NEWTON_ERROR {
                let z = patch.polynomial(u, v);
                return Some(PatchPoint { u, v, z });
            }
        }
        None
    }

    /// Returns the patch's closest point, if it lies on an edge or vertex toward a side.
    ///
    /// The distance is convex. So a point of an edge from which the distance falls out of the patch
    /// is the patch's minimum, and so is a vertex from which it falls out over both edges.
    fn closest_on_border(&self, patch: &Patch, hip: (f32, f32), side: Side) -> Option<PatchPoint> {
        let edges = [Side { north: 0, ..side }, Side { east: 0, ..side }];
        edges
            .into_iter()
            .filter(|edge| *edge != Side::NONE)
            .find_map(|edge| {
                let (place, side) = closest_on_edge(patch, hip, edge);
                let is_above = place.z >= 0.0 && self.is_convex_everywhere(place.z);
                (is_above && falls_outward(patch, hip, &place, side)).then_some(place)
            })
    }
}

/// Returns the side of its patch on which a place lies beyond or beside the border.
fn side_beyond(place: &PatchPoint) -> Side {
    let [east, north] = [place.u, place.v].map(|x| match () {
        () if is_well_inside(x) => 0,
        () if x > 0.5 => 1,
        () => -1,
    });
    Side { east, north }
}

/// Returns the point of an edge closest to a HIP, and its side: toward a vertex, if it is one.
#[inline(always)]
fn closest_on_edge(patch: &Patch, (p, q): (f32, f32), edge: Side) -> (PatchPoint, Side) {
    let [sw, se, nw, ne] = patch.corners;
    if edge.north == 0 {
        let column = usize::from(edge.east > 0);
        let ends = if column == 0 { [sw, nw] } else { [se, ne] };
        let (v, z, north) = closest_on_line(q, patch.c[column], ends);
        let u = column as f32;
        (PatchPoint { u, v, z }, Side { north, ..edge })
    } else {
        let row = usize::from(edge.north > 0);
        let ends = if row == 0 { [sw, se] } else { [nw, ne] };
        let (u, z, east) = closest_on_line(p, patch.b[row], ends);
        let v = row as f32;
        (PatchPoint { u, v, z }, Side { east, ..edge })
    }
}

/// Returns the point closest to a HIP at coordinate `hip` on an edge between two heights above it:
/// its coordinate, its height, and which end it is (−1, 1, or 0).
#[inline(always)]
fn closest_on_line(hip: f32, slope: f32, [start, end]: [f32; 2]) -> (f32, f32, i32) {
    // Computed from the edge's end: with a far HIP, the line's height above it would cancel.
    let x = (hip - slope * start) / (1.0 + slope * slope);
    match () {
        () if is_well_inside(x) => (x, start * (1.0 - x) + end * x, 0),
        () if x > 0.5 => (1.0, end, 1),
        () => (0.0, start, -1),
    }
}

/// Returns true if the distance surely falls out of the patch at a place of its border.
#[inline(always)]
fn falls_outward(patch: &Patch, (p, q): (f32, f32), place: &PatchPoint, side: Side) -> bool {
    let is_downhill = |toward: i32, slope: f32| toward == 0 || toward as f32 * slope < -LEVEL;
    is_downhill(side.east, (place.u - p) + place.z * patch.slope_u(place.v))
        && is_downhill(side.north, (place.v - q) + place.z * patch.slope_v(place.u))
}

#[cfg(test)]
#[path = "on_convex_patch_tests.rs"]
mod tests;
