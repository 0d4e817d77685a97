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
use crate::contact::budget::{Budget, DIRECTION, LOOK, SLOPE};
use crate::contact::closest_point::Leave;
use crate::contact::straight_path::StraightWay;
use crate::contact::surface::patch::Patch;
use crate::contact::surface::{HipView, Side, SurfacePoint};
use crate::scalar::smaller;
use crate::terrain::{CellContent, Window};

/// Maximum number of evaluations of the cone on one straight path.
pub(in crate::contact) const LOOKS: u32 = 8;
/// Maximum number of straight paths for one HIP, some four for each cell of a window. It stops a
/// proxy that rounding sends back and forth across a border.
const WAYS: u32 = 1_024;
/// Straight paths along the pull within a patch before Newton's direction replaces it: in the bent
/// valley of a twisted patch the pull leads across rather than along.
const ACROSS: u32 = 3;

/// End of a walk.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) enum Walked {
    /// Friction holds the proxy, or no straight path brings it nearer.
    Rests,
    /// The same, beside a missing tile.
    Missing,
    /// The straight path to the HIP leads off the surface.
    Leaves,
    /// There is no surface, or it ends here with the HIP above it.
    Off,
    /// The budget is spent.
    Suspended,
}

/// State at a walk's place: the steepest pull, and its patch.
struct Asked {
    pull: Pull,
    at: SurfacePoint,
    patch: Patch,
    /// True if a tile beside it is missing.
    is_open: bool,
}

impl Asked {
    /// Creates the state of a place before any evaluation.
    fn nothing(at: SurfacePoint) -> Self {
        Self {
            pull: Pull::NONE,
            at,
            patch: Patch::new([0.0; 4]),
            is_open: false,
        }
    }

    const fn rests(&self) -> Walked {
        if self.is_open {
            Walked::Missing
        } else {
            Walked::Rests
        }
    }
}

/// Returns the outcome for a proxy from which the straight path to the HIP leads off the surface;
/// `None` after such a path has ended on the surface at once: the proxy is on the ground.
fn off(leave: &Leave, point: &SurfacePoint) -> Option<Walked> {
    match leave {
        leave if leave.is_allowed_at(point) => Some(Walked::Leaves),
        Leave::ButAt(_) => None,
        _ => Some(Walked::Off),
    }
}

/// A walk under way.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) struct Walk {
    /// Position of the proxy.
    pub(in crate::contact) point: SurfacePoint,
    /// Static coefficient of a proxy that has not moved yet.
    pub(in crate::contact) at_rest: Option<f32>,
    /// Number of straight paths for this HIP.
    pub(in crate::contact) ways: u32,
    /// Number of the last of these that ended inside one patch.
    pub(in crate::contact) inside: u32,
    /// Limit of friction at the end of the last straight path, cells.
    pub(in crate::contact) held: Vec3,
}

impl Walk {
    /// Continues to the place where friction holds.
    pub(in crate::contact) fn advance<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        cone: &Cone,
        leave: &Leave,
        budget: &mut Budget,
    ) -> Walked {
        let (mut here, mut is_known) = (Asked::nothing(self.point), false);
        loop {
            let ended = match is_known {
                true => here.goes_on(window, view, leave, budget),
                false => here.asks(window, view, leave, budget),
            };
            if let Some(ended) = ended {
                return ended;
            }
            if let Some(mu) = self.at_rest.take()
                && here.pull.pulls <= mu * mu * here.pull.presses
            {
                return here.rests();
            }
            let excess = cone.excess(&here.pull, view, &here.patch, &here.at);
            if excess.is_held() || self.ways == WAYS {
                return here.rests();
            }
            let newton = match self.inside > ACROSS && self.inside.is_multiple_of(2) {
                true => newton(&here, view),
                false => None,
            };
            let start = here.at;
            let Some(end) = straight(&mut here, excess, newton, view, cone, budget) else {
                return Walked::Suspended;
            };
            if here.at == start {
                return here.rests();
            }
            let is_inside = border(&here.at) == Side::NONE;
            self.inside = if is_inside { self.inside + 1 } else { 0 };
            self.ways += 1;
            (self.point, self.held) = (here.at, end.held);
            if is_inside && end.rests {
                return Walked::Rests;
            }
            is_known = end.is_known;
        }
    }
}

