//! The first true crossing of the HIP's path with the bilinear surface.
//!
//! The path is halved until a piece is known to be clear, by one look at the
//! maximum pyramid or by a look along it (`look_ahead`), or is short enough to be
//! intersected cell by cell. Half-way points are exact to 2⁻²⁴ cell at any
//! distance, so a sweep of thousands of cells is as accurate as one of a tenth, and
//! one that hits nothing costs the logarithm of its length. Pieces are always the
//! same halves of halves, so a sweep that runs out of budget or meets a missing tile
//! goes on later to the same bits.

use heapless::Vec;

use super::cells::{Steps, beside};
use super::intersect::{first_crossing, next_crossing};
use super::look_ahead::look_along;
use crate::contact::budget::{BOX, Budget, HALF, INTERSECTION};
use crate::contact::surface::{HipView, SurfacePoint};
use crate::grid::{Altitude, Cell, GridPoint};
use crate::terrain::{CellBox, Ground, TileIndex, Window};

/// Most columns, or rows, that a piece which is intersected cell by cell goes on
/// from its first: it is over nine cells at most, which a tick's budget is enough
/// for.
const WALK_CELLS: u32 = 4;
/// Tallest piece, in cells, that is intersected.
const WALK_HEIGHT: u32 = 16;
/// Longest piece, in cells along an axis, that is looked along at once.
const LOOK_CELLS: u32 = 64;
/// Halvings that bring the longest possible path down to a walk, and two: where the
/// path began, and where it leads since the HIP has moved.
const DEPTH: usize = 31;

/// How a sweep ended.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) enum Swept {
    /// The whole path is free.
    Clear,
    /// The path goes through the surface from above here.
    Hit(SurfacePoint),
    /// The path enters the solid from the side, out of a hole or over the
    /// border of the data: nothing was crossed from above.
    Under,
    /// A tile on the path is not here.
    Missing(TileIndex),
    /// The budget is spent.
    Suspended,
}

impl Swept {
    /// The tile that is not here.
    pub(in crate::contact) const fn missing_tile(&self) -> Option<TileIndex> {
        match self {
            Self::Missing(tile) => Some(*tile),
            _ => None,
        }
    }
}

/// A sweep under way: where the proxy has come, and what is still to do.
#[derive(Clone, Debug)]
pub(in crate::contact) struct Path {
    /// As far as the path is known to be free.
    at: GridPoint,
    /// Ends of the pieces still to do, the last one first.
    ends: Vec<GridPoint, DEPTH>,
    /// The fraction of the first piece that is known to be clear, while the rest is
    /// being halved.
    clear: Option<f32>,
    /// The path starts on the surface and leaves it.
    on_surface: bool,
    /// The last cell passed holds no patch: a hole, or beyond the data.
    over_hole: bool,
    /// A tile is waited for, and not work.
    is_missing: bool,
}

impl Path {
    /// A path through the air.
    pub(in crate::contact) fn through_air(from: GridPoint, to: GridPoint) -> Self {
        Self::new(from, to, false)
    }

    /// A path that leaves the surface at `from`.
    pub(in crate::contact) fn off_surface(from: GridPoint, to: GridPoint) -> Self {
        Self::new(from, to, true)
    }

    fn new(from: GridPoint, to: GridPoint, on_surface: bool) -> Self {
        let mut ends = Vec::new();
        // Capacity is DEPTH > 1.
        let _ = ends.push(to);
        Self {
            at: from,
            ends,
            clear: None,
            on_surface,
            over_hole: false,
            is_missing: false,
        }
    }

    /// The path leads to another place from now on.
    ///
    /// A piece that work has begun on is gone through first if it leads nearer to there: if
    /// it were given up whenever the HIP moves, a piece that takes more than a tick would
    /// never come to its end. One that waits for a tile is given up; the new path may not
    /// need it.
    #[inline(never)]
    pub(in crate::contact) fn redirect(&mut self, to: GridPoint) {
        let leads_on =
            |end: &GridPoint| !self.is_missing && HipView::new(to).is_nearer(end, &self.at);
        let begun = self.ends.last().copied().filter(leads_on);
        self.ends.clear();
        // Capacity is DEPTH > 2.
        let _ = self.ends.push(to);
        match begun {
            Some(end) => drop(self.ends.push(end)),
            None => self.clear = None,
        }
    }

    /// A path that has just begun, to another end.
    pub(in crate::contact) fn begin_toward(&mut self, to: GridPoint) {
        self.ends.clear();
        // Capacity is DEPTH > 1.
        let _ = self.ends.push(to);
        self.clear = None;
    }

    /// How far the path is known to be free.
    pub(in crate::contact) const fn at(&self) -> GridPoint {
        self.at
    }

