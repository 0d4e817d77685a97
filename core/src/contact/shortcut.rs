//! What nearly every tick is, answered with fewer instructions: free as before, or
//! sliding on within a gentle patch.
//!
//! Each answers with the bits that the whole contact (`proxy`) would answer with,
//! or not at all: a test (`the_shortcuts_change_no_bit`) and the soak run scenes with
//! and without. What they save is in `bench/instructions-m4f.csv`: a sliding tick
//! that takes one beside a first contact, which does not.

use glam::Vec3;

use super::boundary_fade::is_far;
use super::closest_point::{Convexity, passes_over};
use super::surface::patch::Patch;
use super::surface::{HipView, SurfacePoint};
use super::sweep::lower;
use super::tolerance::BESIDE_OF_NEAR_HIP;
use crate::grid::{Cell, GridPoint};
use crate::terrain::{CellBox, Corners, Ground, Window};

/// Whether a free HIP's path is clear, by one comparison or by a look at the nine
/// samples around it.
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

/// A proxy at rest well inside a convex patch, all of its force felt.
#[derive(Clone, Copy, Debug)]
pub(super) struct Follow {
    /// Where it rests.
    pub(super) point: SurfacePoint,
    /// A cell known to hold a patch, for the HIP to be over: nothing fades.
    over: Cell,
    corners: Corners,
    patch: Patch,
    convexity: Convexity,
}

impl Follow {
    /// Of a proxy that came to rest for a HIP over `over`; `None` where there is
    /// no shortcut.
    pub(super) fn from<const D: usize>(
        window: &Window<'_, D>,
        point: SurfacePoint,
        over: Cell,
    ) -> Option<Self> {
        let Ground::Patch(corners) = window.ground(point.cell) else {
            return None;
        };
        let is_patch = |cell| matches!(window.ground(cell), Ground::Patch(_));
        let nothing_fades = over == point.cell || (!is_far(point.cell, over) && is_patch(over));
        let patch = Patch::new(corners.heights);
        let convexity = Convexity::of(&patch)?;
        (nothing_fades && is_inside(point.u) && is_inside(point.v)).then_some(Self {
            point,
            over,
            corners,
            patch,
            convexity,
        })
    }

    /// Moves the proxy to where it rests now: its position, and the displacement
    /// from the HIP to it, cells. `None`, and nothing moved, where more has to be
    /// looked at.
    #[inline]
    pub(super) fn to(&mut self, view: &HipView) -> Option<(GridPoint, Vec3)> {
        if self.over != view.column() {
            return None;
        }
        let patch = self.patch.seen_from(view.altitude(), self.corners.base);
        let (p, q) = view.in_patch(self.point.cell);
        if passes_over(&patch, &self.point, (p - self.point.u, q - self.point.v)) {
            return None;
        }
        let height = patch.polynomial(p, q);
        let place = self.convexity.closest_at_once(&patch, (p, q), height)?;
        if !(is_inside(place.u) && is_inside(place.v)) {
            return None;
        }
        (self.point.u, self.point.v) = (place.u, place.v);
        let displacement = Vec3::new(place.u - p, place.v - q, place.z);
        Some((view.position(&self.point, place.z), displacement))
    }
}

#[inline]
fn is_inside(x: f32) -> bool {
    x > BESIDE_OF_NEAR_HIP && x < 1.0 - BESIDE_OF_NEAR_HIP
}
