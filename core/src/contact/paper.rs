//! The paper's own rule (§4.3), kept as the reference to compare with.
//!
//! It differs from the swept contact where the paper says so itself: a patch
//! is a candidate by the lowest height of the whole segment, so the first
//! candidate may not be the first one hit; and only the sign of the closest
//! point decides about contact, so a fast sweep passes through a thin peak
//! (figure 8). The local closest point is found as everywhere in the product
//! ([`super::closest_point`]), not by plain Newton, which would also lose contacts.

use glam::Vec3;

use super::budget::{Budget, CELL};
use super::surface::{HipView, SurfacePoint};
use crate::grid::{Cell, GridPoint};
use crate::terrain::{Ground, TileIndex, Window};

/// Cells under a segment that are looked at for a candidate, at most: a HIP that
/// moves farther in a tick passes through whatever comes after.
const CANDIDATES: u32 = 4096;

/// What the look for a candidate came to.
pub(super) enum Candidate {
    /// The first patch whose highest corner is above the segment's lowest height,
    /// and the place in it to begin at.
    At(SurfacePoint),
    /// None: the proxy is the HIP.
    None,
    /// A tile that is not here.
    Missing(TileIndex),
    /// The budget is spent.
    Suspended,
}

/// Step 1, under way: the cells under a segment, by an incremental line algorithm.
#[derive(Clone, Debug)]
pub(super) struct Candidates {
    /// The segment's ends.
    pub(super) from: GridPoint,
    pub(super) to: GridPoint,
    /// The cell to look at next.
    cell: Cell,
    /// +1, −1 or 0: where the segment leads, eastward and northward.
    step: [i32; 2],
    /// Fractions of the segment at which the next border is reached.
    next: [f32; 2],
    /// Fractions from border to border.
    each: [f32; 2],
    /// Cells still to look at.
    left: u32,
}

impl Candidates {
    pub(super) fn between(from: GridPoint, to: GridPoint) -> Self {
        let way = from.to(&to);
        let (start, first, last) = (from.frac(), from.column(), to.column());
        let step = [(last.x - first.x).signum(), (last.y - first.y).signum()];
        let each = [way.x.abs().recip(), way.y.abs().recip()];
        let reached = |start: f32, axis: usize| match step[axis] {
            0 => f32::INFINITY,
            1 => (1.0 - start) * each[axis],
            _ => start * each[axis],
        };
        let cells = first.x.abs_diff(last.x) + first.y.abs_diff(last.y) + 1;
        Self {
            from,
            to,
            cell: first,
            step,
            next: [reached(start.x, 0), reached(start.y, 1)],
            each,
            left: cells.min(CANDIDATES),
        }
    }

    /// Goes on to the first candidate.
    pub(super) fn find<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        budget: &mut Budget,
    ) -> Candidate {
        let is_rising = self.from.is_below(&self.to);
        let low = HipView::new(if is_rising { self.from } else { self.to });
        if low.altitude().cell() >= window.top() {
            return Candidate::None;
        }
        while self.left > 0 {
            if !budget.has(CELL) {
                return Candidate::Suspended;
            }
            budget.spend(CELL);
            match window.ground(self.cell) {
                Ground::Patch(corners) if low.is_below_any(&corners) => {
                    let (p, q) = HipView::new(self.to).in_patch(self.cell);
                    return Candidate::At(SurfacePoint {
                        cell: self.cell,
                        u: p.clamp(0.0, 1.0),
                        v: q.clamp(0.0, 1.0),
                    });
                }
                Ground::Missing => return Candidate::Missing(TileIndex::holding(self.cell)),
                Ground::Patch(_) | Ground::Hole => self.pass(),
            }
        }
        Candidate::None
    }

    /// Goes on to the next cell.
    fn pass(&mut self) {
        let last = self.to.column();
        let Cell { x, y } = self.cell;
        let eastward = y == last.y || (x != last.x && self.next[0] <= self.next[1]);
        if eastward {
            self.cell.x += self.step[0];
            self.next[0] += self.each[0];
        } else {
            self.cell.y += self.step[1];
            self.next[1] += self.each[1];
        }
        self.left -= 1;
    }
}

/// Step 3: whether the HIP is inside, by the sign of (LCP − HIP)·n, n averaged over
/// the patches that share the edge or vertex; the local closest point (LCP) is `z`
/// cells above the HIP.
pub(super) fn is_inside<const D: usize>(
    window: &Window<'_, D>,
    view: &HipView,
    closest: &SurfacePoint,
    z: f32,
) -> bool {
    let mut normal = Vec3::ZERO;
    for side in closest.border().itself_and_neighbours() {
        let point = closest.across(side);
        if let Ground::Patch(corners) = window.ground(point.cell) {
            normal += unit(view.patch(&corners).normal(point.u, point.v));
        }
    }
    view.displacement(closest, z).dot(normal) > 0.0
}

fn unit(v: Vec3) -> Vec3 {
    v / libm::sqrtf(v.length_squared())
}