    /// Sweeps on until something ends it.
    pub(in crate::contact) fn advance<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        budget: &mut Budget,
    ) -> Swept {
        self.is_missing = false;
        while !self.ends.is_empty() {
            if !self.halve(window, budget) || !budget.has(BOX) {
                return Swept::Suspended;
            }
            budget.spend(BOX);
            let Some(&end) = self.ends.last() else { break };
            let around = CellBox::around(self.at.column(), end.column());
            let span = with_borders(around, &end);
            let low = lower(&self.at, &end);
            if window.is_clear(span, low) || window.is_clear_nearby(around, low) {
                // Above all that is around, so only the field's border matters.
                self.over_hole = !window.has_cell(end.column());
                self.on_surface = false;
            } else if self.is_walked(&end) {
                if let Some(ended) = self.walk(window, end, budget) {
                    return ended;
                }
            } else if longer_side(around) > LOOK_CELLS {
                // Not full: such a piece is walked.
                let _ = self.ends.push(self.at.midpoint(&end));
                continue;
            } else {
                if let Err(clear) = look_along(window, &self.at, &end, budget) {
                    self.clear = Some(clear);
                    continue;
                }
                self.passes(window, self.at, end);
            }
            self.at = end;
            self.ends.pop();
        }
        Swept::Clear
    }

    /// Goes on through the part of the first piece that is known to be clear, and
    /// halves what follows down to a walk; `false` where the budget is spent.
    fn halve<const D: usize>(&mut self, window: &Window<'_, D>, budget: &mut Budget) -> bool {
        while let (Some(clear), Some(&end)) = (self.clear, self.ends.last()) {
            if self.is_walked(&end) {
                self.clear = None;
                break;
            }
            if !budget.has(HALF) {
                return false;
            }
            budget.spend(HALF);
            let middle = self.at.midpoint(&end);
            if clear >= 0.5 {
                self.passes(window, self.at, middle);
                self.at = middle;
                self.clear = Some(2.0 * clear - 1.0);
            } else {
                // Not full: such a piece is walked.
                let _ = self.ends.push(middle);
                self.clear = Some(2.0 * clear);
            }
        }
        true
    }

    /// Whether the piece up to `end` is intersected cell by cell: it is short, and
    /// in height, too, which would otherwise cost bits.
    fn is_walked(&self, end: &GridPoint) -> bool {
        let span = CellBox::around(self.at.column(), end.column());
        let is_low = self.at.cell()[2].abs_diff(end.cell()[2]) <= WALK_HEIGHT;
        (longer_side(span) <= WALK_CELLS && is_low) || self.ends.is_full()
    }

    /// The path is clear from one place to another.
    fn passes<const D: usize>(&mut self, window: &Window<'_, D>, from: GridPoint, to: GridPoint) {
        // On a border, what was passed is the cell before it.
        let way = from.to(&to);
        let [x, y] = [0, 1].map(|axis| {
            let enters = to.frac()[axis] == 0.0 && way[axis] > 0.0;
            to.cell()[axis] - i32::from(enters)
        });
        self.over_hole = window.ground(Cell::new(x, y)) == Ground::Hole;
        self.on_surface = false;
    }

    /// Intersects the cells of one short piece.
    fn walk<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        end: GridPoint,
        budget: &mut Budget,
    ) -> Option<Swept> {
        let view = HipView::new(self.at);
        let mut over_hole = self.over_hole;
        let mut on_surface = self.on_surface;
        let mut steps = Steps::between(&self.at, &end);
        while let Some(mut step) = steps.next() {
            if !budget.has(INTERSECTION) {
                return Some(Swept::Suspended);
            }
            budget.spend(INTERSECTION);
            let is_last = steps.is_done() && self.ends.len() == 1;
            if on_surface && step.is_tiny() && !is_last {
                // A corner of a cell, or of a hole, touched on leaving an edge.
                continue;
            }
            let mut ground = window.ground(step.cell);
            if ground == Ground::Hole {
                (step, ground) = beside(window, step);
                over_hole |= step.is_point();
            }
            let patch = match ground {
                Ground::Patch(corners) => view.patch(&corners),
                Ground::Missing => {
                    self.is_missing = true;
                    return Some(Swept::Missing(TileIndex::holding(step.cell)));
                }
                Ground::Hole => {
                    over_hole = true;
                    on_surface = false;
                    continue;
                }
            };
            let [start, middle, after] = step.gap(&patch);
            if over_hole && start >= 0.0 {
                return Some(Swept::Under);
            }
            let crossing = if on_surface && middle < 0.0 {
                next_crossing(middle, after)
            } else {
                first_crossing(start, middle, after)
            };
            if let Some(s) = crossing {
                return Some(Swept::Hit(step.point(s)));
            }
            (over_hole, on_surface) = (false, false);
        }
        (self.over_hole, self.on_surface) = (over_hole, false);
        None
    }
}

/// The cells under a piece of a path, and those on whose border it ends.
fn with_borders(mut span: CellBox, end: &GridPoint) -> CellBox {
    if end.is_on_grid_line() {
        // A cell more than need be does no harm.
        span.from = span.from.offset(-1, -1);
    }
    span
}

/// The lower end of a path.
#[inline]
pub(in crate::contact) fn lower(a: &GridPoint, b: &GridPoint) -> Altitude {
    let low = if a.is_below(b) { a } else { b };
    Altitude::new(low.cell()[2], low.frac().z)
}

/// Columns or rows, whichever are more, that a box goes beyond its first.
fn longer_side(span: CellBox) -> u32 {
    let columns = span.to.x.abs_diff(span.from.x);
    let rows = span.to.y.abs_diff(span.from.y);
    columns.max(rows)
}
