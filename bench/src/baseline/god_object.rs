//! The god-object on triangles (Zilles & Salisbury 1995): it moves straight toward the HIP; each
//! facet that it meets becomes a constraint plane, and its goal is the point nearest to the HIP
//! that satisfies all planes.
//!
//! In f64, so that rounding cannot let it fall through a facet.

use hapterra::published::Line;

use super::triangle::{Facet, Plane};
use crate::grid::Grid;
use crate::variant::{ContactResult, Haptics, Hip};

/// Max number of facets that constrain it at once.
const PLANES: usize = 3;
/// Depth of a path's end below a facet from which the facet counts as passed.
const BELOW: f64 = 1e-12;

/// The algorithm's state.
pub struct GodObject<'g> {
    grid: &'g Grid,
    hip: Option<[f64; 3]>,
    god: [f64; 3],
    result: ContactResult,
}

impl<'g> GodObject<'g> {
    /// Creates the algorithm on a terrain.
    #[must_use]
    pub const fn new(grid: &'g Grid) -> Self {
        Self {
            grid,
            hip: None,
            god: [0.0; 3],
            result: ContactResult::FREE,
        }
    }

    /// Returns the first facet, not among `known`, that a segment crosses downward.
    #[inline]
    fn first_hit(
        &self,
        from: &[f64; 3],
        to: &[f64; 3],
        known: &[Facet],
    ) -> Option<([f64; 3], Facet, Plane)> {
        let displacement = [0, 1, 2].map(|i| to[i] - from[i]);
        let at = |t: f64| [0, 1, 2].map(|i| from[i] + t * displacement[i]);
        // On the diagonal, x + y is one more than at the cell's corner.
        let (sum, rise) = (from[0] + from[1], displacement[0] + displacement[1]);
        let mut entered = 0.0;
        let line = Line::new([from[0], from[1]], [to[0], to[1]]);
        for cell in line.filter(|cell| self.grid.has(*cell)) {
            let [x, y] = cell.map(f64::from);
            let leaves = |i: usize, low: f64| {
                let border = if displacement[i] > 0.0 {
                    low + 1.0
                } else {
                    low
                };
                if displacement[i] == 0.0 {
                    1.0
                } else {
                    ((border - from[i]) / displacement[i]).min(1.0)
                }
            };
            let left = leaves(0, x).min(leaves(1, y)).max(entered);
            let diagonal = (x + y + 1.0 - sum) / rise;
            let split = diagonal > entered && diagonal < left;
            let starts_upper = if split {
                rise < 0.0
            } else {
                sum + rise * 0.5 * (entered + left) > x + y + 1.0
            };
            let pieces = [
                (entered, if split { diagonal } else { left }, starts_upper),
                (diagonal, left, !starts_upper),
            ];
            for (begin, end, upper) in pieces.into_iter().take(1 + usize::from(split)) {
                let facet = Facet { cell, upper };
                if known.contains(&facet) {
                    continue;
                }
                let plane = facet.plane(self.grid);
                let (before, after) = (plane.above(&at(begin)), plane.above(&at(end)));
                if after > BELOW && after > before {
                    let t = if before >= 0.0 {
                        begin
                    } else {
                        begin + (end - begin) * before / (before - after)
                    };
                    return Some((at(t), facet, plane));
                }
            }
            entered = left;
        }
        None
    }
}

impl Haptics for GodObject<'_> {
    fn reset(&mut self) {
        self.hip = None;
        self.result = ContactResult::FREE;
    }

    #[inline]
    fn tick(&mut self, hip: &Hip) -> ContactResult {
        let hip = hip.wide;
        match self.hip.replace(hip) {
            None => {
                self.god = hip;
                return self.result;
            }
            Some(last) if last == hip && !self.result.touching => return self.result,
            Some(_) => {}
        }
        let mut facets = [Facet {
            cell: [-1, -1],
            upper: false,
        }; PLANES];
        let mut planes = [Plane::default(); PLANES];
        let (mut held, mut goal) = (0, hip);
        while let Some((hit, facet, plane)) = self.first_hit(&self.god, &goal, &facets[..held]) {
            self.god = hit;
            if held == PLANES {
                goal = hit;
                break;
            }
            (facets[held], planes[held]) = (facet, plane);
            held += 1;
            goal = nearest_on(&planes[..held], &hip);
        }
        self.god = goal;
        self.result = if held == 0 {
            ContactResult::FREE
        } else {
            ContactResult::touching([0, 1, 2].map(|i| (goal[i] - hip[i]) as f32))
        };
        self.result
    }
}

/// Returns the point nearest to the HIP on all planes; a plane that would pull the god-object back
/// is dropped.
#[inline]
fn nearest_on(planes: &[Plane], hip: &[f64; 3]) -> [f64; 3] {
    match planes {
        [one] => along(hip, one, push(one, hip)),
        [first, second] => {
            let (n, m) = (first.normal(), second.normal());
            let (nn, mm, nm) = (dot(&n, &n), dot(&m, &m), dot(&n, &m));
            let det = nn * mm - nm * nm;
            let (g, h) = (first.above(hip), second.above(hip));
            let (s, t) = ((g * mm - h * nm) / det, (h * nn - g * nm) / det);
            if det <= 1e-14 * nn * mm || s < 0.0 {
                along(hip, second, push(second, hip))
            } else if t < 0.0 {
                along(hip, first, push(first, hip))
            } else {
                let part = along(hip, first, s);
                along(&part, second, t)
            }
        }
        [first, second, third] => meeting_point(first, second, third)
            .unwrap_or_else(|| nearest_on(&[*second, *third], hip)),
        _ => *hip,
    }
}

/// Returns the distance of the HIP from the plane, in normals.
#[inline]
fn push(plane: &Plane, hip: &[f64; 3]) -> f64 {
    let normal = plane.normal();
    plane.above(hip) / dot(&normal, &normal)
}

#[inline]
fn along(from: &[f64; 3], plane: &Plane, normals: f64) -> [f64; 3] {
    let normal = plane.normal();
    [0, 1, 2].map(|i| from[i] + normals * normal[i])
}

#[inline]
fn meeting_point(a: &Plane, b: &Plane, c: &Plane) -> Option<[f64; 3]> {
    let (be, bn, bl) = (b.east - a.east, b.north - a.north, b.level - a.level);
    let (ce, cn, cl) = (c.east - a.east, c.north - a.north, c.level - a.level);
    let det = be * cn - bn * ce;
    if det.abs() < 1e-14 {
        return None;
    }
    let (x, y) = ((bn * cl - bl * cn) / det, (bl * ce - be * cl) / det);
    Some([x, y, a.level + a.east * x + a.north * y])
}

#[inline]
fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
