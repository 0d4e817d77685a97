//! The first true crossing of the hand's way with the bilinear surface.
//!
//! The segment is halved until a piece is known to be clear (one look at the
//! maximum pyramid) or short enough to walk cell by cell. Half-way points are
//! exact to 2⁻²⁴ cell at any distance, so a sweep of thousands of cells is as
//! accurate as one of a tenth, and one that hits nothing costs the logarithm
//! of its length. The pieces still to do are kept, so a sweep that runs out of
//! work or meets a missing tile goes on later at the very same piece.

use glam::Vec3;
use heapless::Vec;

use super::crossing::{first_crossing, next_crossing};
use super::patch::Patch;
use super::spot::{Hand, Spot, tile_of};
use super::work::{LOOK, STRIDE, Work};
use crate::grid::GridPoint;
use crate::terrain::{Altitude, Box2, Ground, Window};

/// Longest piece, in cells along an axis, that is walked cell by cell: nine
/// cells at most, which a tick's work is enough for.
const WALK_CELLS: u32 = 4;
/// Tallest piece, in cells, that is walked.
const WALK_HEIGHT: u32 = 16;
/// Rounding of a gap over a tall piece, of its height.
const TALL_NOISE: f32 = 1e-5;
/// A way whose gap over the ground is less than its own rise by this factor runs
/// along it.
const ALONG: f32 = 16.0;
/// Halvings that bring the longest possible segment down to a walk, and one.
const DEPTH: usize = 30;

/// How a sweep ended.
#[derive(Clone, Copy, Debug)]
pub(super) enum Sweep {
    /// The whole way is free.
    Clear,
    /// The way goes through the surface from above here. `progress` tells
    /// whether this is any distance from where the sweep began.
    Hit { spot: Spot, progress: bool },
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
            } else if is_short(span, &self.at, &end) || self.ends.is_full() {
                if let Some(ended) = self.walk(window, end, work) {
                    return ended;
                }
            } else if let Some(over_hole) = self.falls_clear(window, span, &end, work) {
                self.over_hole = over_hole;
            } else {
                // Not full: tested above.
                let _ = self.ends.push(self.at.midpoint(&end));
                continue;
            }
            self.at = end;
            self.on_surface = false;
            self.ends.pop();
        }
        Sweep::Clear
    }

    /// Whether a tall piece ends over a hole; `None` unless it lies over a few
    /// cells and is clear of them by more than the bits that its height costs.
    fn falls_clear<const D: usize>(
        &self,
        window: &Window<'_, D>,
        span: Box2,
        end: &GridPoint,
        work: &mut Work,
    ) -> Option<bool> {
        if !is_narrow(span) {
            return None;
        }
        let mut over_hole = self.over_hole;
        let view = Hand::new(self.at);
        let tall = end.cell()[2].abs_diff(self.at.cell()[2]) as f32;
        let mut steps = Steps::new(&self.at, end);
        while let Some(step) = steps.next() {
            if !work.take(STRIDE) {
                return None;
            }
            let corners = match window.ground(step.cell) {
                Ground::Patch(corners) => corners,
                Ground::Missing => return None,
                Ground::Hole => {
                    over_hole = true;
                    continue;
                }
            };
            over_hole = false;
            let patch = view.patch(&corners);
            let gap = step.gap(&patch);
            let above = gap.into_iter().fold(f32::MIN, f32::max);
            let largest = patch.corners.iter().fold(tall, |most, h| most.max(h.abs()));
            // Along ground as steep as the way, noise in height is next to none
            // across it.
            let noise = if step.runs_along(&gap, largest) {
                0.0
            } else {
                TALL_NOISE * largest
            };
            if above >= -noise {
                return None;
            }
        }
        Some(over_hole)
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
        let mut steps = Steps::new(&self.at, &end);
        while let Some(step) = steps.next() {
            if !work.take(STRIDE) {
                return Some(Sweep::Unfinished);
            }
            let is_last = steps.done && self.ends.len() == 1;
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
                let progress = !on_surface || s > NO_PROGRESS;
                let spot = step.spot(s);
                return Some(Sweep::Hit { spot, progress });
            }
            (over_hole, on_surface) = (false, false);
        }
        self.over_hole = over_hole;
        None
    }
}

/// A crossing within this part of the first cell's way is the start again.
const NO_PROGRESS: f32 = 1e-6;
/// Length, in cells, of a step that is passed over where the way leaves the
/// surface.
const TINY: f32 = 1e-5;

/// The lower end of a way.
#[inline]
pub(super) fn lower(a: &GridPoint, b: &GridPoint) -> Altitude {
    let low = if a.is_below(b) { a } else { b };
    Altitude::new(low.cell()[2], low.frac().z)
}

/// Whether a piece is walked: short, and in height, too, which would otherwise
/// cost bits.
fn is_short(span: Box2, from: &GridPoint, to: &GridPoint) -> bool {
    is_narrow(span) && from.cell()[2].abs_diff(to.cell()[2]) <= WALK_HEIGHT
}

