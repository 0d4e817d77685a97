//! The judge: the exact local closest point of the bilinear surface, in f64,
//! by another method than any variant's.
//!
//! With v fixed, the patch's nearest point is known in closed form, so the
//! squared distance is a function F of v alone. From an answer's own place the
//! judge walks F downhill in small steps until its slope changes sign, halves
//! that interval until no float lies between, and goes on in the next patch
//! while that leads nearer to the hand. Nothing of it is fast.

use crate::grid::Grid;
use crate::haptics::{Answer, Hand};

/// First step of the walk downhill, in cells.
const STEP: f64 = 1.0 / 256.0;
/// A neighbouring patch must lead at least this far, in cells.
const LEAST_WAY: f64 = 1e-11;
/// Patches walked through at most.
const PATCHES: u32 = 10_000;

/// What an answer was worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Distance from the answer's proxy to the exact closest point, cells.
    pub error: f64,
    /// Angle between the answer's force and the exact one, degrees.
    pub angle: f64,
}

/// Judges an answer that says "touching": how far is it from the local closest
/// point that a descent from it ends at? `None` over the border of the field.
#[must_use]
pub fn judge(grid: &Grid, hand: &Hand, answer: &Answer) -> Option<Verdict> {
    let stretch = answer.stretch.map(f64::from);
    let proxy = [0, 1, 2].map(|i| hand.wide[i] + stretch[i]);
    let verdict = |from: [f64; 2]| {
        let exact = closest(grid, &hand.wide, from)?;
        let off = [0, 1, 2].map(|i| proxy[i] - exact[i]);
        let force = [0, 1, 2].map(|i| exact[i] - hand.wide[i]);
        Some(Verdict {
            error: length(&off),
            angle: angle(&stretch, &force),
        })
    };
    let (xs, ys) = (sides(proxy[0]), sides(proxy[1]));
    let places = xs.iter().flat_map(|x| ys.iter().map(|y| [*x, *y]));
    places
        .filter_map(verdict)
        .min_by(|a, b| a.error.total_cmp(&b.error))
}

/// Where to begin for a proxy at `x`: there, and on both sides of a border of
/// patches that single precision cannot tell it from. On a sharp ridge the two
/// sides lead to different valleys, and rounding is not to choose.
fn sides(x: f64) -> [f64; 3] {
    const ROUNDING: f64 = 1e-6;
    let border = x.round();
    if (x - border).abs() > ROUNDING {
        return [x; 3];
    }
    [x, border, border - 1e-12]
}

/// The closest point to `hand` that a descent over the surface from the place
/// `from` ends at.
#[must_use]
pub fn closest(grid: &Grid, hand: &[f64; 3], from: [f64; 2]) -> Option<[f64; 3]> {
    let cell = from.map(|x| x.floor() as i32);
    if !grid.has(cell) {
        return None;
    }
    let mut place = Place {
        cell,
        u: from[0] - f64::from(cell[0]),
        v: from[1] - f64::from(cell[1]),
    };
    for _ in 0..PATCHES {
        let patch = Patch::new(grid, &place, hand);
        (place.u, place.v) = patch.descend(place.u, place.v);
        let here = patch.squared(place.u, place.v);
        let Some(next) = next_patch(grid, hand, &place, here) else {
            let [x, y] = place.cell.map(f64::from);
            let z = patch.height(place.u, place.v) + hand[2];
            return Some([x + place.u, y + place.v, z]);
        };
        place = next;
    }
    None
}

/// A patch that shares the point and from it leads nearer to the hand.
fn next_patch(grid: &Grid, hand: &[f64; 3], place: &Place, here: f64) -> Option<Place> {
    let side = |x: f64| i32::from(x == 1.0) - i32::from(x == 0.0);
    let (east, north) = (side(place.u), side(place.v));
    let mut best = None;
    let mut least = here;
    for (dx, dy) in [(east, 0), (0, north), (east, north)] {
        let entry = place.across(dx, dy);
        if (dx, dy) == (0, 0) || !grid.has(entry.cell) {
            continue;
        }
        let patch = Patch::new(grid, &entry, hand);
        let (u, v) = patch.descend(entry.u, entry.v);
        let moved = (u - entry.u).abs().max((v - entry.v).abs());
        let there = patch.squared(u, v);
        if moved > LEAST_WAY && there < least {
            least = there;
            best = Some(entry);
        }
    }
    best
}

#[derive(Clone, Copy, Debug)]
struct Place {
    cell: [i32; 2],
    u: f64,
    v: f64,
}

impl Place {
    fn across(&self, dx: i32, dy: i32) -> Self {
        let mirror = |x: f64, d: i32| if d == 0 { x } else { 1.0 - x };
        Self {
            cell: [self.cell[0] + dx, self.cell[1] + dy],
            u: mirror(self.u, dx),
            v: mirror(self.v, dy),
        }
    }
}

/// z above the hand = d + b·u + c·v + a·u·v, the hand at (p, q, 0).
struct Patch {
    a: f64,
    b: f64,
    c: f64,
    d: f64,
    p: f64,
    q: f64,
}

