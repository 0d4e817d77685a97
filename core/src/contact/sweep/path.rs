//! The first crossing of the HIP's path with the bilinear surface.
//!
//! The path is halved until a piece is clear, by one lookup in the maximum pyramid, or is short
//! enough to be intersected cell by cell. Midpoints are exact to 2⁻²⁴ cell at any distance, so a
//! sweep of thousands of cells is as accurate as one of a tenth. Pieces are always the same halves
//! of halves, so a sweep that runs out of budget or meets a missing tile continues later with the
//! same bits.

use heapless::Vec;

use super::cells::{PathSegments, beside};
use super::intersect::{first_crossing, next_crossing};
use crate::contact::budget::{BOX, Budget, INTERSECTION};
use crate::contact::surface::{HipView, SurfacePoint};
use crate::grid::{Altitude, GridPoint};
use crate::terrain::{CellBox, CellContent, Window};

/// Maximum number of columns, or rows, of a piece that is intersected cell by cell, beyond its
/// first: it covers nine cells at most, which fit in a tick's budget.
const MAX_INTERSECTED_CELLS: u32 = 4;
/// Maximum height of a piece, in cells, that is intersected.
const MAX_INTERSECTED_HEIGHT: u32 = 16;
/// Halvings from a path of 4,096 cells, eight windows, down to an intersected piece, and two more:
/// the start of the path, and its new end after a motion of the HIP. A longer path is intersected
/// in longer pieces.
const MAX_PIECES: usize = 12;

/// End of a sweep.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) enum SweepEnd {
    /// The whole path is free.
    Clear,
    /// The path crosses the surface from above here.
    Hit(SurfacePoint),
    /// The path enters the solid from the side, out of no-data or over the border of the data,
    /// without a crossing from above.
    Under,
    /// A tile on the path is missing.
    MissingTile,
    /// The budget is spent.
    Suspended,
}

/// A sweep in progress: the proxy's place, and the pieces that are left.
#[derive(Clone, Debug)]
pub(in crate::contact) struct Path {
    /// End of the checked free part of the path.
    at: GridPoint,
    /// Ends of the remaining pieces, the last one first.
    ends: Vec<GridPoint, MAX_PIECES>,
    /// True if the path starts on the surface and leaves it.
    on_surface: bool,
    /// True if the last cell passed has no patch: no-data, or beyond the data.
    over_no_data: bool,
    /// True if the sweep waits for a tile, and not for budget.
    is_missing: bool,
}

impl Path {
    /// Creates a path through the air.
    pub(in crate::contact) fn through_air(from: GridPoint, to: GridPoint) -> Self {
        Self::new(from, to, false)
    }

    /// Creates a path that leaves the surface at `from`.
    pub(in crate::contact) fn off_surface(from: GridPoint, to: GridPoint) -> Self {
        Self::new(from, to, true)
    }

    fn new(from: GridPoint, to: GridPoint, on_surface: bool) -> Self {
        let mut ends = Vec::new();
        // Cannot fail: MAX_PIECES > 1.
        let _ = ends.push(to);
        Self {
            at: from,
            ends,
            on_surface,
            over_no_data: false,
            is_missing: false,
        }
    }

    /// Redirects the path to another place.
    ///
    /// A piece that is already partly intersected is completed first if it leads nearer to the new
    /// place: if every motion of the HIP cancelled it, a piece that requires more than a tick
    /// would never be completed. A piece that waits for a tile is cancelled, since the new path may
    /// not need it.
    #[inline(never)]
    pub(in crate::contact) fn redirect(&mut self, to: GridPoint) {
        let leads_nearer =
            |end: &GridPoint| !self.is_missing && HipView::new(to).is_nearer(end, &self.at);
        let started = self.ends.last().copied().filter(leads_nearer);
        self.ends.clear();
        // Cannot fail: MAX_PIECES > 2.
        let _ = self.ends.push(to);
        if let Some(end) = started {
            let _ = self.ends.push(end);
        }
    }

    /// Returns the end of the checked free part of the path.
    pub(in crate::contact) const fn at(&self) -> GridPoint {
        self.at
    }

