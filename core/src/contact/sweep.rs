//! The first true crossing of the hand's way with the bilinear surface.
//!
//! The segment is halved until a piece is known to be clear, by one look at the
//! maximum pyramid or by a look along it (`reach`), or is short enough to walk
//! cell by cell. Half-way points are exact to 2⁻²⁴ cell at any distance, so a
//! sweep of thousands of cells is as accurate as one of a tenth, and one that
//! hits nothing costs the logarithm of its length. The pieces still to do are
//! kept, so a sweep that runs out of work or meets a missing tile goes on later
//! at the very same piece.

use heapless::Vec;

use super::crossing::{first_crossing, next_crossing};
use super::reach::look_along;
use super::spot::{Hand, Spot, tile_of};
use super::steps::Steps;
use super::work::{HALF, LOOK, STRIDE, Work};
use crate::grid::GridPoint;
use crate::terrain::{Altitude, Box2, Ground, Window};

/// Longest piece, in cells along an axis, that is walked cell by cell: nine
/// cells at most, which a tick's work is enough for.
const WALK_CELLS: u32 = 4;
/// Tallest piece, in cells, that is walked.
const WALK_HEIGHT: u32 = 16;
/// Longest piece, in cells along an axis, that is looked along at once.
const REACH: u32 = 64;
/// Halvings that bring the longest possible segment down to a walk, and one.
const DEPTH: usize = 30;

/// How a sweep ended.
#[derive(Clone, Copy, Debug)]
pub(super) enum Sweep {
    /// The whole way is free.
    Clear,
    /// The way goes through the surface from above here.
    Hit(Spot),
    /// The way enters the solid from the side, out of a hole or over the
    /// border of the data: nothing was crossed from above.
    Under,
    /// A tile (column, row) on the way is not here.
    HeldUp([i32; 2]),
    /// The tick's work is spent.
    Unfinished,
}

/// A sweep under way: where the proxy has come, and what is still to do.
#[derive(Clone, Debug, Default)]
pub(super) struct Path {
    /// As far as the way is known to be free.
    at: GridPoint,
    /// Ends of the pieces still to do, the last one first.
    ends: Vec<GridPoint, DEPTH>,
    /// The way starts on the surface and leaves it.
    on_surface: bool,
    /// The way has come out of a hole.
    over_hole: bool,
}

impl Path {
    /// A way in the air from `from` to `to`.
    pub(super) fn through_air(from: GridPoint, to: GridPoint) -> Self {
        Self::new(from, to, false)
    }

    /// A way that leaves the surface at `from`.
    pub(super) fn off_surface(from: GridPoint, to: GridPoint) -> Self {
        Self::new(from, to, true)
    }

    fn new(from: GridPoint, to: GridPoint, on_surface: bool) -> Self {
        let mut ends = Vec::new();
        // Capacity is DEPTH > 1.
        let _ = ends.push(to);
        Self {
            at: from,
            ends,
            on_surface,
            over_hole: false,
        }
    }

    /// How far the way is known to be free.
    pub(super) const fn at(&self) -> GridPoint {
        self.at
    }

