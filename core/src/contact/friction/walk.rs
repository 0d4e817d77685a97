//! Friction as a walk: the proxy follows the pull and stops where the cone holds (Moreau's
//! catching-up).
//!
//! From where the proxy is the walk goes straight along the pull through one patch, to the first
//! of: the cone holds; the border; no nearer to the HIP. There it asks again. Every straight way
//! ends nearer to the HIP than it began and crosses no crest, so the proxy is never farther from
//! the HIP than it was, and a walk that is cut short is a point of the surface and nothing else.

use glam::Vec3;

use super::cone::{Cone, Excess, Pull, border};
use super::cone_root::ConeRoot;
use crate::contact::budget::{Budget, DIRECTION, LOOK, SLOPE, WAY};
use crate::contact::closest_point::Leave;
use crate::contact::straight_way::StraightWay;
use crate::contact::surface::patch::Patch;
use crate::contact::surface::{HipView, Side, SurfacePoint};
use crate::scalar::smaller;
use crate::terrain::{Ground, Window};

/// Looks at the cone on one straight way, at most.
pub(in crate::contact) const LOOKS: u32 = 8;
/// Straight ways at most for one HIP, some four for each cell of a window. Where rounding sends a
/// proxy to and fro across a border it rests then.
const WAYS: u32 = 1_024;
/// Straight ways along the pull within a patch after which Newton's direction takes its place: in
/// the bent valley of a twisted patch the pull leads across rather than along.
const ACROSS: u32 = 3;

/// How a walk ended.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) enum Walked {
    /// Friction holds the proxy, or no straight way brings it nearer.
    Rests,
    /// The same, beside a tile that is not here.
    Missing,
    /// The straight path to the HIP leads off the surface.
    Leaves,
    /// There is no surface, or it ends here with the HIP above it.
    Off,
    /// The budget is spent.
    Suspended,
}

/// What is known at a point: the steepest pull, and the patch that offers it.
struct Asked {
    pull: Pull,
    at: SurfacePoint,
    patch: Patch,
    /// Whether a tile beside it is missing.
    is_open: bool,
}

impl Asked {
    const fn rests(&self) -> Walked {
        if self.is_open {
            Walked::Missing
        } else {
            Walked::Rests
        }
    }
}

/// What becomes of a proxy from which the straight path to the HIP leads off the surface.
/// Where it has just come down from such a path, it is on the ground.
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
    /// Where it is.
    pub(in crate::contact) point: SurfacePoint,
    /// The coefficient of a proxy that has not moved yet.
    pub(in crate::contact) at_rest: Option<f32>,
    /// Straight ways for this HIP.
    pub(in crate::contact) ways: u32,
    /// Of these, the last ones that ended inside of one patch.
    pub(in crate::contact) inside: u32,
    /// What friction held where the last straight way ended, cells.
    pub(in crate::contact) held: Vec3,
}

impl Walk {
    /// Goes on to where friction holds.
    pub(in crate::contact) fn advance<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        cone: &Cone,
        leave: &Leave,
        budget: &mut Budget,
    ) -> Walked {
        loop {
            if !budget.has(WAY) {
                return Walked::Suspended;
            }
            let asked = match ask(window, view, &self.point, leave, budget) {
                Ok(asked) => asked,
                Err(why) => return why,
            };
            if let Some(mu) = self.at_rest.take()
                && asked.pull.pulls <= mu * mu * asked.pull.presses
            {
                return asked.rests();
            }
            let excess = cone.excess(&asked.pull, view, &asked.patch, &asked.at);
            if excess.is_held() || self.ways == WAYS {
                return asked.rests();
            }
            let newton = match self.inside > ACROSS && self.inside % 2 == 0 {
                true => newton(&asked, view),
                false => None,
            };
            let Some(end) = straight(&asked, excess, newton, view, cone, budget) else {
                return Walked::Suspended;
            };
            if end.at == asked.at || end.at == self.point {
                return asked.rests();
            }
            let is_inside = border(&end.at) == Side::NONE;
            self.inside = if is_inside { self.inside + 1 } else { 0 };
            self.ways += 1;
            (self.point, self.held) = (end.at, end.held);
            if is_inside && end.rests {
                return Walked::Rests;
            }
        }
    }
}

/// Newton's direction to the minimum of the distance, if that is downhill, inside of a patch.
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

/// The end of one straight way.
struct End {
    at: SurfacePoint,
    /// What friction holds there, cells.
    held: Vec3,
    /// Whether the cone holds there.
    rests: bool,
}