fn is_narrow(span: Box2) -> bool {
    let across = |axis: usize| span.to[axis].abs_diff(span.from[axis]);
    across(0).max(across(1)) <= WALK_CELLS
}

/// The part of a piece that lies in one cell.
struct Step {
    cell: [i32; 2],
    from: (f32, f32),
    to: (f32, f32),
    /// Heights above the start of the piece.
    z_from: f32,
    z_to: f32,
}

impl Step {
    /// Too short for the heights at its ends to differ by more than rounding.
    fn is_tiny(&self) -> bool {
        (self.to.0 - self.from.0)
            .abs()
            .max((self.to.1 - self.from.1).abs())
            < TINY
            && (self.z_to - self.z_from).abs() < TINY
    }

    /// Whether the ground, no corner of which is farther up or down than
    /// `largest`, rises or falls with the way, `gap` over it.
    fn runs_along(&self, gap: &[f32; 3], largest: f32) -> bool {
        let rise = (self.z_to - self.z_from).abs();
        largest <= ALONG * rise && gap.iter().all(|gap| ALONG * gap.abs() <= rise)
    }

    /// The patch's height over the way, by its Bernstein coefficients.
    #[inline]
    fn gap(&self, patch: &Patch) -> [f32; 3] {
        [
            patch.height(self.from.0, self.from.1) - self.z_from,
            patch.blossom(self.from, self.to) - 0.5 * (self.z_from + self.z_to),
            patch.height(self.to.0, self.to.1) - self.z_to,
        ]
    }

    fn spot(&self, s: f32) -> Spot {
        let between = |a: f32, b: f32| (a + s * (b - a)).clamp(0.0, 1.0);
        Spot {
            cell: self.cell,
            u: between(self.from.0, self.to.0),
            v: between(self.from.1, self.to.1),
        }
    }
}

/// The cells under a short piece, in order; each begins exactly where the one
/// before ended, so that nothing slips through between them.
struct Steps {
    origin: [i32; 2],
    /// Piece from its origin cell, cells.
    start: Vec3,
    end: Vec3,
    /// Cell now, counted from the origin cell.
    offset: [i32; 2],
    last: [i32; 2],
    from: (f32, f32),
    z_from: f32,
    done: bool,
}

impl Steps {
    fn new(at: &GridPoint, end: &GridPoint) -> Self {
        let start = Vec3::new(at.frac().x, at.frac().y, 0.0);
        let way = at.to(end);
        let [x, y, _] = at.cell();
        let [end_x, end_y, _] = end.cell();
        Self {
            origin: [x, y],
            start,
            end: end.seen_from([x, y, 0]).with_z(way.z),
            offset: [0, 0],
            last: [end_x - x, end_y - y],
            from: (start.x, start.y),
            z_from: 0.0,
            done: false,
        }
    }

    fn next(&mut self) -> Option<Step> {
        if self.done {
            return None;
        }
        let way = self.end - self.start;
        let toward = [
            step_toward(self.offset[0], self.last[0]),
            step_toward(self.offset[1], self.last[1]),
        ];
        let t_u = self.reaches(0, toward[0], way.x);
        let t_v = self.reaches(1, toward[1], way.y);
        let cell = [
            self.origin[0] + self.offset[0],
            self.origin[1] + self.offset[1],
        ];
        let (from, z_from) = (self.from, self.z_from);
        let local = |p: Vec3| (p.x - self.offset[0] as f32, p.y - self.offset[1] as f32);
        let (to, z_to);
        if toward == [0, 0] {
            self.done = true;
            (to, z_to) = (within(local(self.end)), self.end.z);
        } else if t_u <= t_v {
            let at = self.start + way * t_u;
            let (_, v) = within(local(at));
            (to, z_to) = ((edge(toward[0]), v), at.z);
            self.offset[0] += toward[0];
            self.from = (1.0 - to.0, v);
        } else {
            let at = self.start + way * t_v;
            let (u, _) = within(local(at));
            (to, z_to) = ((u, edge(toward[1])), at.z);
            self.offset[1] += toward[1];
            self.from = (u, 1.0 - to.1);
        }
        self.z_from = z_to;
        Some(Step {
            cell,
            from,
            to,
            z_from,
            z_to,
        })
    }

    /// At which part of the piece the next border along an axis is reached;
    /// beyond 1 when the piece ends before.
    fn reaches(&self, axis: usize, toward: i32, way: f32) -> f32 {
        if toward == 0 {
            return f32::INFINITY;
        }
        let border = (self.offset[axis] + i32::from(toward > 0)) as f32;
        let t = (border - self.start[axis]) / way;
        // A piece that ends on its border may have no way left: 0/0.
        if t <= 1.0 { t.max(0.0) } else { 1.0 }
    }
}

fn step_toward(from: i32, to: i32) -> i32 {
    (to - from).signum()
}

fn edge(toward: i32) -> f32 {
    if toward > 0 { 1.0 } else { 0.0 }
}

fn within((u, v): (f32, f32)) -> (f32, f32) {
    (u.clamp(0.0, 1.0), v.clamp(0.0, 1.0))
}