    /// Sweeps on until something ends it.
    pub(super) fn advance<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        work: &mut Work,
    ) -> Sweep {
        while let Some(&end) = self.ends.last() {
            if !work.take(LOOK) {
                return Sweep::Unfinished;
            }
            let span = Box2::around(self.at.column(), end.column());
            if window.is_clear(span, lower(&self.at, &end)) {
                // Above all that is around, so only the field's border matters.
                self.over_hole = !window.has_cell(end.column());
                self.on_surface = false;
            } else if is_short(&self.at, &end) || self.ends.is_full() {
                if let Some(ended) = self.walk(window, end, work) {
                    return ended;
                }
            } else if across(span) > REACH {
                // Not full: tested above.
                let _ = self.ends.push(self.at.midpoint(&end));
                continue;
            } else {
                if let Err(clear) = look_along(window, &self.at, &end, work) {
                    self.goes_on(window, end, clear, work);
                    continue;
                }
                self.passes(window, self.at, end);
            }
            self.at = end;
            self.ends.pop();
        }
        Sweep::Clear
    }

    /// Goes so far through a piece, and halves what follows down to a walk.
    fn goes_on<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        end: GridPoint,
        clear: f32,
        work: &mut Work,
    ) {
        let (from, mut end, mut clear) = (self.at, end, clear);
        // Once at least, or the next tick would begin as this one.
        loop {
            let middle = self.at.midpoint(&end);
            if clear >= 0.5 {
                self.at = middle;
                clear = 2.0 * clear - 1.0;
            } else {
                // Not full: `advance` walks then.
                let _ = self.ends.push(middle);
                end = middle;
                clear *= 2.0;
            }
            if self.ends.is_full() || is_short(&self.at, &end) || !work.take(HALF) {
                break;
            }
        }
        if self.at != from {
            self.passes(window, from, self.at);
        }
    }

    /// The way is clear from one place to another.
    fn passes<const D: usize>(&mut self, window: &Window<'_, D>, from: GridPoint, to: GridPoint) {
        // On a border, what was passed is the cell before it.
        let way = from.to(&to);
        let column = [0, 1].map(|axis| {
            let enters = to.frac()[axis] == 0.0 && way[axis] > 0.0;
            to.cell()[axis] - i32::from(enters)
        });
        self.over_hole = window.ground(column) == Ground::Hole;
        self.on_surface = false;
    }

    /// Walks the cells of one short piece.
    fn walk<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        end: GridPoint,
        work: &mut Work,
    ) -> Option<Sweep> {
        let view = Hand::new(self.at);
        let mut over_hole = self.over_hole;
        let mut on_surface = self.on_surface;
        let mut steps = Steps::between(&self.at, &end);
        while let Some(step) = steps.next() {
            if !work.take(STRIDE) {
                return Some(Sweep::Unfinished);
            }
            let is_last = steps.is_done() && self.ends.len() == 1;
            if on_surface && step.is_tiny() && !is_last {
                // A corner of a cell, or of a hole, touched on leaving an edge.
                continue;
            }
            let patch = match window.ground(step.cell) {
                Ground::Patch(corners) => view.patch(&corners),
                Ground::Missing => return Some(Sweep::HeldUp(tile_of(step.cell))),
                Ground::Hole => {
                    over_hole = true;
                    on_surface = false;
                    continue;
                }
            };
            let [start, middle, after] = step.gap(&patch);
            if over_hole && start >= 0.0 {
                return Some(Sweep::Under);
            }
            let crossing = if on_surface && middle < 0.0 {
                next_crossing(middle, after)
            } else {
                first_crossing(start, middle, after)
            };
            if let Some(s) = crossing {
                return Some(Sweep::Hit(step.spot(s)));
            }
            (over_hole, on_surface) = (false, false);
        }
        (self.over_hole, self.on_surface) = (over_hole, false);
        None
    }
}

/// The lower end of a way.
#[inline]
pub(super) fn lower(a: &GridPoint, b: &GridPoint) -> Altitude {
    let low = if a.is_below(b) { a } else { b };
    Altitude::new(low.cell()[2], low.frac().z)
}

/// Whether a piece is walked: short, and in height, too, which would otherwise
/// cost bits.
fn is_short(from: &GridPoint, to: &GridPoint) -> bool {
    across(Box2::around(from.column(), to.column())) <= WALK_CELLS
        && from.cell()[2].abs_diff(to.cell()[2]) <= WALK_HEIGHT
}

/// Columns or rows, whichever are more, that a box goes beyond its first.
fn across(span: Box2) -> u32 {
    let across = |axis: usize| span.to[axis].abs_diff(span.from[axis]);
    across(0).max(across(1))
}
