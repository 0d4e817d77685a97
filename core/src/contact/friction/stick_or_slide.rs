//! Friction as a walk: the proxy follows the pull and stops where the cone holds (Moreau's
//! catching-up).
//!
//! From the proxy's place the walk follows the pull straight through one patch, to the first of:
//! the cone holds; the border; the minimum of the distance to the HIP. There the pull is computed
//! again. Every straight path ends nearer to the HIP than it began and crosses no crest. So the
//! proxy never gets farther from the HIP, and the only state of a suspended walk is a point of the
//! surface.

use glam::Vec3;

use super::cone::{Cone, Excess, Pull, border};
use super::cone_root::ConeRoot;
use crate::contact::budget::{Budget, CONE_EVALUATION, DIRECTION, SLOPE};
use crate::contact::closest_point::DepartureRule;
use crate::contact::straight_path::StraightPath;
use crate::contact::surface::patch::Patch;
use crate::contact::surface::{HipView, Side, SurfacePoint};
use crate::scalar::smaller;
use crate::terrain::{CellContent, Window};

/// Maximum number of evaluations of the cone on one straight path.
pub(in crate::contact) const MAX_CONE_EVALUATIONS: u32 = 8;
/// Maximum number of straight paths for one HIP, some four for each cell of a window. It stops a
/// proxy that rounding sends back and forth across a border.
const MAX_STRAIGHT_PATHS: u32 = 1_024;
/// Straight paths along the pull within a patch before Newton's direction replaces it: in the bent
/// valley of a twisted patch the pull leads across rather than along.
const MAX_PULL_PATHS: u32 = 3;

/// End of a walk.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) enum WalkEnd {
    /// Friction holds the proxy, or no straight path brings it nearer.
    AtRest,
    /// The same, beside a missing tile.
    MissingTile,
    /// The straight path to the HIP leads off the surface.
    Departure,
    /// There is no surface, or it ends here with the HIP above it.
    NoSurface,
    /// The budget is spent.
    Suspended,
}

/// State at a walk's place: the steepest pull, and its patch.
struct PullState {
    pull: Pull,
    at: SurfacePoint,
    patch: Patch,
    /// True if a tile beside it is missing.
    is_tile_missing: bool,
}

impl PullState {
    /// Creates the state of a place before any evaluation.
    fn new(at: SurfacePoint) -> Self {
        Self {
            pull: Pull::NONE,
            at,
            patch: Patch::new([0.0; 4]),
            is_tile_missing: false,
        }
    }

    const fn end_at_rest(&self) -> WalkEnd {
        if self.is_tile_missing {
            WalkEnd::MissingTile
        } else {
            WalkEnd::AtRest
        }
    }
}

/// Returns the outcome for a proxy from which the straight path to the HIP leads off the surface;
/// `None` after such a path has ended on the surface at once: the proxy is on the ground.
fn departure_end(departure_rule: &DepartureRule, point: &SurfacePoint) -> Option<WalkEnd> {
    match departure_rule {
        departure_rule if departure_rule.is_allowed_at(point) => Some(WalkEnd::Departure),
        DepartureRule::ExceptAt(_) => None,
        _ => Some(WalkEnd::NoSurface),
    }
}

/// A walk in progress.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) struct Walk {
    /// Position of the proxy.
    pub(in crate::contact) point: SurfacePoint,
    /// Static coefficient of a proxy that has not moved yet.
    pub(in crate::contact) at_rest: Option<f32>,
    /// Number of straight paths for this HIP.
    pub(in crate::contact) paths: u32,
    /// Number of the last of these that ended inside one patch.
    pub(in crate::contact) paths_inside: u32,
    /// Limit of friction at the end of the last straight path, cells.
    pub(in crate::contact) friction_displacement: Vec3,
}

