//! How the HIP pulls a proxy along the surface, and how hard it presses.
//!
//! With `D` the way from the proxy to the HIP, the pull is the part of `D` along the
//! steepest direction in which the proxy could go, over all patches that meet at it;
//! what is left of `D` presses. On an edge or a vertex a patch offers only the directions
//! that lead into it.

use glam::Vec3;

use crate::contact::closest_point::passes_over;
use crate::contact::surface::patch::Patch;
use crate::contact::surface::{HipView, Side, SurfacePoint};
use crate::contact::tolerance::{BESIDE, RESOLUTION};
use crate::scalar::root;
use crate::terrain::{Ground, TileIndex, Window};

/// The way from a proxy to the HIP, in two parts at right angles to each other.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) struct Pull {
    /// Along the surface, cells: zero where every direction leads away from the HIP.
    along: Vec3,
    /// Its length squared, cells².
    pulls: f32,
    /// The rest, cells.
    rest: Vec3,
    /// Its length squared, cells².
    presses: f32,
    /// How much the patch's slopes change over a cell of it.
    twist: f32,
}

/// How a proxy has come in a tick.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) struct Came {
    /// Straight from where it stood, cells.
    pub way: Vec3,
    /// How long that is, cells.
    pub length: f32,
}

/// What is known of the pull at a point of the surface.
pub(in crate::contact) enum Pulled {
    /// The pull.
    By(Pull),
    /// The straight way to the HIP leads off the surface, or there is none.
    Off,
    /// A patch that meets there is in a tile that is not here.
    Unknown(TileIndex),
}

impl Pull {
    /// The pull at a point of the surface. At the border of the data nothing presses a
    /// proxy whose HIP is above the surface's last patches.
    pub(in crate::contact) fn at<const D: usize>(
        window: &Window<'_, D>,
        view: &HipView,
        point: &SurfacePoint,
    ) -> Pulled {
        let patch = match window.ground(point.cell) {
            Ground::Patch(corners) => view.patch(&corners),
            Ground::Hole => return Pulled::Off,
            Ground::Missing => return Pulled::Unknown(TileIndex::holding(point.cell)),
        };
        let border = border(point);
        let pull = Self::in_patch(&patch, view, point, border);
        let is_above = passes_over_at(&patch, view, point);
        if border != Side::NONE {
            return Self::on_border(window, view, point, border, pull, is_above);
        }
        if is_above {
            Pulled::Off
        } else {
            Pulled::By(pull)
        }
    }

    /// The same on the border of a patch, in which it is `pull`. The way to the HIP leads off
    /// the surface if it is above the patch that it leads into.
    #[inline(never)]
    fn on_border<const D: usize>(
        window: &Window<'_, D>,
        view: &HipView,
        point: &SurfacePoint,
        border: Side,
        pull: Self,
        is_above: bool,
    ) -> Pulled {
        let into = border.toward(view.in_patch(point.cell), (point.u, point.v));
        let mut steepest = pull;
        let (mut leads_off, mut all_above) = (is_above && into == Side::NONE, is_above);
        let mut has_hole = false;
        for place in 0..3 {
            let side = border.neighbour(place);
            if side == Side::NONE {
                continue;
            }
            let there = point.across(side);
            match window.ground(there.cell) {
                Ground::Patch(corners) => {
                    let patch = view.patch(&corners);
                    let is_above = passes_over_at(&patch, view, &there);
                    leads_off |= is_above && side == into;
                    all_above &= is_above;
                    let pull = Self::in_patch(&patch, view, &there, border.across(side));
                    if pull.pulls > steepest.pulls {
                        steepest = pull;
                    }
                }
                Ground::Missing => return Pulled::Unknown(TileIndex::holding(there.cell)),
                Ground::Hole => has_hole = true,
            }
        }
        if leads_off || (has_hole && all_above) {
            return Pulled::Off;
        }
        Pulled::By(steepest)
    }

    #[inline(never)]
    fn in_patch(patch: &Patch, view: &HipView, at: &SurfacePoint, border: Side) -> Self {
        let (p, q) = view.in_patch(at.cell);
        let way = Vec3::new(p - at.u, q - at.v, -patch.height(at.u, at.v));
        let along = steepest(patch.slope_u(at.v), patch.slope_v(at.u), border, way);
        let rest = way - along;
        Self {
            along,
            pulls: along.length_squared(),
            rest,
            presses: rest.length_squared(),
            twist: patch.a,
        }
    }

    /// Along the surface, cells.
    pub(in crate::contact) const fn along(&self) -> Vec3 {
        self.along
    }

    /// Whether friction of this coefficient holds the proxy.
    pub(in crate::contact) fn is_within(&self, mu: f32) -> bool {
        self.pulls < mu * mu * self.presses
    }

    /// How far it pulls along the surface, and how far dry friction of this coefficient holds, cells.
    pub(in crate::contact) fn along_and_held_by(&self, mu: f32) -> (f32, f32) {
        (root(self.pulls), mu * root(self.presses))
    }