    /// Continues the sweep until something ends it.
    pub(in crate::contact) fn advance<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        budget: &mut Budget,
    ) -> SweepEnd {
        self.is_missing = false;
        while let Some(&end) = self.ends.last() {
            if !budget.has(BOX) {
                return SweepEnd::Suspended;
            }
            budget.spend(BOX);
            let around = CellBox::around(self.at.column(), end.column());
            let span = with_borders(around, &end);
            let low = lower(&self.at, &end);
            if window.is_clear(span, low) || window.is_clear_nearby(around, low) {
                // The path is above everything around, so only the field's border matters.
                self.over_no_data = !window.has_cell(end.column());
                self.on_surface = false;
            } else if !self.is_intersected(&end) {
                // If this is full, the piece is intersected instead.
                let _ = self.ends.push(self.at.midpoint(&end));
                continue;
            } else if let Some(sweep_end) = self.intersect_cells(window, end, budget) {
                return sweep_end;
            }
            self.at = end;
            self.ends.pop();
        }
        SweepEnd::Clear
    }

    /// Returns true if the piece up to `end` is intersected cell by cell: it is short, and also in
    /// height, where a long one would cost bits.
    fn is_intersected(&self, end: &GridPoint) -> bool {
        let span = CellBox::around(self.at.column(), end.column());
        let is_low = self.at.cell()[2].abs_diff(end.cell()[2]) <= MAX_INTERSECTED_HEIGHT;
        (longer_side(span) <= MAX_INTERSECTED_CELLS && is_low) || self.ends.is_full()
    }

    /// Intersects the cells of one short piece.
    fn intersect_cells<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        end: GridPoint,
        budget: &mut Budget,
    ) -> Option<SweepEnd> {
        let view = HipView::new(self.at);
        let mut over_no_data = self.over_no_data;
        let mut on_surface = self.on_surface;
        let mut segments = PathSegments::between(&self.at, &end);
        while let Some(mut segment) = segments.next() {
            if !budget.has(INTERSECTION) {
                return Some(SweepEnd::Suspended);
            }
            budget.spend(INTERSECTION);
            let is_last = segments.is_done() && self.ends.len() == 1;
            if on_surface && segment.is_tiny() && !is_last {
                // The path leaves an edge and touches a corner of a cell or of no-data.
                continue;
            }
            let mut ground = window.ground(segment.cell);
            if ground == CellContent::NoData {
                (segment, ground) = beside(window, segment);
                over_no_data |= segment.is_point();
            }
            let patch = match ground {
                CellContent::Patch(corners) => view.patch(&corners),
                CellContent::Missing => {
                    self.is_missing = true;
                    budget.record_missing(segment.cell);
                    return Some(SweepEnd::MissingTile);
                }
                CellContent::NoData => {
                    over_no_data = true;
                    on_surface = false;
                    continue;
                }
            };
            let [start, middle, after] = segment.gap(&patch);
            if over_no_data && start >= 0.0 {
                return Some(SweepEnd::Under);
            }
            let crossing = if on_surface && middle < 0.0 {
                next_crossing(middle, after)
            } else {
                first_crossing(start, middle, after)
            };
            if let Some(s) = crossing {
                return Some(SweepEnd::Hit(segment.point(s)));
            }
            (over_no_data, on_surface) = (false, false);
        }
        (self.over_no_data, self.on_surface) = (over_no_data, false);
        None
    }
}

/// Returns the cells under a piece of a path, and those on whose border it ends.
fn with_borders(mut span: CellBox, end: &GridPoint) -> CellBox {
    if end.is_on_grid_line() {
        // An extra cell is harmless.
        span.from = span.from.offset(-1, -1);
    }
    span
}

/// Returns the altitude of the lower end of a path.
#[inline]
pub(in crate::contact) fn lower(a: &GridPoint, b: &GridPoint) -> Altitude {
    let low = if a.is_below(b) { a } else { b };
    Altitude::new(low.cell()[2], low.frac().z)
}

/// Returns the number of columns or rows, whichever is larger, beyond a box's first.
fn longer_side(span: CellBox) -> u32 {
    let columns = span.to.x.abs_diff(span.from.x);
    let rows = span.to.y.abs_diff(span.from.y);
    columns.max(rows)
}
