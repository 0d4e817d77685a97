//! The closest point of one patch to the HIP (paper §4.3.2, eq. 8-11).
//!
//! The paper minimises the squared distance D(u, v) by Newton's method in two variables;
//! `on_convex_patch` does so on gentle patches. On twisted patches the Hessian is indefinite, and
//! the iteration diverges, cycles or ends at a saddle. There one variable is eliminated exactly:
//! with v fixed, the patch is a straight line, a ruling, whose closest point has a closed form
//! (`on_ruling`).
//!
//! The rest, F(v) = min over u of D(u, v), is continuously differentiable
//! because D is a parabola in u: a minimum of F is a minimum of D over the
//! square, edges and corners included, and no saddle of D is one.
//!
//! The steeper of the two directions is eliminated: its closed form computes z without
//! cancellation, unlike the height of a steep patch at a rounded v.
//!
//! `docs/explanation/contact.md` has the error analysis.

use super::on_convex_patch::{Convexity, PatchPoint};
use super::on_ruling::Ruling;
use super::ruling_search::{MAX_EVALUATIONS, Rulings};
use crate::contact::budget::{Budget, CONVEX, RULINGS, rulings};
use crate::contact::surface::patch::Patch;
use crate::contact::tolerance::{COARSEST_RESOLUTION, RESOLUTION};
use crate::scalar::smaller;

/// Maximum number of searches by rulings: one, and one more each time the other variable turns out
/// to be the better one to eliminate.
pub const MAX_PASSES: u32 = 3;

/// A point of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Eastward coordinate in the patch, `[0, 1]`.
    pub u: f32,
    /// Northward coordinate in the patch, `[0, 1]`.
    pub v: f32,
    /// Height above the HIP, cells.
    pub z: f32,
    /// Evaluations of the distance that it took.
    pub evaluations: u32,
}

/// Searches downhill from `start` (in `[0, 1]²`) for a point of the patch from
/// which no direction inside the patch leads closer to the HIP.
///
/// `hip` is the haptic interface point in patch coordinates (u, v); it may lie
/// outside the unit square. The heights of `patch` count from it. Finite input
/// has a finite result. Up to slope 1 it is within 2·10⁻⁶ cell of the exact point;
/// above, 4 in 4,000 are not (`search_error_is_below_2e_6_cell_on_any_slope`).
///
/// ```
/// use hapterra_core::contact::closest_point::nearest_downhill;
/// use hapterra_core::contact::surface::patch::Patch;
///
/// // A plane that rises by half a cell eastward, 0.1 to 0.6 cell above the HIP.
/// let plane = Patch::new([0.1, 0.6, 0.1, 0.6]);
/// let nearest = nearest_downhill(&plane, (0.5, 0.25), (0.5, 0.25));
/// let height = 0.1 + 0.5 * 0.5;
/// assert!((nearest.u - (0.5 - 0.5 * height / 1.25)).abs() < 1e-6);
/// assert!((nearest.z - height / 1.25).abs() < 1e-6);
/// ```
#[must_use]
pub fn nearest_downhill(patch: &Patch, hip: (f32, f32), start: (f32, f32)) -> Nearest {
    let mut budget = Budget::new(u32::MAX);
    // Without a limit, a point is always found.
    search(patch, hip, start, &mut budget).unwrap_or(Nearest::NONE)
}

/// Does the same as [`nearest_downhill`] within a budget; returns `None` if the budget is too
/// small.
pub(super) fn search(
    patch: &Patch,
    hip: (f32, f32),
    start: (f32, f32),
    budget: &mut Budget,
) -> Option<Nearest> {
    if !budget.has(CONVEX + RULINGS + rulings(3)) {
        return None;
    }
    budget.spend(CONVEX);
    let found = match closest_if_convex(patch, hip, start) {
        Some(place) => place,
        None => by_rulings(patch, hip, start, budget)?,
    };
    #[cfg(test)]
    crate::contact::stats::searched(found.evaluations);
    Some(found)
}

