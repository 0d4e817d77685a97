//! Over which edge or corner of a patch the way downhill leads on.
//!
//! Where the squared distance is convex all over a patch, a point of an edge from
//! which it falls out of the patch is the patch's minimum; so is a corner from
//! which it falls over both edges.

use super::gentle::Gentle;
use super::patch::Patch;
use super::spot::{Spot, is_inside};

/// Slope of half the squared distance, in cells, below which it is not certain
/// which way is downhill.
pub(super) const LEVEL: f32 = 1e-5;

/// On which sides of a patch a place is beyond it: −1, 0 or 1 eastward and
/// northward.
pub(super) fn beyond((u, v): (f32, f32)) -> [i32; 2] {
    [u, v].map(|x| match () {
        () if is_inside(x) => 0,
        () if x > 0.5 => 1,
        () => -1,
    })
}

/// The patch's minimum of the distance to a hand at `(p, q)`, if it lies on the
/// border toward these sides.
#[inline(always)]
pub(super) fn over_border(
    gentle: &Gentle,
    patch: &Patch,
    hand: (f32, f32),
    cell: [i32; 2],
    sides: [i32; 2],
) -> Option<Exit> {
    match sides {
        [_, 0] | [0, _] => on_edge(gentle, patch, hand, cell, sides),
        corner => over_corner(gentle, patch, hand, cell, corner),
    }
}

/// The same of a hand beyond a corner.
#[inline(never)]
fn over_corner(
    gentle: &Gentle,
    patch: &Patch,
    hand: (f32, f32),
    cell: [i32; 2],
    [east, north]: [i32; 2],
) -> Option<Exit> {
    let edges = [[east, 0], [0, north]];
    let exit = |edge| on_edge(gentle, patch, hand, cell, edge);
    edges.into_iter().find_map(exit)
}

/// The same, if it lies on this edge, its corners included.
#[inline(always)]
pub(super) fn on_edge(
    gentle: &Gentle,
    patch: &Patch,
    hand: (f32, f32),
    cell: [i32; 2],
    edge: [i32; 2],
) -> Option<Exit> {
    let exit = Exit::nearest(patch, hand, cell, edge);
    let is_above = exit.z >= 0.0 && gentle.is_convex(exit.z);
    (is_above && exit.slope(patch, hand) < -LEVEL).then_some(exit)
}

/// A way out of a patch, or into one: a point of its border and the direction,
/// −1, 0 or 1 eastward and northward, over an edge or a corner.
#[derive(Clone, Copy)]
pub(super) struct Exit {
    pub(super) at: Spot,
    /// Its height above the hand, cells.
    pub(super) z: f32,
    shift: [i32; 2],
}

impl Exit {
    /// Over the point of an edge closest to a hand at `(p, q)`: over a corner, if
    /// that is one of its ends.
    #[inline(always)]
    fn nearest(patch: &Patch, (p, q): (f32, f32), cell: [i32; 2], [east, north]: [i32; 2]) -> Self {
        let [sw, se, nw, ne] = patch.corners;
        let side = |toward: i32| usize::from(toward > 0);
        let (u, v, z, shift);
        if north == 0 {
            let column = side(east);
            let ends = if column == 0 { [sw, nw] } else { [se, ne] };
            let (foot, end, height) = foot(q, patch.c[column], ends);
            (u, v, z, shift) = (column as f32, foot, height, [east, end]);
        } else {
            let row = side(north);
            let ends = if row == 0 { [sw, se] } else { [nw, ne] };
            let (foot, end, height) = foot(p, patch.b[row], ends);
            (u, v, z, shift) = (foot, row as f32, height, [end, north]);
        }
        let at = Spot { cell, u, v };
        Self { at, z, shift }
    }

    /// The same as the patch beyond sees it.
    #[inline]
    pub(super) fn across(&self) -> Self {
        self.over(self.shift)
    }

    /// The way from the same place over another border.
    #[inline]
    pub(super) fn over(&self, shift: [i32; 2]) -> Self {
        Self {
            at: self.at.across(shift),
            shift,
            ..*self
        }
    }

    #[inline]
    pub(super) fn is_corner(&self) -> bool {
        self.shift[0] != 0 && self.shift[1] != 0
    }

    /// Over the two edges that meet in a corner.
    #[inline]
    pub(super) fn edges(&self) -> [[i32; 2]; 2] {
        let [east, north] = self.shift;
        [[east, 0], [0, north]]
    }

    /// Slope of half the squared distance that way over a patch, to a hand at
    /// `(p, q)`; over a corner the larger one of the two along the edges.
    #[inline(always)]
    pub(super) fn slope(&self, patch: &Patch, (p, q): (f32, f32)) -> f32 {
        let Spot { u, v, .. } = self.at;
        let [east, north] = self.shift;
        let eastward = || east as f32 * ((u - p) + self.z * patch.slope_u(v));
        let northward = || north as f32 * ((v - q) + self.z * patch.slope_v(u));
        match self.shift {
            [_, 0] => eastward(),
            [0, _] => northward(),
            _ => {
                let (one, other) = (eastward(), northward());
                if one > other { one } else { other }
            }
        }
    }
}

/// The point of an edge, between two heights above the hand, closest to a hand so
/// far along it; which end that is, −1 or 1, or 0; and its height.
#[inline(always)]
fn foot(hand: f32, slope: f32, [start, end]: [f32; 2]) -> (f32, i32, f32) {
    // From the edge's end: the line's height above a far hand would cancel.
    let x = (hand - slope * start) / (1.0 + slope * slope);
    match () {
        () if is_inside(x) => (x, 0, start * (1.0 - x) + end * x),
        () if x > 0.5 => (1.0, 1, end),
        () => (0.0, -1, start),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sought from the edge's line above a hand 1,170 cells off it was 7e-3 beside.
    #[test]
    fn a_far_hand_finds_the_closest_point_of_an_edge() {
        let patch = Patch::new([620.019, 621.900_7, 619.995_4, 621.877_14]);
        let exit = Exit::nearest(&patch, (1171.0, -13.642_913), [0, 0], [0, 1]);
        let [low, high] = [patch.corners[2], patch.corners[3]].map(f64::from);
        let slope = high - low;
        let truth = (1171.0 - slope * low) / (1.0 + slope * slope);
        let error = f64::from(exit.at.u) - truth;
        assert!(error.abs() < 1e-4, "{error:e}");
    }
}
