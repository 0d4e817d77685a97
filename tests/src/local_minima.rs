//! A list of all local closest points around a point: a second opinion on where a proxy may rest,
//! without a path from its last position.
//!
//! In a patch, the nearest point of each ruling is known in closed form, so the squared distance is
//! a function F of one coordinate. The slope of F is computed at hundreds of points, dense to 10⁻¹²
//! around those where it may change sign within a short distance; each change from falling to
//! rising is bisected to the precision of f64. A point on a border is kept if no patch that shares
//! it leads on downhill.

use crate::invariants::surface::{Patch, distance};
use crate::scene::terrain::Terrain;

/// Evenly spaced points in a patch.
const STEPS: i32 = 512;
/// Distance from a border, cells, within which its other side is searched as well.
const NEAR: f64 = 1e-3;
/// Slopes of the distance on a border's other side that count as zero.
const LEVEL: f64 = 1e-9;

/// Returns the local closest points to `hip` in the patch at a point, and in those whose border is
/// near.
#[must_use]
pub fn around(terrain: &Terrain, hip: [f64; 3], place: [f64; 2]) -> Vec<[f64; 3]> {
    let cells = |x: f64| {
        let (low, high) = ((x - NEAR).floor() as i32, (x + NEAR).floor() as i32);
        low..=high
    };
    let patches = cells(place[1])
        .flat_map(|row| cells(place[0]).map(move |col| [col, row]))
        .filter_map(|cell| Patch::at(terrain, cell));
    patches
        .flat_map(|patch| {
            let all = in_patch(&patch, hip, place);
            all.into_iter()
                .filter(move |at| is_lowest_around(terrain, hip, &patch, *at))
                .map(move |[x, y]| [x, y, patch.height(x, y)])
        })
        .collect()
}

/// Returns the one nearest to a point, and its distance.
#[must_use]
pub fn nearest(all: &[[f64; 3]], point: [f64; 3]) -> Option<([f64; 3], f64)> {
    let with = all.iter().map(|at| (*at, distance(*at, point)));
    with.min_by(|a, b| a.1.total_cmp(&b.1))
}

fn in_patch(patch: &Patch, hip: [f64; 3], place: [f64; 2]) -> Vec<[f64; 2]> {
    let low = patch.cell.map(f64::from);
    // The steeper direction uses the closed form.
    let steepest = |axis: usize| {
        let ends = [[0.0, 0.0], [1.0, 1.0]];
        let slopes = ends.map(|[u, v]| patch.slopes(low[0] + u, low[1] + v)[axis].abs());
        slopes[0].max(slopes[1])
    };
    let axis = usize::from(steepest(1) > steepest(0));
    let ruled = Ruled {
        patch,
        hip,
        axis,
        low,
    };
    let places = ruled.places(place[1 - axis] - low[1 - axis]);
    let slopes: Vec<f64> = places.iter().map(|t| ruled.slope(*t)).collect();
    let mut found = Vec::new();
    if slopes[0] >= 0.0 {
        found.push(0.0);
    }
    for i in 1..places.len() {
        if slopes[i - 1] < 0.0 && slopes[i] >= 0.0 {
            found.push(ruled.turn(places[i - 1], places[i]));
        }
    }
    if slopes[slopes.len() - 1] < 0.0 {
        found.push(1.0);
    }
    found.into_iter().map(|t| ruled.point(t)).collect()
}

/// A patch by its rulings along `axis`, each at a `t` of the other one.
struct Ruled<'p> {
    patch: &'p Patch,
    hip: [f64; 3],
    axis: usize,
    low: [f64; 2],
}