impl Patch {
    fn new(grid: &Grid, place: &Place, hand: &[f64; 3]) -> Self {
        let [sw, se, nw, ne] = grid.corners(place.cell).map(|h| f64::from(h) - hand[2]);
        Self {
            a: (ne - nw) - (se - sw),
            b: se - sw,
            c: nw - sw,
            d: sw,
            p: hand[0] - f64::from(place.cell[0]),
            q: hand[1] - f64::from(place.cell[1]),
        }
    }

    fn height(&self, u: f64, v: f64) -> f64 {
        self.d + self.b * u + (self.c + self.a * u) * v
    }

    fn squared(&self, u: f64, v: f64) -> f64 {
        (u - self.p).powi(2) + (v - self.q).powi(2) + self.height(u, v).powi(2)
    }

    /// The best u for a v.
    fn best_u(&self, v: f64) -> f64 {
        let m = self.b + self.a * v;
        let start = self.d + self.c * v;
        ((self.p - start * m) / (1.0 + m * m)).clamp(0.0, 1.0)
    }

    /// F′(v)/2
    fn slope(&self, v: f64) -> f64 {
        let u = self.best_u(v);
        (v - self.q) + self.height(u, v) * (self.c + self.a * u)
    }

    /// Downhill from (u, v) to a local minimum over the unit square.
    fn descend(&self, u: f64, v: f64) -> (f64, f64) {
        // First to the best u for this v, then along F.
        let (_, v) = (u, self.bottom(v));
        (self.best_u(v), v)
    }

    fn bottom(&self, from: f64) -> f64 {
        let down = -self.slope(from).signum();
        if self.slope(from) == 0.0 {
            return from;
        }
        let (mut near, mut step) = (from, STEP);
        loop {
            let far = (near + down * step).clamp(0.0, 1.0);
            if far == near {
                return near; // at the end of the patch, still downhill
            }
            if self.slope(far) * down >= 0.0 {
                return self.halve(near, far, down);
            }
            near = far;
            step = (step * 1.5).min(1.0 / 32.0);
        }
    }

    /// Between a place where F falls and one where it rises.
    fn halve(&self, mut near: f64, mut far: f64, down: f64) -> f64 {
        for _ in 0..80 {
            let middle = 0.5 * (near + far);
            if middle == near || middle == far {
                break;
            }
            if self.slope(middle) * down >= 0.0 {
                far = middle;
            } else {
                near = middle;
            }
        }
        far
    }
}

pub(crate) fn length(v: &[f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Forces below this, in cells of stretch, have no direction to speak of.
const LEAST_FORCE: f64 = 1e-3;

/// From the exact force to the one felt, in degrees.
pub(crate) fn angle(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    if length(b) < LEAST_FORCE {
        return 0.0;
    }
    let cross = [0, 1, 2].map(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    });
    let dot = (0..3).map(|i| a[i] * b[i]).sum::<f64>();
    length(&cross).atan2(dot).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::Dice;

    fn rough() -> Grid {
        let mut dice = Dice(5);
        Grid::from_fn("rough", [12, 12], |_, _| dice.between(0.0, 3.0) as f32)
    }

    #[test]
    fn no_point_around_the_closest_is_nearer() {
        let grid = rough();
        let mut dice = Dice(9);
        for _ in 0..2000 {
            let from = [dice.between(1.0, 11.0), dice.between(1.0, 11.0)];
            let hand = [
                from[0] + dice.between(-0.5, 0.5),
                from[1] + dice.between(-0.5, 0.5),
                grid.height(from[0], from[1]) - dice.between(0.0, 1.0),
            ];
            let exact = closest(&grid, &hand, from).expect("inside");
            let far = |p: &[f64; 3]| length(&[0, 1, 2].map(|i| p[i] - hand[i]));
            for i in 0..32 {
                let turn = f64::from(i) / 32.0 * std::f64::consts::TAU;
                let (x, y) = (exact[0] + 1e-5 * turn.cos(), exact[1] + 1e-5 * turn.sin());
                if grid.has([x.floor() as i32, y.floor() as i32]) {
                    let near = [x, y, grid.height(x, y)];
                    assert!(far(&near) > far(&exact) - 1e-12, "{hand:?} {exact:?}");
                }
            }
        }
    }

    #[test]
    fn an_answer_that_is_off_is_seen_to_be_off() {
        let flat = Grid::from_fn("flat", [4, 4], |_, _| 2.0);
        let hand = Hand::at([1.5, 1.5, 1.75]);
        let exact = judge(&flat, &hand, &Answer::touching([0.0, 0.0, 0.25]));
        assert_eq!(
            exact,
            Some(Verdict {
                error: 0.0,
                angle: 0.0
            })
        );
        let off = judge(&flat, &hand, &Answer::touching([0.25, 0.0, 0.25])).expect("inside");
        assert!((off.error - 0.25).abs() < 1e-9 && (off.angle - 45.0).abs() < 1e-6);
    }
}
