//! The cells under a straight path, in order.

use crate::contact::surface::patch::Patch;
use crate::contact::surface::{Side, SurfacePoint};
use crate::contact::tolerance::TINY_STEP;
use crate::grid::{Cell, GridPoint};
use crate::scalar::larger;
use crate::terrain::{CellContent, Window};

/// The part of a path over one cell.
pub(super) struct PathSegment {
    pub(super) cell: Cell,
    /// Start and end of the part in the cell, `[0, 1]`.
    from: (f32, f32),
    to: (f32, f32),
    /// Heights above the start of the path, cells.
    z_from: f32,
    z_to: f32,
}

impl PathSegment {
    /// Returns true if the part is too short to reach other ground than at its start, and not
    /// downward.
    pub(super) fn is_tiny(&self) -> bool {
        (self.to.0 - self.from.0)
            .abs()
            .max((self.to.1 - self.from.1).abs())
            < TINY_STEP
            && self.z_from - self.z_to < TINY_STEP
    }

    /// Returns the patch's height over the path, cells, as Bernstein coefficients.
    #[inline]
    pub(super) fn gap(&self, patch: &Patch) -> [f32; 3] {
        [
            patch.height(self.from.0, self.from.1) - self.z_from,
            patch.blossom(self.from, self.to) - 0.5 * (self.z_from + self.z_to),
            patch.height(self.to.0, self.to.1) - self.z_to,
        ]
    }

    /// Returns the direction to the cells in the west and south that share part of this segment on
    /// their border: a patch includes its east and north borders.
    pub(super) fn sharing(&self) -> Side {
        Side::sharing(self.to.0, self.to.1)
    }

    /// Returns this part relative to the cell on that side, on whose border it is: the whole part,
    /// or only its end.
    pub(super) fn on_border_of(&self, side: Side) -> Self {
        let is_along_border =
            (side.east == 0 || self.from.0 == 0.0) && (side.north == 0 || self.from.1 == 0.0);
        let (from, z_from) = match is_along_border {
            true => (self.from, self.z_from),
            false => (self.to, self.z_to),
        };
        let relative = |(u, v): (f32, f32)| (u - side.east as f32, v - side.north as f32);
        Self {
            cell: self.cell.offset(side.east, side.north),
            from: relative(from),
            to: relative(self.to),
            z_from,
            z_to: self.z_to,
        }
    }

    /// Returns true if the part is a single point.
    pub(super) fn is_point(&self) -> bool {
        self.from == self.to && self.z_from == self.z_to
    }

    /// Returns the point of the surface under a fraction of this part.
    pub(super) fn point(&self, s: f32) -> SurfacePoint {
        let between = |a: f32, b: f32| (a + s * (b - a)).clamp(0.0, 1.0);
        SurfacePoint {
            cell: self.cell,
            u: between(self.from.0, self.to.0),
            v: between(self.from.1, self.to.1),
        }
    }
}

/// Returns the content beside a segment over no-data: a patch on whose border it is, or no-data.
#[inline(never)]
pub(super) fn beside<const D: usize>(
    window: &Window<'_, D>,
    segment: PathSegment,
) -> (PathSegment, CellContent) {
    for index in 0..3 {
        let side = segment.sharing().neighbour(index);
        if side == Side::NONE {
            continue;
        }
        let other = segment.on_border_of(side);
        let ground = window.ground(other.cell);
        if ground != CellContent::NoData {
            return (other, ground);
        }
    }
    (segment, CellContent::NoData)
}

/// The cells under a straight path, in order; each begins exactly where the one before ended, so
/// that the path has no gap between them.
pub(super) struct PathSegments {
    east: Axis,
    north: Axis,
    from: (f32, f32),
    /// Heights above the start of the path, cells: where it ends, and where the last segment ended.
    z_end: f32,
    z_from: f32,
    done: bool,
}