impl Walk {
    /// Continues to the place where friction holds.
    pub(in crate::contact) fn advance<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        cone: &Cone,
        departure_rule: &DepartureRule,
        budget: &mut Budget,
    ) -> WalkEnd {
        let (mut here, mut is_pull_known) = (PullState::new(self.point), false);
        loop {
            let end = match is_pull_known {
                true => here.update(window, view, departure_rule, budget),
                false => here.evaluate(window, view, departure_rule, budget),
            };
            if let Some(end) = end {
                return end;
            }
            if let Some(mu) = self.at_rest.take()
                && here.pull.pull_sq <= mu * mu * here.pull.press_sq
            {
                return here.end_at_rest();
            }
            let excess = cone.excess(&here.pull, view, &here.patch, &here.at);
            if excess.is_within_limit() || self.paths == MAX_STRAIGHT_PATHS {
                return here.end_at_rest();
            }
            let newton =
                match self.paths_inside > MAX_PULL_PATHS && self.paths_inside.is_multiple_of(2) {
                    true => newton_direction(&here, view),
                    false => None,
                };
            let start = here.at;
            let Some(end) = follow_straight_path(&mut here, excess, newton, view, cone, budget)
            else {
                return WalkEnd::Suspended;
            };
            if here.at == start {
                return here.end_at_rest();
            }
            let is_inside = border(&here.at) == Side::NONE;
            self.paths_inside = if is_inside { self.paths_inside + 1 } else { 0 };
            self.paths += 1;
            (self.point, self.friction_displacement) = (here.at, end.friction_displacement);
            if is_inside && end.is_at_rest {
                return WalkEnd::AtRest;
            }
            is_pull_known = end.is_pull_known;
        }
    }
}

/// Returns Newton's direction to the minimum of the distance, if it leads downhill, inside a patch.
#[inline(never)]
fn newton_direction(at: &PullState, view: &HipView) -> Option<(f32, f32)> {
    let PullState { at, patch, .. } = at;
    if border(at) != Side::NONE {
        return None;
    }
    let (p, q) = view.in_patch(at.cell);
    let (zu, zv) = (patch.slope_u(at.v), patch.slope_v(at.u));
    let z = patch.height(at.u, at.v);
    let (gu, gv) = (at.u - p + z * zu, at.v - q + z * zv);
    let twist = patch.a * z;
    let (uu, vv, uv) = (1.0 + zu * zu, 1.0 + zv * zv, zu * zv + twist);
    let det = 1.0 + zu * zu + zv * zv - twist * (twist + 2.0 * zu * zv);
    let (du, dv) = ((uv * gv - vv * gu) / det, (uv * gu - uu * gv) / det);
    (det > 0.0 && du * gu + dv * gv < 0.0).then_some((du, dv))
}

/// The end of one straight path.
struct PathEnd {
    /// Friction limit there, cells.
    friction_displacement: Vec3,
    /// True if the cone holds there.
    is_at_rest: bool,
    /// True if the pull is the one of the patch there, and the HIP is not above.
    is_pull_known: bool,
}

/// Follows one straight path, from a place with the given excess pull; returns `None` if the budget
/// is too small for all of it.
#[inline(never)]
fn follow_straight_path(
    here: &mut PullState,
    excess: Excess,
    newton: Option<(f32, f32)>,
    view: &HipView,
    cone: &Cone,
    budget: &mut Budget,
) -> Option<PathEnd> {
    if !budget.has(DIRECTION) {
        return None;
    }
    budget.spend(DIRECTION);
    let (at, patch) = (here.at, &here.patch);
    let along = newton.unwrap_or((here.pull.along.x, here.pull.along.y));
    let path = StraightPath::new(patch, view.in_patch(at.cell), (at.u, at.v), along);
    // On a plane the foot of the HIP is at 1.
    let borders = path.to_borders();
    let to_border = smaller(borders.0, borders.1);
    let reach = smaller(to_border, 2.0);
    let minimum = path.first_minimum(reach);
    let end = minimum.unwrap_or(reach);
    let ends_on_border = minimum.is_none() && reach == to_border;
    let place = |t: f32| {
        let (u, v) = match ends_on_border && t >= end {
            true => path.on_border(borders),
            false => path.at(t),
        };
        at.moved_to(u, v)
    };
    let edge = border_along(border(&at), along);
    let mut root = ConeRoot::new(excess, cone.drag);
    let mut friction_displacement = Vec3::ZERO;
    for _ in 0..MAX_CONE_EVALUATIONS {
        if !budget.has(CONE_EVALUATION) {
            return None;
        }
        budget.spend(CONE_EVALUATION);
        let t = smaller(root.next(), end);
        here.at = place(t);
        here.pull = Pull::in_patch(patch, view, &here.at, edge);
        let excess = cone.excess(&here.pull, view, patch, &here.at);
        friction_displacement = here.pull.along * excess.friction_share();
        let is_pull_known = !here.pull.is_above;
        let is_at_rest = is_pull_known && excess.is_small();
        let is_at_end = excess.is_pulled() && t >= end;
        if !is_pull_known || is_at_end || is_at_rest {
            return Some(PathEnd {
                friction_displacement,
                is_at_rest,
                is_pull_known,
            });
        }
        root.update(t, &excess);
    }
    if let Some(t) = root.path_end() {
        here.at = place(t);
    }
    Some(PathEnd {
        friction_displacement,
        is_at_rest: false,
        is_pull_known: false,
    })
}

