//! The cells under a segment, in order (Amanatides & Woo 1987).

use super::real::Real;

/// Iterator over the cells from one point to another.
pub struct Line<R> {
    cell: [i32; 2],
    step: [i32; 2],
    /// Part of the segment up to the next border.
    next: [R; 2],
    each: [R; 2],
    left: u32,
}

impl<R: Real> Line<R> {
    /// Creates an iterator from one point to another.
    #[must_use]
    #[inline]
    pub fn new(from: [R; 2], to: [R; 2]) -> Self {
        let cell = from.map(R::whole);
        let last = to.map(R::whole);
        let axis = |i: usize| {
            let distance = to[i] - from[i];
            let each = R::one() / distance.abs();
            let inside = from[i] - R::from_whole(cell[i]);
            let first = if distance > R::zero() {
                R::one() - inside
            } else {
                inside
            };
            ((last[i] - cell[i]).signum(), first * each, each)
        };
        let ((sx, nx, ex), (sy, ny, ey)) = (axis(0), axis(1));
        Self {
            cell,
            step: [sx, sy],
            next: [nx, ny],
            each: [ex, ey],
            left: last[0].abs_diff(cell[0]) + last[1].abs_diff(cell[1]) + 1,
        }
    }
}

impl<R: Real> Iterator for Line<R> {
    type Item = [i32; 2];

    #[inline]
    fn next(&mut self) -> Option<[i32; 2]> {
        self.left = self.left.checked_sub(1)?;
        let here = self.cell;
        let east = self.step[1] == 0 || (self.step[0] != 0 && self.next[0] <= self.next[1]);
        let axis = usize::from(!east);
        self.cell[axis] += self.step[axis];
        self.next[axis] = self.next[axis] + self.each[axis];
        Some(here)
    }
}