/// Goes one straight way, from where the pull is in excess by so much; `None` where the budget does
/// not reach for all of it.
#[inline(never)]
fn straight(
    start: &Asked,
    excess: Excess,
    newton: Option<(f32, f32)>,
    view: &HipView,
    cone: &Cone,
    budget: &mut Budget,
) -> Option<End> {
    let Asked {
        pull, at, patch, ..
    } = start;
    let along = newton.unwrap_or((pull.along.x, pull.along.y));
    let way = StraightWay::new(patch, view.in_patch(at.cell), (at.u, at.v), along);
    // On a plane the foot of the HIP is at 1.
    let to_border = way.to_border();
    let reach = smaller(to_border, 2.0);
    let least = way.first_minimum(reach);
    let end = least.unwrap_or(reach);
    let ends_on_border = least.is_none() && reach == to_border;
    let place = |t: f32| {
        let (u, v) = match ends_on_border && t >= end {
            true => way.on_border(),
            false => way.at(t),
        };
        at.moved_to(u, v)
    };
    let edge = runs_along(border(at), along);
    let mut root = ConeRoot::new(excess, cone.drag);
    let mut to = End {
        at: *at,
        held: Vec3::ZERO,
        rests: false,
    };
    budget.spend(DIRECTION);
    for _ in 0..LOOKS {
        if !budget.has(LOOK) {
            return None;
        }
        budget.spend(LOOK);
        let t = smaller(root.next(), end);
        to.at = place(t);
        let pull = Pull::in_patch(patch, view, &to.at, edge);
        let excess = cone.excess(&pull, view, patch, &to.at);
        to.held = pull.along * excess.held_share();
        to.rests = !pull.is_above && excess.is_small();
        let is_at_end = excess.is_pulled() && t >= end;
        if pull.is_above || is_at_end || to.rests {
            return Some(to);
        }
        root.look(t, &excess);
    }
    if let Some(t) = root.so_far() {
        to.at = place(t);
    }
    Some(to)
}

/// The border that a way leads along, and over which it can lead nowhere.
fn runs_along(border: Side, way: (f32, f32)) -> Side {
    Side {
        east: if way.0 == 0.0 { border.east } else { 0 },
        north: if way.1 == 0.0 { border.north } else { 0 },
    }
}

/// The steepest pull over the patches that meet at a point.
fn ask<const D: usize>(
    window: &Window<'_, D>,
    view: &HipView,
    point: &SurfacePoint,
    leave: &Leave,
    budget: &mut Budget,
) -> Result<Asked, Walked> {
    budget.spend(SLOPE);
    let border = border(point);
    let patch = match window.ground(point.cell) {
        Ground::Patch(corners) => view.patch(&corners),
        Ground::Hole => return Err(Walked::Off),
        Ground::Missing => {
            budget.lacks(point.cell);
            return Err(Walked::Off);
        }
    };
    let mut asked = Asked {
        pull: Pull::in_patch(&patch, view, point, border),
        at: *point,
        patch,
        is_open: false,
    };
    let ended = match border {
        Side::NONE if asked.pull.is_above => {
            // Nothing presses a proxy that may not leave here.
            asked.pull.presses = 0.0;
            off(leave, point)
        }
        Side::NONE => None,
        _ => ask_neighbours(window, view, border, &mut asked, leave, budget),
    };
    ended.map_or(Ok(asked), Err)
}

/// Asks the patches across a border, too; how the walk ends, if it does. The path to the HIP leads
/// off the surface if the HIP is above the patch that the path leads into; at a hole nothing
/// presses a proxy whose HIP is above all patches.
#[inline(never)]
fn ask_neighbours<const D: usize>(
    window: &Window<'_, D>,
    view: &HipView,
    border: Side,
    best: &mut Asked,
    leave: &Leave,
    budget: &mut Budget,
) -> Option<Walked> {
    let point = best.at;
    let into = border.toward(view.in_patch(point.cell), (point.u, point.v));
    let mut leads_off = best.pull.is_above && into == Side::NONE;
    let (mut all_above, mut has_hole) = (best.pull.is_above, false);
    for place in 0..3 {
        let side = border.neighbour(place);
        if side == Side::NONE {
            continue;
        }
        budget.spend(SLOPE);
        let at = point.across(side);
        match window.ground(at.cell) {
            Ground::Patch(corners) => {
                let patch = view.patch(&corners);
                let pull = Pull::in_patch(&patch, view, &at, border.across(side));
                leads_off |= pull.is_above && side == into;
                all_above &= pull.is_above;
                if pull.pulls > best.pull.pulls {
                    (best.pull, best.at, best.patch) = (pull, at, patch);
                }
            }
            Ground::Missing => {
                budget.lacks(at.cell);
                best.is_open = true;
            }
            Ground::Hole => has_hole = true,
        }
    }
    has_hole |= best.is_open;
    if leads_off && let Some(walked) = off(leave, &point) {
        return Some(walked);
    }
    (has_hole && all_above).then_some(Walked::Off)
}
