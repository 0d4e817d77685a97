//! The exact local closest point: descent from a point until no direction leads nearer.
//!
//! At a fixed y a patch is a straight line, so its nearest point is known in closed form, and the
//! squared distance is a function F of y alone. The search follows F downhill in small steps until
//! its slope changes sign, bisects that interval to the precision of f64, and continues in the next
//! patch if that leads nearer. Slow and simple.

use super::surface::{Corners, Patch, distance};

/// First step of the descent, cells: on a slope of 10⁶ the next minimum is close.
const STEP: f64 = 1e-9;
/// Least motion into a neighbouring patch, cells.
const MIN_DISPLACEMENT: f64 = 1e-11;
/// Most patches.
const PATCHES: usize = 10_000;

/// A local closest point.
#[derive(Clone, Copy, Debug)]
pub struct Closest {
    /// The point.
    pub at: [f64; 3],
    /// Its distance from the HIP.
    pub distance: f64,
    /// Number of patches visited.
    pub patches: usize,
}

/// Descends from a point in a patch.
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
                (moved > MIN_DISPLACEMENT && f < here).then_some((f, there))
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

/// Returns the other patches that share a point.
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
    shifts.dedup(); // on an edge, two of them are equal
    shifts
        .into_iter()
        .filter_map(move |shift| Patch::at(field, [cell[0] + shift[0], cell[1] + shift[1]]))
}

fn squared(patch: &Patch, hip: [f64; 3], [x, y]: [f64; 2]) -> f64 {
    distance([x, y, patch.height(x, y)], hip).powi(2)
}

/// Descends inside one patch.
fn descend(patch: &Patch, hip: [f64; 3], start: [f64; 2]) -> [f64; 2] {
    let line = Line { patch, hip };
    // The steeper direction uses the closed form, because it needs the precision.
    let [east, north] = patch.slopes(start[0], start[1]);
    if north.abs() > east.abs() {
        let x = line.bottom(1, start[0]);
        return [x, line.best(1, x)];
    }
    let y = line.bottom(0, start[1]);
    [line.best(0, y), y]
}

/// The squared distance as a function of one coordinate, minimised over the other (`axis`).
struct Line<'p> {
    patch: &'p Patch,
    hip: [f64; 3],
}

impl Line<'_> {
    /// Returns the best coordinate along `axis` with the other one fixed.
    fn best(&self, axis: usize, fixed: f64) -> f64 {
        self.nearest(axis, fixed).0
    }

    /// Returns that coordinate, and the height above the HIP there.
    ///
    /// On a slope m the height from the position has an error of m units in the last place, that
    /// from the closed form one unit.
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

    /// Returns half the slope of F.
    fn slope(&self, axis: usize, fixed: f64) -> f64 {
        let (along, z) = self.nearest(axis, fixed);
        let [x, y] = place(axis, along, fixed);
        (fixed - self.hip[1 - axis]) + z * self.patch.slopes(x, y)[1 - axis]
    }

    /// Descends from `start` to the point where the slope of F changes sign.
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
                return near; // at the border of the patch, still downhill
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
        // The end of the interval with the smaller F; next to a border it is the border.
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
