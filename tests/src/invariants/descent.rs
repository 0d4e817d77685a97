//! The exact local closest point: down from a place until no way leads nearer.
//!
//! With y fixed a patch is a straight line, so its nearest point is known in
//! closed form and the squared distance is a function F of y alone. F is walked
//! downhill in small steps until its slope turns, that interval is halved to the
//! end of f64, and the next patch is taken if that leads nearer. Slow and plain.

use super::surface::{Corners, Patch, distance};

/// First step of the walk, cells: on a wall of 10⁶ the next minimum is not far.
const STEP: f64 = 1e-9;
/// A neighbouring patch must lead at least this far, cells.
const LEAST_WAY: f64 = 1e-11;
/// Patches at most.
const PATCHES: usize = 10_000;

/// A local closest point.
#[derive(Clone, Copy, Debug)]
pub struct Closest {
    /// The point.
    pub at: [f64; 3],
    /// Its distance from the HIP.
    pub distance: f64,
    /// Patches gone through.
    pub patches: usize,
}

/// Descends from a place in a patch.
#[must_use]
pub fn from(field: &impl Corners, hip: [f64; 3], start: [f64; 2], patch: Patch) -> Closest {
    let (mut patch, mut at) = (patch, start);
    let mut patches = 1;
    loop {
        at = descend(&patch, hip, at);
        let here = squared(&patch, hip, at);
        let next = neighbours(field, &patch, at)
            .filter_map(|there| {
                let end = descend(&there, hip, at);
                let moved = (end[0] - at[0]).abs().max((end[1] - at[1]).abs());
                let f = squared(&there, hip, end);
                (moved > LEAST_WAY && f < here).then_some((f, there))
            })
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match next {
            Some((_, there)) if patches < PATCHES => patch = there,
            _ => break,
        }
        patches += 1;
    }
    let at = [at[0], at[1], patch.height(at[0], at[1])];
    Closest {
        at,
        distance: distance(at, hip),
        patches,
    }
}

/// The other patches that share a point.
fn neighbours<'f, F: Corners>(
    field: &'f F,
    patch: &Patch,
    at: [f64; 2],
) -> impl Iterator<Item = Patch> + use<'f, F> {
    let side = |axis: usize| {
        let local = at[axis] - f64::from(patch.cell[axis]);
        i32::from(local == 1.0) - i32::from(local == 0.0)
    };
    let (cell, [east, north]) = (patch.cell, [side(0), side(1)]);
    let mut shifts = vec![[east, 0], [0, north], [east, north]];
    shifts.retain(|shift| *shift != [0, 0]);
    shifts.dedup(); // on an edge, two of them are the same
    shifts
        .into_iter()
        .filter_map(move |shift| Patch::at(field, [cell[0] + shift[0], cell[1] + shift[1]]))
}

fn squared(patch: &Patch, hip: [f64; 3], [x, y]: [f64; 2]) -> f64 {
    distance([x, y, patch.height(x, y)], hip).powi(2)
}

/// Downhill inside one patch.
fn descend(patch: &Patch, hip: [f64; 3], start: [f64; 2]) -> [f64; 2] {
    let line = Line { patch, hip };
    // The steeper direction in closed form: it is the one that needs it.
    let [east, north] = patch.slopes(start[0], start[1]);
    if north.abs() > east.abs() {
        let x = line.bottom(1, start[0]);
        return [x, line.best(1, x)];
    }
    let y = line.bottom(0, start[1]);
    [line.best(0, y), y]
}

/// The squared distance as a function of one coordinate, the other (`axis`)
/// being the best for it.
struct Line<'p> {
    patch: &'p Patch,
    hip: [f64; 3],
}

impl Line<'_> {
    /// The best coordinate along `axis` with the other one fixed.
    fn best(&self, axis: usize, fixed: f64) -> f64 {
        self.nearest(axis, fixed).0
    }

    /// That coordinate, and the height above the HIP there.
    ///
    /// Up a wall of slope m the height of the place is exact only to m units in its
    /// last place; that of the closed form to one.
    fn nearest(&self, axis: usize, fixed: f64) -> (f64, f64) {
        let low = f64::from(self.patch.cell[axis]);
        let above = |along: f64| {
            let [x, y] = place(axis, along, fixed);
            self.patch.height(x, y) - self.hip[2]
        };
        let [x, y] = place(axis, low, fixed);
        let m = self.patch.slopes(x, y)[axis];
        let p = self.hip[axis] - low;
        let z = (above(low) + m * p) / (1.0 + m * m);
        let free = p - m * z;
        if (0.0..=1.0).contains(&free) {
            return (low + free, z);
        }
        let end = low + free.clamp(0.0, 1.0);
        (end, above(end))
    }

    /// Half the slope of F.
    fn slope(&self, axis: usize, fixed: f64) -> f64 {
        let (along, z) = self.nearest(axis, fixed);
        let [x, y] = place(axis, along, fixed);
        (fixed - self.hip[1 - axis]) + z * self.patch.slopes(x, y)[1 - axis]
    }

    /// Downhill from `start` to where F turns.
    fn bottom(&self, axis: usize, start: f64) -> f64 {
        let low = f64::from(self.patch.cell[1 - axis]);
        let slope = self.slope(axis, start);
        if slope == 0.0 {
            return start;
        }
        let down = -slope.signum();
        let (mut near, mut step) = (start, STEP);
        loop {
            let far = (near + down * step).clamp(low, low + 1.0);
            if far == near {
                return near; // at the end of the patch, still downhill
            }
            if self.slope(axis, far) * down >= 0.0 {
                return self.halve(axis, near, far, down);
            }
            near = far;
            step = (step * 1.5).min(1.0 / 32.0);
        }
    }

    fn halve(&self, axis: usize, mut near: f64, mut far: f64, down: f64) -> f64 {
        for _ in 0..80 {
            let middle = 0.5 * (near + far);
            if middle == near || middle == far {
                break;
            }
            if self.slope(axis, middle) * down >= 0.0 {
                far = middle;
            } else {
                near = middle;
            }
        }
        // The end of the interval where F is less; beside a border that is one.
        let at_near = self.slope(axis, near).abs() < self.slope(axis, far).abs();
        if at_near { near } else { far }
    }
}

fn place(axis: usize, along: f64, fixed: f64) -> [f64; 2] {
    if axis == 0 {
        [along, fixed]
    } else {
        [fixed, along]
    }
}
