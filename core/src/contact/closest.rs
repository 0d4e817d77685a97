//! The closest point of one patch to the hand (paper §4.3.2, eq. 8-11).
//!
//! The paper minimises the squared distance D(u, v) by Newton's method in two
//! variables. That Hessian is indefinite on twisted patches, and the iteration
//! leaves, cycles or rests on a saddle. Here one variable is eliminated
//! exactly: with v fixed, the patch is a straight line, and its nearest point is
//! known in closed form (`ruling.rs`).
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
//! docs/contact.md has the error analysis.

use super::patch::Patch;
use super::ruling::{Ruling, ruling};

/// Evaluations of F at most in one pass. Reached only on patches steeper than
/// about 10⁶; the best point so far is then returned.
pub const MAX_EVALUATIONS: u32 = 32;
/// Passes at most: one, and one more each time the other variable turns out to
/// be the better one to eliminate.
pub const MAX_PASSES: u32 = 3;

/// A Newton step shorter than this, in cells, may be rounding alone.
const SHORT: f32 = 1e-3;
/// A step shorter than this, in cells, is not taken: a coordinate near 1 cannot
/// tell it.
const LEAST_STEP: f32 = 6e-8;
/// Steps downhill after which the end of the patch is tried, where halving the
/// way to it would take as many as a place has bits.
const DOWNHILL: u32 = 2;
/// Newton steps taken at once where single ones get on slowly; each time again
/// so many times as many.
const STRIDE: f32 = 8.0;
/// Places in a patch closer than this, in cells, count as the same: what is as
/// near to an edge lies on it.
pub(super) const RESOLUTION: f32 = 1.2e-7;
/// The same for a hand so far off that its coordinates resolve no better.
pub(super) const COARSEST: f32 = 0.25;
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
    let mut turned = is_steeper_north(patch, hand, start);
    for _ in 0..MAX_PASSES {
        let (found, evaluations) = if turned {
            along_v(&patch.transposed(), (hand.1, hand.0), best.u)
        } else {
            along_v(patch, hand, best.v)
        };
        best = Nearest::of(&found, turned, best.evaluations + evaluations);
        if !found.wants_turning() {
            break;
        }
        turned = !turned;
    }
    best.snapped(patch, hand)
}

/// Whether the patch is steeper northward than eastward at `start`; of two slopes
/// alike, as at the foot of a raised corner, the hand's direction is decisive,
/// which a mirrored scene shares.
fn is_steeper_north(patch: &Patch, (p, q): (f32, f32), (u, v): (f32, f32)) -> bool {
    let (east, north) = (patch.slope_u(v).abs(), patch.slope_v(u).abs());
    north > east || (north == east && (q - v).abs() > (p - u).abs())
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
    fn of(found: &Ruling, turned: bool, evaluations: u32) -> Self {
        let (u, v) = if turned {
            (found.v, found.u)
        } else {
            (found.u, found.v)
        };
        Self {
            u,
            v,
            z: found.z,
            distance_squared: found.f(),
            evaluations,
        }
    }

    /// The point put on the border, where it is as good as on it.
    fn snapped(self, patch: &Patch, (p, q): (f32, f32)) -> Self {
        let (u, v) = (snapped(self.u, p), snapped(self.v, q));
        if (u, v) == (self.u, self.v) {
            return self;
        }
        let z = patch.height(u, v);
        if (z - self.z).abs() > resolution(p) + resolution(q) {
            return self; // up a steep wall that stands on the border
        }
        let distance_squared = (u - p) * (u - p) + (v - q) * (v - q) + z * z;
        Self {
            u,
            v,
            z,
            distance_squared,
            ..self
        }
    }
}

impl Ruling {
    /// Whether the eliminated variable ended at a limit while the searched one
    /// did not, or is no longer the steeper one: the other search is then
    /// better conditioned.
    fn wants_turning(&self) -> bool {
        let inside_by = |margin: f32| self.v > margin && 1.0 - self.v > margin;
        let steeper = self.across.abs() > 4.0 * self.along.abs() + 4.0;
        (self.at_end && inside_by(RESOLUTION)) || (steeper && inside_by(0.0))
    }
}