/// Searches by rulings; returns `None` if the budget ends.
#[inline(never)]
fn by_rulings(
    patch: &Patch,
    hip: (f32, f32),
    start: (f32, f32),
    budget: &mut Budget,
) -> Option<Nearest> {
    budget.spend(RULINGS);
    let transposed = patch.transposed();
    let mut is_transposed = is_steeper_north(patch, hip, start);
    let max_evaluations = budget.remaining_rulings().min(MAX_EVALUATIONS);
    let (mut best, mut evaluated) = (start, 0);
    for pass in 1.. {
        let (oriented, from, start) = match is_transposed {
            true => (&transposed, (hip.1, hip.0), best.0),
            false => (patch, hip, best.1),
        };
        let mut search = Rulings {
            patch: oriented,
            hip: from,
            evaluated,
            max_evaluations,
        };
        let found = search.closest_to(start);
        let is_spent = search.is_spent();
        evaluated = search.evaluated;
        if is_spent && max_evaluations < MAX_EVALUATIONS {
            budget.spend(rulings(evaluated));
            return None;
        }
        best = swapped_if(is_transposed, (found.u, found.v));
        if is_spent || !needs_transposing(&found) || pass == MAX_PASSES {
            budget.spend(rulings(evaluated));
            let nearest = Nearest {
                u: best.0,
                v: best.1,
                z: found.z,
                evaluations: evaluated,
            };
            return Some(nearest.snapped(patch, hip));
        }
        is_transposed = !is_transposed;
    }
    None
}

/// Returns the closest point of a patch that is convex enough for Newton's method.
fn closest_if_convex(patch: &Patch, hip: (f32, f32), from: (f32, f32)) -> Option<Nearest> {
    let place = Convexity::of(patch)?.closest(patch, hip, from)?;
    Some(Nearest::from_convex(place))
}

const fn swapped_if(is_transposed: bool, (u, v): (f32, f32)) -> (f32, f32) {
    if is_transposed { (v, u) } else { (u, v) }
}

/// Returns true if the patch is steeper northward than eastward at a place. If both slopes are
/// equal, as at the foot of a raised corner, the HIP's direction decides, so that a mirrored scene
/// has the mirrored result.
fn is_steeper_north(patch: &Patch, (p, q): (f32, f32), (u, v): (f32, f32)) -> bool {
    let (east, north) = (patch.slope_u(v).abs(), patch.slope_v(u).abs());
    north > east || (north == east && (q - v).abs() > (p - u).abs())
}

/// Returns true if the eliminated variable ended at a limit and the searched one did not, or if it
/// is no longer the steeper one: the other search is then better conditioned.
fn needs_transposing(found: &Ruling) -> bool {
    let inside_by = |margin: f32| found.v > margin && 1.0 - found.v > margin;
    let steeper = found.across.abs() > 4.0 * found.along.abs() + 4.0;
    (found.at_end && inside_by(RESOLUTION)) || (steeper && inside_by(0.0))
}

/// Returns the distance, in cells, below which two places in a patch cannot be distinguished for a
/// HIP at coordinate `hip`.
pub(super) fn resolution(hip: f32) -> f32 {
    smaller(finest_resolution(hip), COARSEST_RESOLUTION)
}

/// Does the same as [`resolution`], without its limit.
#[inline]
pub(super) fn finest_resolution(hip: f32) -> f32 {
    RESOLUTION * (1.0 + 2.0 * hip.abs())
}

/// Returns the coordinate, moved to the border if its distance from the border is below the
/// rounding for a HIP at coordinate `hip`.
fn snapped(x: f32, hip: f32) -> f32 {
    let resolution = resolution(hip);
    if x < resolution {
        0.0
    } else if 1.0 - x < resolution {
        1.0
    } else {
        x
    }
}

impl Nearest {
    /// The state before a point is found.
    pub(super) const NONE: Self = Self {
        u: 0.0,
        v: 0.0,
        z: 0.0,
        evaluations: 0,
    };

    /// Converts the closest point of a convex patch.
    #[inline]
    pub(super) const fn from_convex(PatchPoint { u, v, z }: PatchPoint) -> Self {
        let evaluations = 1;
        Self {
            u,
            v,
            z,
            evaluations,
        }
    }

    /// Returns the point, moved to the border if it is on it within rounding.
    fn snapped(self, patch: &Patch, (p, q): (f32, f32)) -> Self {
        let (u, v) = (snapped(self.u, p), snapped(self.v, q));
        if (u, v) == (self.u, self.v) {
            return self;
        }
        let z = patch.height(u, v);
        if (z - self.z).abs() > resolution(p) + resolution(q) {
            return self; // up a steep wall that stands on the border
        }
        Self { u, v, z, ..self }
    }
}

#[cfg(test)]
#[path = "on_patch_tests.rs"]
mod tests;