/// Returns the border that a path runs along, and therefore cannot cross.
fn border_along(border: Side, direction: (f32, f32)) -> Side {
    Side {
        east: if direction.0 == 0.0 { border.east } else { 0 },
        north: if direction.1 == 0.0 { border.north } else { 0 },
    }
}

impl PullState {
    /// Does the same as [`Self::evaluate`], at the end of a straight path, where patch and pull are
    /// computed: if the pull leads over one edge, only the patch beyond is evaluated. Along the
    /// edge it offers the same directions.
    fn update<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        departure_rule: &DepartureRule,
        budget: &mut Budget,
    ) -> Option<WalkEnd> {
        let side = border(&self.at);
        if side == Side::NONE {
            return None;
        }
        let along = self.pull.along;
        let crosses_edge = along.x * side.east as f32 + along.y * side.north as f32 > 0.0;
        let beyond = self.at.across(side);
        if (side.east == 0 || side.north == 0)
            && crosses_edge
            && budget.has(SLOPE)
            && let CellContent::Patch(corners) = window.ground(beyond.cell)
        {
            budget.spend(SLOPE);
            let point = self.at;
            let into = side.toward(view.in_patch(point.cell), (point.u, point.v));
            (self.at, self.patch) = (beyond, view.patch(&corners));
            self.pull = Pull::in_patch(&self.patch, view, &self.at, side.across(side));
            return match self.pull.is_above && into == side {
                true => departure_end(departure_rule, &point),
                false => None,
            };
        }
        self.evaluate(window, view, departure_rule, budget)
    }

    /// Finds the steepest pull over the patches that meet at the point; returns the walk's end, if
    /// it ends there.
    #[inline(never)]
    fn evaluate<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        departure_rule: &DepartureRule,
        budget: &mut Budget,
    ) -> Option<WalkEnd> {
        if !budget.has(4 * SLOPE) {
            return Some(WalkEnd::Suspended);
        }
        budget.spend(SLOPE);
        self.is_tile_missing = false;
        self.patch = match window.ground(self.at.cell) {
            CellContent::Patch(corners) => view.patch(&corners),
            CellContent::NoData => return Some(WalkEnd::NoSurface),
            CellContent::Missing => {
                budget.record_missing(self.at.cell);
                return Some(WalkEnd::NoSurface);
            }
        };
        let border = border(&self.at);
        self.pull = Pull::in_patch(&self.patch, view, &self.at, border);
        match border {
            Side::NONE if self.pull.is_above => {
                // No pressure acts on a proxy that must not leave here.
                self.pull.press_sq = 0.0;
                departure_end(departure_rule, &self.at)
            }
            Side::NONE => None,
            _ => self.evaluate_neighbours(window, view, border, departure_rule, budget),
        }
    }

    /// Evaluates the patches across a border as well. The path to the HIP leads off the surface if
    /// the HIP is above the patch that the path enters; beside no-data nothing presses a proxy
    /// whose HIP is above all patches.
    #[inline(never)]
    fn evaluate_neighbours<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        border: Side,
        departure_rule: &DepartureRule,
        budget: &mut Budget,
    ) -> Option<WalkEnd> {
        let point = self.at;
        let into = border.toward(view.in_patch(point.cell), (point.u, point.v));
        let mut leaves_surface = self.pull.is_above && into == Side::NONE;
        let (mut all_above, mut has_no_data) = (self.pull.is_above, false);
        for index in 0..3 {
            let side = border.neighbour(index);
            if side == Side::NONE {
                continue;
            }
            budget.spend(SLOPE);
            let at = point.across(side);
            match window.ground(at.cell) {
                CellContent::Patch(corners) => {
                    let patch = view.patch(&corners);
                    let pull = Pull::in_patch(&patch, view, &at, border.across(side));
                    leaves_surface |= pull.is_above && side == into;
                    all_above &= pull.is_above;
                    if pull.pull_sq > self.pull.pull_sq {
                        (self.pull, self.at, self.patch) = (pull, at, patch);
                    }
                }
                CellContent::Missing => {
                    budget.record_missing(at.cell);
                    self.is_tile_missing = true;
                }
                CellContent::NoData => has_no_data = true,
            }
        }
        has_no_data |= self.is_tile_missing;
        if leaves_surface && let Some(end) = departure_end(departure_rule, &point) {
            return Some(end);
        }
        (has_no_data && all_above).then_some(WalkEnd::NoSurface)
    }
}