/// Returns Newton's direction to the minimum of the distance, if it leads downhill, inside a patch.
#[inline(never)]
fn newton(at: &Asked, view: &HipView) -> Option<(f32, f32)> {
    let Asked { at, patch, .. } = at;
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
struct End {
    /// Friction limit there, cells.
    held: Vec3,
    /// True if the cone holds there.
    rests: bool,
    /// True if the pull is the one of the patch there, and the HIP is not above.
    is_known: bool,
}

/// Follows one straight path, from a place with the given excess pull; returns `None` if the budget
/// is too small for all of it.
#[inline(never)]
fn straight(
    here: &mut Asked,
    excess: Excess,
    newton: Option<(f32, f32)>,
    view: &HipView,
    cone: &Cone,
    budget: &mut Budget,
) -> Option<End> {
    if !budget.has(DIRECTION) {
        return None;
    }
    budget.spend(DIRECTION);
    let (at, patch) = (here.at, &here.patch);
    let along = newton.unwrap_or((here.pull.along.x, here.pull.along.y));
    let way = StraightWay::new(patch, view.in_patch(at.cell), (at.u, at.v), along);
    // On a plane the foot of the HIP is at 1.
    let borders = way.to_borders();
    let to_border = smaller(borders.0, borders.1);
    let reach = smaller(to_border, 2.0);
    let least = way.first_minimum(reach);
    let end = least.unwrap_or(reach);
    let ends_on_border = least.is_none() && reach == to_border;
    let place = |t: f32| {
        let (u, v) = match ends_on_border && t >= end {
            true => way.on_border(borders),
            false => way.at(t),
        };
        at.moved_to(u, v)
    };
    let edge = runs_along(border(&at), along);
    let mut root = ConeRoot::new(excess, cone.drag);
    let mut held = Vec3::ZERO;
    for _ in 0..LOOKS {
        if !budget.has(LOOK) {
            return None;
        }
        budget.spend(LOOK);
        let t = smaller(root.next(), end);
        here.at = place(t);
        here.pull = Pull::in_patch(patch, view, &here.at, edge);
        let excess = cone.excess(&here.pull, view, patch, &here.at);
        held = here.pull.along * excess.held_share();
        let is_known = !here.pull.is_above;
        let rests = is_known && excess.is_small();
        let is_at_end = excess.is_pulled() && t >= end;
        if !is_known || is_at_end || rests {
            return Some(End {
                held,
                rests,
                is_known,
            });
        }
        root.look(t, &excess);
    }
    if let Some(t) = root.so_far() {
        here.at = place(t);
    }
    Some(End {
        held,
        rests: false,
        is_known: false,
    })
}

/// Returns the border that a path runs along, and therefore cannot cross.
fn runs_along(border: Side, way: (f32, f32)) -> Side {
    Side {
        east: if way.0 == 0.0 { border.east } else { 0 },
        north: if way.1 == 0.0 { border.north } else { 0 },
    }
}

impl Asked {
    /// Does the same as [`Self::asks`], at the end of a straight path, where patch and pull are
    /// known: if the pull leads over one edge, only the patch beyond is evaluated. Along the edge
    /// it offers the same directions.
    fn goes_on<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        leave: &Leave,
        budget: &mut Budget,
    ) -> Option<Walked> {
        let side = border(&self.at);
        if side == Side::NONE {
            return None;
        }
        let along = self.pull.along;
        let leads_over = along.x * side.east as f32 + along.y * side.north as f32 > 0.0;
        let beyond = self.at.across(side);
        if (side.east == 0 || side.north == 0)
            && leads_over
            && budget.has(SLOPE)
            && let CellContent::Patch(corners) = window.ground(beyond.cell)
        {
            budget.spend(SLOPE);
            let point = self.at;
            let into = side.toward(view.in_patch(point.cell), (point.u, point.v));
            (self.at, self.patch) = (beyond, view.patch(&corners));
            self.pull = Pull::in_patch(&self.patch, view, &self.at, side.across(side));
            return match self.pull.is_above && into == side {
                true => off(leave, &point),
                false => None,
            };
        }
        self.asks(window, view, leave, budget)
    }

    /// Finds the steepest pull over the patches that meet at the point; returns the walk's end, if
    /// it ends there.
    #[inline(never)]
    fn asks<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        leave: &Leave,
        budget: &mut Budget,
    ) -> Option<Walked> {
        if !budget.has(4 * SLOPE) {
            return Some(Walked::Suspended);
        }
        budget.spend(SLOPE);
        self.is_open = false;
        self.patch = match window.ground(self.at.cell) {
            CellContent::Patch(corners) => view.patch(&corners),
            CellContent::NoData => return Some(Walked::Off),
            CellContent::Missing => {
                budget.lacks(self.at.cell);
                return Some(Walked::Off);
            }
        };
        let border = border(&self.at);
        self.pull = Pull::in_patch(&self.patch, view, &self.at, border);
        match border {
            Side::NONE if self.pull.is_above => {
                // Nothing presses a proxy that must not leave here.
                self.pull.presses = 0.0;
                off(leave, &self.at)
            }
            Side::NONE => None,
            _ => self.asks_neighbours(window, view, border, leave, budget),
        }
    }

    /// Evaluates the patches across a border as well. The path to the HIP leads off the surface if
    /// the HIP is above the patch that the path enters; beside no-data nothing presses a proxy
    /// whose HIP is above all patches.
    #[inline(never)]
    fn asks_neighbours<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        border: Side,
        leave: &Leave,
        budget: &mut Budget,
    ) -> Option<Walked> {
        let point = self.at;
        let into = border.toward(view.in_patch(point.cell), (point.u, point.v));
        let mut leads_off = self.pull.is_above && into == Side::NONE;
        let (mut all_above, mut has_no_data) = (self.pull.is_above, false);
        for place in 0..3 {
            let side = border.neighbour(place);
            if side == Side::NONE {
                continue;
            }
            budget.spend(SLOPE);
            let at = point.across(side);
            match window.ground(at.cell) {
                CellContent::Patch(corners) => {
                    let patch = view.patch(&corners);
                    let pull = Pull::in_patch(&patch, view, &at, border.across(side));
                    leads_off |= pull.is_above && side == into;
                    all_above &= pull.is_above;
                    if pull.pulls > self.pull.pulls {
                        (self.pull, self.at, self.patch) = (pull, at, patch);
                    }
                }
                CellContent::Missing => {
                    budget.lacks(at.cell);
                    self.is_open = true;
                }
                CellContent::NoData => has_no_data = true,
            }
        }
        has_no_data |= self.is_open;
        if leads_off && let Some(walked) = off(leave, &point) {
            return Some(walked);
        }
        (has_no_data && all_above).then_some(Walked::Off)
    }
}