    /// By how much of the pull a proxy that slides is held back, by dynamic friction and by
    /// a viscous part of `drag` ticks: from 0 to the whole.
    pub(in crate::contact) fn held_back(&self, mu: f32, drag: f32) -> Vec3 {
        let coulomb = mu * root(self.presses / self.pulls);
        if coulomb < 1.0 {
            self.along * ((coulomb + drag) / (1.0 + drag))
        } else {
            self.along
        }
    }

    /// The rest of the way of a proxy that `came` so in the tick, from a point inside of a patch, as
    /// if that were its tangent plane: to where it is pulled by half of `slack` less than friction
    /// holds. A way back where it has come too far. `None` where it is longer than the pull, or the
    /// patch turns so much over it that friction may not hold the proxy at its end (with
    /// coefficients above 2 the pull there may be more than what holds it, by 0.2 % at most). Of
    /// the pull and of what dry friction holds as [`Self::along_and_held_by`] has them.
    pub(in crate::contact) fn rest_of_way(
        &self,
        came: Came,
        (pulls, dry): (f32, f32),
        (mu, drag): (f32, f32),
        slack: f32,
    ) -> Option<Vec3> {
        let less = 1.0 - 0.5 * slack;
        let (dry, drag) = (less * dry, less * drag);
        // As far as it would go if it went on straight.
        let straight = (pulls - dry - drag * came.length) / (1.0 + drag);
        let mut held = dry;
        if drag > 0.0 {
            let way = came.way + self.along * (straight / pulls);
            held += drag * root(way.length_squared());
        }
        let length = pulls - held;
        let is_short = length.abs() <= pulls;
        // What the viscous part may be off by, and what is left for the patch: a normal that turns by
        // an angle changes what pulls and what presses by that times the way to the HIP.
        let left = 0.5 * slack * held - drag * (length - straight).abs();
        let turns = (1.0 + mu) * self.twist * length;
        let changes = turns * turns * (self.pulls + self.presses);
        let is_left = left > 0.0 && changes <= left * left;
        // The HIP must not come to lie above the surface.
        (is_short && is_left && changes < self.presses).then(|| self.along * (length / pulls))
    }

    /// The same for a proxy that has come `way` cells, if all of its way were in the tangent plane here:
    /// from the foot of the HIP in that plane back to where it came from, as far as friction
    /// holds it. For a point inside of a patch.
    pub(in crate::contact) fn held_back_on_plane(&self, way: Vec3, mu: f32, drag: f32) -> Vec3 {
        let whole = way + self.along;
        let whole = whole - self.rest * (whole.dot(self.rest) / self.presses);
        let length = root(whole.length_squared());
        let held = (mu * root(self.presses) + drag * length) / (1.0 + drag);
        match held < length {
            true => whole * (held / length),
            // Also where one of them is no number.
            false => whole,
        }
    }
}

/// The border that a point lies on, or as near to as rounding may have put a point of it: where
/// a way from the air meets the surface in a crease, the last bits of the place differ.
pub(in crate::contact) fn border(point: &SurfacePoint) -> Side {
    point.border_within([BESIDE * RESOLUTION; 2])
}

/// Whether the HIP is above the tangent plane of a patch at a point of it.
fn passes_over_at(patch: &Patch, view: &HipView, at: &SurfacePoint) -> bool {
    let (p, q) = view.in_patch(at.cell);
    passes_over(patch, at, (p - at.u, q - at.v))
}

/// The part of a way along the tangent plane of these slopes, or, of a point on a border,
/// along that direction into the patch which has most of it.
fn steepest(su: f32, sv: f32, border: Side, way: Vec3) -> Vec3 {
    // The projection onto the plane; multiplied out, so that a wall costs no bits.
    let (across, norm) = (su * sv, 1.0 + su * su + sv * sv);
    let free = Vec3::new(
        ((1.0 + sv * sv) * way.x - across * way.y + su * way.z) / norm,
        ((1.0 + su * su) * way.y - across * way.x + sv * way.z) / norm,
        ((su * su + sv * sv) * way.z + su * way.x + sv * way.y) / norm,
    );
    if leads_in(free, border) {
        return free;
    }
    let mut best = Vec3::ZERO;
    if border.north != 0 {
        let east = (way.x + su * way.z) / (1.0 + su * su);
        best = longer(best, Vec3::new(east, 0.0, su * east), border);
    }
    if border.east != 0 {
        let north = (way.y + sv * way.z) / (1.0 + sv * sv);
        best = longer(best, Vec3::new(0.0, north, sv * north), border);
    }
    best
}

/// Whether a direction leads into the patch of a point on this border.
fn leads_in(way: Vec3, border: Side) -> bool {
    way.x * border.east as f32 <= 0.0 && way.y * border.north as f32 <= 0.0
}

fn longer(best: Vec3, other: Vec3, border: Side) -> Vec3 {
    if leads_in(other, border) && other.length_squared() > best.length_squared() {
        other
    } else {
        best
    }
}
