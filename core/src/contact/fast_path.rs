//! Fast paths for nearly every tick: still free, or still sliding within a gentle patch.
//!
//! Each returns the same bits as the full contact (`proxy`), or nothing: a test
//! (`fast_paths_change_no_bit`) and the randomised stress test run scenes with and without them.
//! `bench/instructions-m4f.csv` shows the saved instructions: compare a sliding tick on the fast
//! path with a first contact.

use glam::Vec3;

use super::closest_point::{Convexity, PatchPoint, is_above_tangent_plane};
use super::surface::patch::Patch;
use super::surface::{HipView, SurfacePoint};
use super::sweep::lower;
use super::tolerance::BESIDE_OF_NEAR_HIP;
use crate::grid::{Cell, GridPoint};
use crate::terrain::{CellBox, CellContent, Window};

/// Returns true if a free HIP's path is clear, by one comparison or by the nine samples around it.
#[inline]
pub(super) fn is_free<const D: usize>(
    window: &Window<'_, D>,
    from: &GridPoint,
    to: &GridPoint,
) -> bool {
    let low = lower(from, to);
    low.cell() >= window.top()
        || window.is_clear_nearby(CellBox::around(from.column(), to.column()), low)
}

/// A proxy at rest well inside a convex patch, with full force.
#[derive(Clone, Copy, Debug)]
pub(super) struct PatchFollower {
    /// Place where it rests.
    pub(super) point: SurfacePoint,
    /// A cell that surely has a patch: while the HIP is over it, nothing fades.
    over: Cell,
    /// The patch, and the base of its heights in whole cells.
    patch: Patch,
    base: i32,
    convexity: Convexity,
}

impl PatchFollower {
    /// Creates the fast path of a proxy that came to rest with the HIP over the patch of `over`;
    /// returns `None` if the proxy must use the full contact.
    pub(super) fn new<const D: usize>(
        window: &Window<'_, D>,
        point: SurfacePoint,
        over: Cell,
    ) -> Option<Self> {
        if !(is_inside(point.u) && is_inside(point.v)) {
            return None;
        }
        let CellContent::Patch(corners) = window.ground(point.cell) else {
            return None;
        };
        let patch = Patch::new(corners.heights);
        let convexity = Convexity::of(&patch)?;
        Some(Self {
            point,
            over,
            base: corners.base,
            patch,
            convexity,
        })
    }

    /// Moves the proxy to its new place of rest, if that is still well inside its patch.
    #[inline]
    pub(super) fn follow(&mut self, view: &HipView) -> FollowResult {
        let patch = self.patch.relative_to(view.altitude(), self.base);
        let (p, q) = view.in_patch(self.point.cell);
        let (u, v) = (self.point.u, self.point.v);
        if is_above_tangent_plane(&patch, &self.point, (p - u, q - v)) {
            return FollowResult::NotApplicable;
        }
        let Some((place, is_exact)) = self.convexity.closest_if_shallow(&patch, (p, q)) else {
            return FollowResult::NotApplicable;
        };
        let is_in_patch = is_exact && is_inside(place.u) && is_inside(place.v);
        if !(is_in_patch && self.convexity.is_closest(&place) && self.over == view.column()) {
            let begin = (place, is_exact);
            let place = self
                .convexity
                .closest_from_start(&patch, (p, q), (u, v), begin);
            return place.map_or(FollowResult::NotApplicable, FollowResult::InPatch);
        }
        (self.point.u, self.point.v) = (place.u, place.v);
        let displacement = Vec3::new(place.u - p, place.v - q, place.z);
        FollowResult::AtRest(view.position(&self.point, place.z), displacement)
    }
}

/// Outcome of following a proxy within its patch.
pub(super) enum FollowResult {
    /// The proxy rests: its position, and the displacement from the HIP to it, cells.
    AtRest(GridPoint, Vec3),
    /// The full contact is needed, but the proxy does not leave the surface at once, and this is
    /// the patch's closest point.
    InPatch(PatchPoint),
    /// The full contact is needed.
    NotApplicable,
}

#[inline]
fn is_inside(x: f32) -> bool {
    x > BESIDE_OF_NEAR_HIP && x < 1.0 - BESIDE_OF_NEAR_HIP
}
