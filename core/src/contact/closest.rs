//! The closest point of one patch to the hand (paper §4.3.2, eq. 8-11).
//!
//! The paper minimises the squared distance D(u, v) by Newton's method in two
//! variables. That Hessian is indefinite on twisted patches, and the iteration
//! leaves, cycles or rests on a saddle. Here one variable is eliminated
//! exactly. With v fixed, the patch is a straight line (a ruling) of slope
//! m = b + a·v, and its nearest point is known in closed form:
//!
//! ```text
//! g = z(p, 0)·(1 − v) + z(p, 1)·v      height of the ruling's line over the hand's u
//! z = g / (1 + m²)               height of its nearest point
//! u = p − m·z                    clamped to [0, 1]
//! ```
//!
//! What remains, F(v) = min over u of D(u, v), is continuously differentiable
//! because D is a parabola in u: a minimum of F is a minimum of D over the
//! square, edges and corners included, and no saddle of D is one. F′ is found
//! by Newton steps kept inside a shrinking bracket; every accepted point is no
//! farther from the hand than the one before, so the search runs downhill from
//! where it starts and cannot jump into a worse basin.
//!
//! The steeper of the two directions is the one eliminated: its closed form
//! gives z without cancellation, where evaluating a steep height at a rounded
//! v would not.
//!
//! The forms matter: written with `g` over `1 + m²` nothing cancels on steep
//! patches (docs/contact.md has the error analysis).

use super::patch::Patch;

/// Evaluations of F at most in one pass. Reached only on patches steeper than
/// about 10⁶; the best point so far is then returned.
pub const MAX_EVALUATIONS: u32 = 32;
/// Passes at most: one, and one more each time the other variable turns out to
/// be the better one to eliminate.
pub const MAX_PASSES: u32 = 3;

/// Distances that differ by less than this, relatively, count as equal: the
/// rounding of F.
const TIE: f32 = 1.0 + 1e-6;
/// A step shorter than this, in cells, that leaves F about the same is judged
/// by the slope.
const SHORT: f32 = 1.0 / 64.0;
/// Places in a patch closer than this, in cells, count as the same: what is as
/// near to an edge lies on it.
const RESOLUTION: f32 = 1.2e-7;
/// The same for a hand so far off that its coordinates resolve no better.
const COARSEST: f32 = 0.25;
/// Squared distance, in cells², below which F is nothing but rounding.
const LEAST_F: f32 = 1e-10;

/// A point of a patch, as the search sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Eastward coordinate in the patch, `[0, 1]`.
    pub u: f32,
    /// Northward coordinate in the patch, `[0, 1]`.
    pub v: f32,
    /// Height above the hand, cells.
    pub z: f32,
    /// Squared distance from the hand, cells².
    pub distance_squared: f32,
    /// Evaluations of F spent.
    pub evaluations: u32,
}

/// One evaluation of F.
#[derive(Clone, Copy)]
struct Ruling {
    u: f32,
    v: f32,
    z: f32,
    f: f32,
    /// F′(v)/2
    slope: f32,
    /// F″(v)/2
    curvature: f32,
    /// Rounding error that `slope` may have.
    noise: f32,
}

/// The nearest point of the ruling at `v`, for a hand at `(p, q)` in patch
/// coordinates.
#[inline]
fn ruling(patch: &Patch, (p, q): (f32, f32), v: f32) -> Ruling {
    let m = patch.slope_u(v);
    let steepness = 1.0 + m * m;
    let [sw, _, nw, _] = patch.corners;
    // The lines of the southern and the northern edge, over the hand's u.
    let (south, north) = (sw + patch.b[0] * p, nw + patch.b[1] * p);
    let g = south * (1.0 - v) + north * v;
    let free_z = g / steepness;
    let free_u = p - m * free_z;
    let (u, z, curvature);
    let mut rounding = 0.0;
    if (0.0..=1.0).contains(&free_u) {
        (u, z) = (free_u, free_z);
        let (zv, za) = (patch.slope_v(u), patch.a * z);
        curvature = 1.0 + (zv * zv - za * (za + 2.0 * m * zv)) / steepness;
    } else {
        u = if free_u > 0.5 { 1.0 } else { 0.0 };
        z = patch.height(u, v);
        let zv = patch.slope_v(u);
        curvature = 1.0 + zv * zv;
        // The rounding of a steep edge's height shows in the slope.
        let [sw, se, nw, ne] = patch.corners;
        let (start, end) = if u > 0.5 { (se, ne) } else { (sw, nw) };
        rounding = zv.abs() * (start.abs() * (1.0 - v) + end.abs() * v);
    }
    let (dv, lift) = (v - q, z * patch.slope_v(u));
    Ruling {
        u,
        v,
        z,
        f: (u - p) * (u - p) + dv * dv + z * z,
        slope: dv + lift,
        curvature,
        noise: f32::EPSILON * (dv.abs() + lift.abs() + rounding),
    }
}

/// Searches downhill from `start` (in `[0, 1]²`) for a point of the patch from
/// which no direction inside the patch leads closer to the hand.
///
/// `hand` is the haptic interface point in patch coordinates (u, v); it may lie
/// outside the unit square. Finite input gives a finite answer.
#[must_use]
pub fn nearest_downhill(patch: &Patch, hand: (f32, f32), start: (f32, f32)) -> Nearest {
    let mut best = Nearest {
        u: start.0,
        v: start.1,
        z: 0.0,
        distance_squared: f32::INFINITY,
        evaluations: 0,
    };
    let mut turned = patch.slope_v(start.0).abs() > patch.slope_u(start.1).abs();
    for _ in 0..MAX_PASSES {
        let found = if turned {
            along_v(&patch.transposed(), (hand.1, hand.0), best.u).transposed()
        } else {
            along_v(patch, hand, best.v)
        };
        best = Nearest {
            evaluations: best.evaluations + found.evaluations,
            ..found
        };
        if !best.wants_turning(patch, turned) {
            break;
        }
        turned = !turned;
    }
    best.snapped(patch, hand)
}

