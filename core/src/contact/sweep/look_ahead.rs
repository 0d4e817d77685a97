//! How far along a path nothing is near: a look ahead, block by block.

use glam::Vec3;

use super::cells::{Axis, Step, Steps, beside};
use crate::contact::budget::{BESIDE, BLOCK, BLOCK_CELLS, Budget, CELL, GAP};
use crate::contact::surface::HipView;
use crate::contact::tolerance::PATH_NOISE;
use crate::grid::GridPoint;
use crate::scalar::larger;
use crate::terrain::{BLOCK_SHIFT, Block, Ground, Window};

/// Cells along a block's side.
const SIDE: f32 = (1 << BLOCK_SHIFT) as f32;

/// What counts as too near to the ground to tell.
#[derive(Clone, Copy)]
struct Near {
    /// Heights over the ground of less than this, cells.
    noise: f32,
    /// The border of a patch, from over a hole.
    may_touch: bool,
}

/// Looks along the path from `at` to `end`, a few hundred cells long at most.
///
/// # Errors
/// The fraction of the path that is surely clear (none, if below 0), where the look
/// ends before: too near to the ground to tell, a tile missing, or the budget spent.
pub(super) fn look_along<const D: usize>(
    window: &Window<'_, D>,
    at: &GridPoint,
    end: &GridPoint,
    budget: &mut Budget,
) -> Result<(), f32> {
    let view = HipView::new(*at);
    let way = at.to(end);
    let [_, longest] = extremes(&[way.x, way.y, way.z, 0.0]);
    let noise = PATH_NOISE * longest;
    let [mut east, mut north] = [0, 1].map(|axis| blocks(at, end, axis));
    let ends_on_line = end.is_on_grid_line();
    let is_on_lines = ends_on_line && at.is_on_grid_line();
    let mut from = 0.0;
    while budget.has(BLOCK) {
        budget.spend(BLOCK);
        let is_last = east.left | north.left == 0;
        let to = if is_last {
            1.0
        } else if east.t <= north.t {
            east.t
        } else {
            north.t
        };
        // The border of a patch may be touched from over a hole beside it.
        let may_touch = is_on_lines || (ends_on_line && is_last);
        let low = way.z * if way.z < 0.0 { to } else { from };
        let block = Block {
            col: east.square,
            row: north.square,
        };
        if may_touch || !window.block_is_clear(block, view.altitude().raised(low - noise)) {
            let heights = [way.z * from, way.z * to];
            let [u, v] = [&east, &north].map(|axis| cells(axis, [from, to]));
            let mut steps = Steps::along(u, v, heights);
            let near = Near { noise, may_touch };
            if let Err(clear) = all_clear(window, &view, &mut steps, near, budget) {
                let part = from + (to - from) * clear;
                return Err(part - rounding(at, end, way));
            }
        }
        if is_last {
            return Ok(());
        }
        from = to;
        if east.t <= north.t {
            east.crosses();
        } else {
            north.crosses();
        }
    }
    Err(from - rounding(at, end, way))
}

/// What the fraction of a path may be off at which it crosses a border between
/// cells.
///
/// A path that goes on beyond a border, and was thought to be before it, would come
/// into the ground beyond from nowhere and not from the side.
fn rounding(at: &GridPoint, end: &GridPoint, way: Vec3) -> f32 {
    let [_, longest] = extremes(&[way.x, way.y, 0.0, 0.0]);
    // Of a place: the block's sides cost three bits, and so does the path's length.
    let off = 1e-6 + 4e-7 * longest;
    let crosses = |axis: usize| at.cell()[axis] != end.cell()[axis];
    let part = |axis: usize| {
        if crosses(axis) {
            off / way[axis].abs()
        } else {
            0.0
        }
    };
    1e-6 + part(0) + part(1)
}