/// The search with u eliminated, along v from `start`.
fn along_v(patch: &Patch, hand: (f32, f32), start: f32) -> (Ruling, u32) {
    let mut best = ruling(patch, hand, start);
    let mut search = Bracket::downhill_of(&best, patch, hand.0);
    let mut evaluations = 1;
    while evaluations < MAX_EVALUATIONS {
        let Some(v) = search.next(&best) else { break };
        let trial = ruling(patch, hand, v);
        evaluations += 1;
        search.narrow(&mut best, trial);
    }
    (best, evaluations)
}

/// The side of `best` on which a minimum lies, and how far that side reaches.
struct Bracket<'p> {
    patch: &'p Patch,
    /// East of the patch's origin, the hand.
    p: f32,
    wall: f32,
    /// Whether the wall is an end of the patch not yet evaluated.
    wall_is_end: bool,
    /// Newton steps in a row that did not halve the slope.
    lazy: u32,
    /// Newton steps to take at once next.
    stride: f32,
    /// Steps that led on downhill, to no turn.
    downhill: u32,
    /// Newton's step back from the wall, where that has not just been tried; not
    /// a number otherwise.
    back: f32,
}

impl<'p> Bracket<'p> {
    fn downhill_of(from: &Ruling, patch: &'p Patch, p: f32) -> Self {
        Self {
            patch,
            p,
            wall: if from.slope < 0.0 { 1.0 } else { 0.0 },
            wall_is_end: true,
            lazy: 0,
            stride: STRIDE,
            downhill: 0,
            back: f32::NAN,
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
            if step.abs() < SHORT {
                let noise = best.noise(self.patch, self.p).slope;
                if best.slope.abs() <= noise || step.abs() < LEAST_STEP {
                    return None;
                }
            }
            let inside = step.abs() < room.abs();
            if inside && self.lazy < 2 {
                return Some(best.v + step);
            }
            if !inside && self.wall_is_end {
                return Some(self.wall);
            }
            // Not to the middle, which may lie beyond a hill.
            let stride = self.stride * step;
            if self.wall_is_end && stride.abs() < 0.5 * room.abs() {
                return Some(best.v + stride);
            }
        }
        if self.wall_is_end && self.downhill >= DOWNHILL {
            return Some(self.wall);
        }
        // Where the eliminated variable reaches its limit F bends sharply, and
        // only the far side knows how much.
        let (behind, before) = (self.back - best.v, self.wall - self.back);
        if behind * before > 0.0 && before.abs() <= behind.abs() {
            return Some(self.back);
        }
        let middle = best.v + 0.5 * room;
        (middle != best.v && middle != self.wall).then_some(middle)
    }

    /// Takes the trial as the best point if it is no farther from the hand,
    /// else as the new wall.
    fn narrow(&mut self, best: &mut Ruling, trial: Ruling) {
        let halved = trial.slope.abs() <= 0.5 * best.slope.abs();
        // Where rounding hides which is nearer, the slope still tells.
        let onward = trial.slope * best.slope > 0.0;
        let better = onward || trial.slope.abs() <= best.slope.abs();
        let gain = trial.gain_on(best);
        let nearer = if (gain > 0.0) == better {
            better
        } else {
            let noise = 2.0 * trial.noise(self.patch, self.p).f;
            gain > noise || (better && gain >= -noise)
        };
        if !nearer {
            self.wall = trial.v;
            self.wall_is_end = false;
            self.lazy = 2; // not that Newton step again
            let known = trial.curvature > 0.0 && self.back.is_nan();
            self.back = if known {
                trial.v - trial.slope / trial.curvature
            } else {
                f32::NAN
            };
            return;
        }
        self.back = f32::NAN;
        self.lazy = if halved { 0 } else { self.lazy + 1 };
        if halved {
            self.stride = STRIDE;
        }
        if self.lazy > 2 {
            self.lazy = 0; // the middle has been tried, or a stride
            self.stride *= STRIDE;
        }
        let turned = (trial.slope < 0.0) != (best.slope < 0.0);
        self.downhill += 1;
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