impl PathSegments {
    /// Creates the segments of a path.
    pub(super) fn between(at: &GridPoint, end: &GridPoint) -> Self {
        let axis = |axis: usize| {
            let (first, last) = (at.cell()[axis], end.cell()[axis]);
            let end = last.wrapping_sub(first) as f32 + end.frac()[axis];
            Axis::new(first, last, [at.frac()[axis], end])
        };
        let (east, north) = (axis(0), axis(1));
        Self {
            from: (east.at(0.0), north.at(0.0)),
            east,
            north,
            z_end: at.to(end).z,
            z_from: 0.0,
            done: false,
        }
    }

    /// Returns true if the last cell was returned.
    pub(super) fn is_done(&self) -> bool {
        self.done
    }

    #[inline]
    pub(super) fn next(&mut self) -> Option<PathSegment> {
        if self.done {
            return None;
        }
        let Self { east, north, .. } = self;
        let cell = Cell::new(east.square, north.square);
        let (from, z_from) = (self.from, self.z_from);
        let (to, z_to);
        if east.left | north.left == 0 {
            self.done = true;
            (to, z_to) = ((east.end_in_square(), north.end_in_square()), self.z_end);
        } else if east.t <= north.t {
            let (t, u, v) = (east.t, east.ahead(), north.at(east.t));
            (to, z_to) = ((u, v), self.z_end * t);
            self.from = (1.0 - u, v);
            east.cross();
        } else {
            let (t, u, v) = (north.t, east.at(north.t), north.ahead());
            (to, z_to) = ((u, v), self.z_end * t);
            self.from = (u, 1.0 - v);
            north.cross();
        }
        self.z_from = z_to;
        Some(PathSegment {
            cell,
            from,
            to,
            z_from,
            z_to,
        })
    }
}

/// The squares of a lattice that a path passes along one axis. Places are in sides of a square from
/// the first square's lower border.
struct Axis {
    start: f32,
    end: f32,
    travel: f32,
    inv_travel: f32,
    /// Current square, its lower border, and the number of squares after it.
    square: i32,
    floor: f32,
    left: u32,
    /// Direction of travel, +1 or −1.
    toward: i32,
    /// Fraction of the path at which it reaches the next border; infinite if the path ends before.
    t: f32,
}

impl Axis {
    /// Creates an axis from the first square to the last; both places are relative to the first.
    #[inline]
    fn new(first: i32, last: i32, [start, end]: [f32; 2]) -> Self {
        let travel = end - start;
        let mut axis = Self {
            start,
            end,
            travel,
            inv_travel: 1.0 / travel,
            square: first,
            floor: 0.0,
            left: first.abs_diff(last),
            toward: if last < first { -1 } else { 1 },
            t: f32::INFINITY,
        };
        axis.update_crossing();
        axis
    }

    /// Crosses the border ahead.
    #[inline]
    fn cross(&mut self) {
        self.square = self.square.wrapping_add(self.toward);
        self.floor += self.toward as f32;
        self.left -= 1;
        self.update_crossing();
    }

    #[inline]
    fn update_crossing(&mut self) {
        self.t = f32::INFINITY;
        if self.left > 0 {
            let t = (self.floor + self.ahead() - self.start) * self.inv_travel;
            // A path that ends on its border may have nothing left: 0·∞.
            self.t = if t <= 1.0 { larger(t, 0.0) } else { 1.0 };
        }
    }

    /// Returns the coordinate, in a square, of the border ahead.
    #[inline]
    fn ahead(&self) -> f32 {
        if self.toward > 0 { 1.0 } else { 0.0 }
    }

    /// Returns the coordinate in the square after a fraction of the path.
    #[inline]
    fn at(&self, t: f32) -> f32 {
        (self.start + self.travel * t - self.floor).clamp(0.0, 1.0)
    }

    /// Returns the coordinate in the last square where the path ends.
    #[inline]
    fn end_in_square(&self) -> f32 {
        (self.end - self.floor).clamp(0.0, 1.0)
    }
}