impl Ruled<'_> {
    /// Returns the coordinate of the nearest point along its ruling.
    fn best(&self, t: f64) -> f64 {
        let [x, y] = self.at(0.0, t);
        let slope = self.patch.slopes(x, y)[self.axis];
        let rise = self.patch.height(x, y) - self.hip[2];
        let ahead = self.hip[self.axis] - self.low[self.axis];
        ((ahead - rise * slope) / (1.0 + slope * slope)).clamp(0.0, 1.0)
    }

    fn at(&self, s: f64, t: f64) -> [f64; 2] {
        let (x, y) = if self.axis == 0 { (s, t) } else { (t, s) };
        [self.low[0] + x, self.low[1] + y]
    }

    fn point(&self, t: f64) -> [f64; 2] {
        self.at(self.best(t), t)
    }

    /// Returns half the slope of F.
    fn slope(&self, t: f64) -> f64 {
        let [x, y] = self.point(t);
        let other = 1 - self.axis;
        let aside = [x, y][other] - self.hip[other];
        aside + (self.patch.height(x, y) - self.hip[2]) * self.patch.slopes(x, y)[other]
    }

    /// Returns points everywhere, dense around those where F may turn.
    fn places(&self, around: f64) -> Vec<f64> {
        let [x0, y0] = self.at(0.0, 0.0);
        let [x1, y1] = self.at(0.0, 1.0);
        let slopes = [(x0, y0), (x1, y1)].map(|(x, y)| self.patch.slopes(x, y)[self.axis]);
        // The gap between the surface and the HIP along the ruling through the HIP.
        let ahead = self.hip[self.axis] - self.low[self.axis];
        let gaps = [0.0, 1.0].map(|t| {
            let [x, y] = self.at(0.0, t);
            let slope = self.patch.slopes(x, y)[self.axis];
            self.patch.height(x, y) + slope * ahead - self.hip[2]
        });
        let zero = |[a, b]: [f64; 2]| a / (a - b);
        let across = self.hip[1 - self.axis] - self.low[1 - self.axis];
        let centres = [around, across, zero(slopes), zero(gaps), 0.0, 1.0];
        let mut places: Vec<f64> = (0..=STEPS)
            .map(|i| f64::from(i) / f64::from(STEPS))
            .collect();
        for centre in centres.into_iter().filter(|c| c.is_finite()) {
            places.push(centre);
            for quarter in 0..=48 {
                let off = 10_f64.powf(-f64::from(quarter) / 4.0);
                places.extend([centre - off, centre + off]);
            }
        }
        places.retain(|t| (0.0..=1.0).contains(t));
        places.sort_by(f64::total_cmp);
        places.dedup();
        places
    }

    fn turn(&self, mut falling: f64, mut rising: f64) -> f64 {
        loop {
            let middle = 0.5 * (falling + rising);
            if middle == falling || middle == rising {
                return rising;
            }
            if self.slope(middle) >= 0.0 {
                rising = middle;
            } else {
                falling = middle;
            }
        }
    }
}

/// Returns true if no patch that shares the point leads on downhill.
fn is_lowest_around(terrain: &Terrain, hip: [f64; 3], own: &Patch, at: [f64; 2]) -> bool {
    let side = |axis: usize| {
        let local = at[axis] - f64::from(own.cell[axis]);
        i32::from(local == 1.0) - i32::from(local == 0.0)
    };
    let steps = [side(0), side(1)];
    let others = [[steps[0], 0], [0, steps[1]], steps];
    others
        .into_iter()
        .filter(|step| *step != [0, 0])
        .filter_map(|step| {
            let cell = [own.cell[0] + step[0], own.cell[1] + step[1]];
            Some((step, Patch::at(terrain, cell)?))
        })
        .all(|(step, patch)| !leads_down(&patch, hip, at, step))
}

/// Returns true if the distance falls from a point on a patch's border into the patch.
fn leads_down(patch: &Patch, hip: [f64; 3], [x, y]: [f64; 2], step: [i32; 2]) -> bool {
    let rise = patch.height(x, y) - hip[2];
    let [east, north] = patch.slopes(x, y);
    let slopes = [(x - hip[0]) + rise * east, (y - hip[1]) + rise * north];
    let steep = [east, north].map(|m| LEVEL * (1.0 + m.abs()) * (1.0 + rise.abs()));
    (0..2).any(|axis| step[axis] != 0 && slopes[axis] * f64::from(step[axis]) < -steep[axis])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::terrain::Kind;

    #[test]
    fn minima_are_found_on_ridges_and_in_valleys() {
        let ridge = Terrain::from_fn(Kind::Ridges, [8, 8], |x, _| -((x - 4).abs() as f32));
        let hip = [4.0, 3.5, -0.001];
        let all = around(&ridge, hip, [4.0, 3.5]);
        assert_eq!(all.len(), 2, "{all:?}");
        let valley = Terrain::from_fn(Kind::Ridges, [8, 8], |x, _| (x - 4).abs() as f32);
        let all = around(&valley, hip, [4.0, 3.5]);
        assert!(
            !all.is_empty() && all.iter().all(|at| *at == [4.0, 3.5, 0.0]),
            "{all:?}"
        );
    }

    #[test]
    fn twisted_patch_has_several_minima() {
        // z = 8·(u − ½)·(v − ½): seen from far below the middle, two corners are near.
        let saddle = Terrain::from_fn(
            Kind::Twisted,
            [1, 1],
            |x, y| {
                if x == y { 2.0 } else { -2.0 }
            },
        );
        let all = around(&saddle, [0.5, 0.5, -6.0], [0.5, 0.5]);
        assert_eq!(all.len(), 2, "{all:?}");
        assert!(all.iter().all(|at| at[2] == -2.0), "{all:?}");
    }
}