/// The blocks under a path along an axis. Their sides cost three bits of the
/// place, which a look ahead can spare.
fn blocks(at: &GridPoint, end: &GridPoint, axis: usize) -> Axis {
    let [first, last] = [at, end].map(|point| point.cell()[axis] >> BLOCK_SHIFT);
    let origin = first << BLOCK_SHIFT;
    let places = [at, end]
        .map(|point| (point.cell()[axis].wrapping_sub(origin) as f32 + point.frac()[axis]) / SIDE);
    Axis::new(first, [first, last], places)
}

/// The cells in a block under a part of a path along an axis.
fn cells(block: &Axis, part: [f32; 2]) -> Axis {
    let origin = block.square << BLOCK_SHIFT;
    let places = part.map(|t| block.at(t) * SIDE);
    let cell = |place: f32| origin + (place as i32).min((1 << BLOCK_SHIFT) - 1);
    Axis::new(origin, places.map(cell), places)
}

/// Whether the path is clear of all cells by more than rounding; the fraction of it that
/// is, where it is not clear of all.
fn all_clear<const D: usize>(
    window: &Window<'_, D>,
    view: &HipView,
    steps: &mut Steps,
    near: Near,
    budget: &mut Budget,
) -> Result<(), f32> {
    if !budget.has(BLOCK_CELLS) {
        return Err(0.0);
    }
    budget.spend(BLOCK_CELLS);
    while let Some(step) = steps.next() {
        is_clear(window, view, step, near, budget).map_err(|clear| steps.passed(clear))?;
    }
    Ok(())
}

/// The same of one cell, and of the part of the path over it.
fn is_clear<const D: usize>(
    window: &Window<'_, D>,
    view: &HipView,
    mut step: Step,
    Near { noise, may_touch }: Near,
    budget: &mut Budget,
) -> Result<(), f32> {
    if !budget.has(CELL) {
        return Err(0.0);
    }
    budget.spend(CELL);
    let mut ground = window.ground(step.cell);
    if may_touch && ground == Ground::Hole {
        if !budget.has(BESIDE) {
            return Err(0.0);
        }
        budget.spend(BESIDE);
        (step, ground) = beside(window, step);
    }
    let corners = match ground {
        Ground::Patch(corners) => corners,
        Ground::Missing => return Err(0.0),
        Ground::Hole => return Ok(()),
    };
    let patch = view.patch(&corners);
    let [highest, largest] = extremes(&patch.corners);
    if highest < step.low() - noise {
        return Ok(());
    }
    if !budget.has(GAP) {
        return Err(0.0);
    }
    budget.spend(GAP);
    let gap = step.gap(&patch);
    if step.runs_along(&gap, largest) {
        // Along ground as steep as the path, noise in height is next to none across
        // it.
        return match gap.iter().all(|gap| *gap < 0.0) {
            true => Ok(()),
            false => Err(0.0),
        };
    }
    let noise = if largest * PATH_NOISE > noise {
        largest * PATH_NOISE
    } else {
        noise
    };
    clear_part(gap, -noise)
}

/// Whether a gap is below a limit all along; the fraction of it that is, where not.
///
/// A polynomial in Bernstein form is nowhere above the line from its first coefficient
/// that is above the others.
fn clear_part([start, middle, end]: [f32; 3], limit: f32) -> Result<(), f32> {
    let [to_middle, to_end] = [2.0 * (middle - start), end - start];
    let steepest = if to_middle > to_end {
        to_middle
    } else {
        to_end
    };
    if start < limit && middle < limit && end < limit {
        return Ok(());
    }
    Err(match start < limit {
        true => (limit - start) / steepest,
        false => 0.0,
    })
}

/// The highest of four numbers, and the largest up or down.
fn extremes(numbers: &[f32; 4]) -> [f32; 2] {
    numbers
        .iter()
        .fold([f32::MIN, 0.0], |[highest, largest], x| {
            [larger(*x, highest), larger(x.abs(), largest)]
        })
}
