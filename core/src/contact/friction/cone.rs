//! The friction cone: pull along the surface, pressure, and the limit that friction holds.
//!
//! `D` is the vector from the proxy to the HIP. The pull is the component of `D` along the steepest
//! direction in which the proxy can move, over all patches that meet at it. The rest of `D`
//! presses. On an edge or a vertex, each patch offers only the directions that lead into it.

use glam::Vec3;

use crate::contact::straight_path::steepest;
use crate::contact::surface::patch::Patch;
use crate::contact::surface::{HipView, Side, SurfacePoint};
use crate::contact::tolerance::{BESIDE, RESOLUTION};
use crate::grid::GridPoint;
use crate::scalar::root;

/// Tolerance for the end of a walk: the pull is less than the friction limit by at most this
/// fraction.
const END_TOLERANCE: f32 = 5e-4;

/// The vector from a proxy to the HIP, in two parts at right angles to each other.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) struct Pull {
    /// Component along the surface, cells: zero if every direction leads away from the HIP.
    pub(in crate::contact) along: Vec3,
    /// Squared length of `along`, cells².
    pub(in crate::contact) pull_sq: f32,
    /// Squared length of the rest, cells².
    pub(in crate::contact) press_sq: f32,
    /// True if the HIP is above the tangent plane: nothing presses then.
    pub(in crate::contact) is_above: bool,
    /// Rounding error of the pull, cells.
    rounding: f32,
}

impl Pull {
    /// No pull and no pressure.
    pub(in crate::contact) const NONE: Self = Self {
        along: Vec3::ZERO,
        pull_sq: 0.0,
        press_sq: 0.0,
        is_above: false,
        rounding: 0.0,
    };

    /// Returns the pull at a point of one patch, in the directions that do not lead over these
    /// borders.
    #[inline(never)]
    pub(in crate::contact) fn in_patch(
        patch: &Patch,
        view: &HipView,
        at: &SurfacePoint,
        border: Side,
    ) -> Self {
        let (p, q) = view.in_patch(at.cell);
        let displacement = Vec3::new(p - at.u, q - at.v, -patch.height(at.u, at.v));
        let (su, sv) = (patch.slope_u(at.v), patch.slope_v(at.u));
        let along = steepest(su, sv, border, displacement);
        Self {
            along,
            pull_sq: along.length_squared(),
            press_sq: (displacement - along).length_squared(),
            is_above: su * displacement.x + sv * displacement.y - displacement.z < 0.0,
            // Rounding of the coordinates, and of the height that their last place is worth; on a
            // border a coordinate is exact.
            rounding: RESOLUTION
                * (1.0
                    + displacement.x.abs()
                    + displacement.y.abs()
                    + height_error(su, border.east)
                    + height_error(sv, border.north)),
        }
    }
}

/// Returns the error of a height per cell of error of the place, on this side of a patch.
fn height_error(slope: f32, side: i32) -> f32 {
    if side == 0 { slope.abs() } else { 0.0 }
}

/// The limit of friction.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) struct Cone {
    /// Coulomb's coefficient.
    pub(in crate::contact) mu: f32,
    /// The viscous part, as the number of ticks of motion by which the proxy trails.
    pub(in crate::contact) drag: f32,
    /// Position of the proxy at the start of the tick; the chord from there is its motion.
    pub(in crate::contact) from: GridPoint,
}

impl Cone {
    /// Returns the pull and the friction limit, cells, at a point of a patch with heights relative
    /// to the HIP.
    pub(in crate::contact) fn excess(
        &self,
        pull: &Pull,
        view: &HipView,
        patch: &Patch,
        at: &SurfacePoint,
    ) -> Excess {
        let mut limit = self.mu * root(pull.press_sq) + pull.rounding;
        if self.drag > 0.0 {
            let (u, v) = offset_from(&self.from, at);
            let chord = Vec3::new(u, v, view.above(&self.from) + patch.height(at.u, at.v));
            limit += self.drag * root(chord.length_squared());
        }
        let length = root(pull.pull_sq);
        Excess {
            over: length - limit * (1.0 - 0.5 * END_TOLERANCE),
            pull: length,
            limit,
        }
    }
}

/// A pull and the friction limit, cells.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) struct Excess {
    /// The pull minus the walk's target, which is slightly less than the friction limit.
    pub(in crate::contact) over: f32,
    /// The pull.
    pub(in crate::contact) pull: f32,
    /// The friction limit.
    limit: f32,
}

impl Excess {
    /// Returns true if a walk ends here: friction holds, with hardly any reserve.
    pub(in crate::contact) fn is_small(&self) -> bool {
        self.over.abs() <= 0.5 * END_TOLERANCE * self.limit
    }

    /// Returns true if friction holds the pull.
    pub(in crate::contact) fn is_within_limit(&self) -> bool {
        self.pull <= self.limit
    }

    /// Returns true if the pull is more than a walk may end with.
    pub(in crate::contact) fn is_pulled(&self) -> bool {
        self.over > 0.0
    }

    /// Returns the share of the pull that friction holds.
    pub(in crate::contact) fn friction_share(&self) -> f32 {
        if self.limit < self.pull {
            self.limit / self.pull
        } else {
            1.0
        }
    }
}

/// Returns the vector from a place to a point of the surface, eastward and northward, cells.
fn offset_from(from: &GridPoint, to: &SurfacePoint) -> (f32, f32) {
    let from = from.relative_to([to.cell.x, to.cell.y, 0]);
    (to.u - from.x, to.v - from.y)
}

/// Returns the border that a point lies on, within rounding: where a path from the air meets the
/// surface in a concave edge, the last bits of the place differ.
pub(in crate::contact) fn border(point: &SurfacePoint) -> Side {
    point.border_within([BESIDE * RESOLUTION; 2])
}
