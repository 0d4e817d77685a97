//! Crossing of a straight line with the surface.

use super::surface::Patch;
use crate::scene::terrain::Terrain;

/// The first point of a path that is not above the surface.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    /// The point.
    pub at: [f64; 3],
    /// Largest depth of the path below the surface anywhere, perpendicular to the steeper of the
    /// two, cells.
    pub depth: f64,
}

/// Returns the point where the line from `from` to `to` meets the surface from above, if any.
///
/// In each cell the gap is a quadratic, and bisection finds its first root. `None` if the line
/// stays above every patch.
#[must_use]
pub fn first(terrain: &Terrain, from: [f64; 3], to: [f64; 3]) -> Option<Crossing> {
    let mut found: Option<Crossing> = None;
    for (t0, t1, cell) in cells(terrain, from, to) {
        let Some(patch) = Patch::at(terrain, cell) else {
            continue;
        };
        let gap = Gap::new(&patch, along(from, to, t0), along(from, to, t1));
        let deepest = gap.max();
        if deepest < 0.0 {
            continue;
        }
        let middle = along(from, to, 0.5 * (t0 + t1));
        let level = (to[0] - from[0]).hypot(to[1] - from[1]);
        let steep = ((to[2] - from[2]) / level.max(1e-30)).abs();
        let slope = patch.slope(middle[0], middle[1]) + patch.twist().abs();
        let depth = deepest / (1.0 + slope + steep.min(1e6));
        match &mut found {
            Some(crossing) => crossing.depth = crossing.depth.max(depth),
            None => {
                let at = along(from, to, t0 + (t1 - t0) * gap.first());
                found = Some(Crossing { at, depth });
            }
        }
    }
    found
}

fn along(from: [f64; 3], to: [f64; 3], t: f64) -> [f64; 3] {
    [0, 1, 2].map(|i| from[i] + t * (to[i] - from[i]))
}

/// Height of the surface above the path over one cell, as Bernstein coefficients.
struct Gap {
    f: [f64; 3],
}

impl Gap {
    fn new(patch: &Patch, a: [f64; 3], b: [f64; 3]) -> Self {
        let middle = patch.blossom([a[0], a[1]], [b[0], b[1]]) - 0.5 * (a[2] + b[2]);
        let ends = [a, b].map(|p| patch.height(p[0], p[1]) - p[2]);
        Self {
            f: [ends[0], middle, ends[1]],
        }
    }

    fn at(&self, s: f64) -> f64 {
        let [f0, f1, f2] = self.f;
        f0 * (1.0 - s) * (1.0 - s) + 2.0 * f1 * s * (1.0 - s) + f2 * s * s
    }

    /// Returns the parameter at which it is largest.
    fn top(&self) -> f64 {
        let [f0, f1, f2] = self.f;
        let bend = f0 - 2.0 * f1 + f2;
        let inner = if bend < 0.0 { (f0 - f1) / bend } else { 0.0 };
        let ends = if f0 >= f2 { 0.0 } else { 1.0 };
        if (0.0..=1.0).contains(&inner) && self.at(inner) > self.at(ends) {
            inner
        } else {
            ends
        }
    }

    fn max(&self) -> f64 {
        self.at(self.top())
    }

    /// Returns the first root, if the gap is non-negative anywhere.
    fn first(&self) -> f64 {
        if self.f[0] >= 0.0 {
            return 0.0;
        }
        // It is monotonic up to the top.
        let (mut below, mut above) = (0.0, self.top());
        for _ in 0..100 {
            let middle = 0.5 * (below + above);
            if self.at(middle) >= 0.0 {
                above = middle;
            } else {
                below = middle;
            }
        }
        above
    }
}

/// Returns the parts of a path by cell: start, end and the cell, for cells of the field only.
fn cells(
    terrain: &Terrain,
    from: [f64; 3],
    to: [f64; 3],
) -> impl Iterator<Item = (f64, f64, [i32; 2])> + use<> {
    let displacement = [0, 1].map(|i| to[i] - from[i]);
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let last = f64::from(terrain.size[axis]);
        if displacement[axis] == 0.0 {
            if from[axis] < 0.0 || from[axis] > last {
                leave = -1.0;
            }
            continue;
        }
        let t = [
            (0.0 - from[axis]) / displacement[axis],
            (last - from[axis]) / displacement[axis],
        ];
        enter = enter.max(t[0].min(t[1]));
        leave = leave.min(t[0].max(t[1]));
    }
    let mut cuts = Vec::new();
    if enter <= leave {
        cuts.push(enter);
        for axis in 0..2 {
            if displacement[axis] == 0.0 {
                continue;
            }
            let ends = [enter, leave].map(|t| from[axis] + t * displacement[axis]);
            let (low, high) = (ends[0].min(ends[1]).ceil(), ends[0].max(ends[1]).floor());
            let mut line = low;
            while line <= high {
                cuts.push(((line - from[axis]) / displacement[axis]).clamp(enter, leave));
                line += 1.0;
            }
        }
        cuts.push(leave);
        cuts.sort_by(f64::total_cmp);
    }
    let pieces: Vec<_> = cuts
        .windows(2)
        .flat_map(|cut| {
            let middle = 0.5 * (cut[0] + cut[1]);
            let (x, y) = (
                from[0] + middle * displacement[0],
                from[1] + middle * displacement[1],
            );
            // A path along a grid line belongs to the patches on both sides, and a vertical path
            // through a vertex to the four around it.
            let pair = |c: f64, still: bool| {
                let cell = c.floor() as i32;
                let other = if still && c == c.floor() {
                    cell - 1
                } else {
                    cell
                };
                [cell, other]
            };
            let (xs, ys) = (
                pair(x, displacement[0] == 0.0),
                pair(y, displacement[1] == 0.0),
            );
            let (t0, t1) = (cut[0], cut[1]);
            let mut all = vec![(t0, t1, [xs[0], ys[0]])];
            if xs[1] != xs[0] {
                all.push((t0, t1, [xs[1], ys[0]]));
            }
            if ys[1] != ys[0] {
                all.push((t0, t1, [xs[0], ys[1]]));
            }
            if xs[1] != xs[0] && ys[1] != ys[0] {
                all.push((t0, t1, [xs[1], ys[1]]));
            }
            all
        })
        .collect();
    pieces.into_iter()
}