/// Places in a patch closer than this, in cells, cannot be told apart for a hand
/// at coordinate `hand`.
pub(super) fn resolution(hand: f32) -> f32 {
    (RESOLUTION * (1.0 + 2.0 * hand.abs())).min(COARSEST)
}

/// A coordinate, put on the border where it is as near to it as can be told for
/// a hand at coordinate `hand`.
fn snapped(x: f32, hand: f32) -> f32 {
    let resolution = resolution(hand);
    if x < resolution {
        0.0
    } else if 1.0 - x < resolution {
        1.0
    } else {
        x
    }
}

impl Nearest {
    fn snapped(self, patch: &Patch, (p, q): (f32, f32)) -> Self {
        let (u, v) = (snapped(self.u, p), snapped(self.v, q));
        if (u, v) == (self.u, self.v) {
            return self;
        }
        let z = patch.height(u, v);
        let distance_squared = (u - p) * (u - p) + (v - q) * (v - q) + z * z;
        if distance_squared > self.distance_squared * TIE + LEAST_F {
            return self; // up a steep wall that stands on the border
        }
        Self {
            u,
            v,
            z,
            distance_squared,
            ..self
        }
    }

    fn transposed(self) -> Self {
        Self {
            u: self.v,
            v: self.u,
            ..self
        }
    }

    /// Whether the eliminated variable ended at a limit while the searched one
    /// did not, or is no longer the steeper one: the other search is then
    /// better conditioned.
    fn wants_turning(&self, patch: &Patch, turned: bool) -> bool {
        let inside = |x: f32| x >= RESOLUTION && 1.0 - x >= RESOLUTION;
        let (m, n) = (patch.slope_u(self.v).abs(), patch.slope_v(self.u).abs());
        let (eliminated, searched, along, across) = if turned {
            (self.v, self.u, n, m)
        } else {
            (self.u, self.v, m, n)
        };
        inside(searched) && (!inside(eliminated) || across > 4.0 * along + 4.0)
    }
}

/// The search with u eliminated, along v from `start`.
fn along_v(patch: &Patch, hand: (f32, f32), start: f32) -> Nearest {
    let mut best = ruling(patch, hand, start);
    let mut search = Bracket::downhill_of(&best);
    let mut evaluations = 1;
    while evaluations < MAX_EVALUATIONS {
        let Some(v) = search.next(&best) else { break };
        let trial = ruling(patch, hand, v);
        evaluations += 1;
        search.narrow(&mut best, trial);
    }
    Nearest {
        u: best.u_on_the_surface(patch),
        v: best.v,
        z: best.z,
        distance_squared: best.f,
        evaluations,
    }
}

impl Ruling {
    /// u as its height has it: of a far hand, u = p − m·z keeps no more than p
    /// does, and on a steep patch that little is a lot of height.
    fn u_on_the_surface(&self, patch: &Patch) -> f32 {
        let m = patch.slope_u(self.v);
        if m.abs() <= 1.0 || self.u == 0.0 || self.u == 1.0 {
            return self.u;
        }
        let off = self.z - patch.height(self.u, self.v);
        (self.u + off / m).clamp(0.0, 1.0)
    }
}

/// The side of `best` on which a minimum lies, and how far that side reaches.
struct Bracket {
    wall: f32,
    /// Whether the wall is an end of the patch not yet evaluated.
    wall_is_end: bool,
    /// Newton steps in a row that did not halve the slope.
    lazy: u32,
}

impl Bracket {
    fn downhill_of(from: &Ruling) -> Self {
        Self {
            wall: if from.slope < 0.0 { 1.0 } else { 0.0 },
            wall_is_end: true,
            lazy: 0,
        }
    }

    /// Where to evaluate next; `None` when `best` is as good as it gets.
    fn next(&self, best: &Ruling) -> Option<f32> {
        let room = self.wall - best.v;
        if room.abs() < RESOLUTION {
            return None; // at a wall, most often an end of the patch
        }
        if best.curvature > 0.0 {
            let step = -best.slope / best.curvature;
            if best.slope.abs() <= best.noise || best.v + step == best.v {
                return None;
            }
            let inside = step.abs() < room.abs();
            if inside && self.lazy < 2 {
                return Some(best.v + step);
            }
            if !inside && self.wall_is_end {
                return Some(self.wall);
            }
        }
        let middle = best.v + 0.5 * room;
        (middle != best.v && middle != self.wall).then_some(middle)
    }

    /// Takes the trial as the best point if it is no farther from the hand,
    /// else as the new wall.
    fn narrow(&mut self, best: &mut Ruling, trial: Ruling) {
        let halved = trial.slope.abs() <= 0.5 * best.slope.abs();
        // Close to the minimum F is flat and its rounding decides; the slope
        // still tells.
        let close = (trial.v - best.v).abs() < SHORT && trial.f <= best.f * 1.01 + LEAST_F;
        let nearer = trial.f <= best.f * TIE || (halved && close);
        if !nearer {
            self.wall = trial.v;
            self.wall_is_end = false;
            self.lazy = 2; // not that Newton step again
            return;
        }
        self.lazy = if halved { 0 } else { self.lazy + 1 };
        if self.lazy > 2 {
            self.lazy = 0; // the middle has been tried
        }
        let turned = (trial.slope < 0.0) != (best.slope < 0.0);
        if turned {
            self.wall = best.v;
            self.wall_is_end = false;
        }
        *best = trial;
    }
}

#[cfg(test)]
#[path = "closest_tests.rs"]
mod tests;
