//! How far along a path nothing is near: a look ahead, block by block.

use glam::Vec3;

use super::cells::{Axis, Step, Steps};
use crate::contact::budget::{BLOCK, BLOCK_CELLS, Budget, CELL, GAP};
use crate::contact::surface::HipView;
use crate::contact::tolerance::PATH_NOISE;
use crate::grid::GridPoint;
use crate::terrain::{BLOCK_SHIFT, Block, Ground, Window};

/// Cells along a block's side.
const SIDE: f32 = (1 << BLOCK_SHIFT) as f32;

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
        let low = way.z * if way.z < 0.0 { to } else { from };
        let block = Block {
            col: east.square,
            row: north.square,
        };
        if !window.block_is_clear(block, view.altitude().raised(low - noise)) {
            let heights = [way.z * from, way.z * to];
            let [u, v] = [&east, &north].map(|axis| cells(axis, [from, to]));
            let mut steps = Steps::along(u, v, heights);
            if !all_clear(window, &view, &mut steps, noise, budget) {
                let part = from + (to - from) * steps.passed();
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

/// Whether the path is clear of all cells by more than rounding; it is up to the
/// last step taken.
fn all_clear<const D: usize>(
    window: &Window<'_, D>,
    view: &HipView,
    steps: &mut Steps,
    noise: f32,
    budget: &mut Budget,
) -> bool {
    if !budget.has(BLOCK_CELLS) {
        return false;
    }
    budget.spend(BLOCK_CELLS);
    while let Some(step) = steps.next() {
        if !is_clear(window, view, &step, noise, budget) {
            return false;
        }
    }
    true
}

fn is_clear<const D: usize>(
    window: &Window<'_, D>,
    view: &HipView,
    step: &Step,
    noise: f32,
    budget: &mut Budget,
) -> bool {
    if !budget.has(CELL) {
        return false;
    }
    budget.spend(CELL);
    let corners = match window.ground(step.cell) {
        Ground::Patch(corners) => corners,
        Ground::Missing => return false,
        Ground::Hole => return true,
    };
    let patch = view.patch(&corners);
    let [highest, largest] = extremes(&patch.corners);
    if highest < step.low() - noise {
        return true;
    }
    if !budget.has(GAP) {
        return false;
    }
    budget.spend(GAP);
    let gap = step.gap(&patch);
    let noise = if step.runs_along(&gap, largest) {
        // Along ground as steep as the path, noise in height is next to none across
        // it.
        0.0
    } else if largest * PATH_NOISE > noise {
        largest * PATH_NOISE
    } else {
        noise
    };
    gap.iter().all(|gap| *gap < -noise)
}

/// The highest of four numbers, and the largest up or down.
fn extremes(numbers: &[f32; 4]) -> [f32; 2] {
    // Not `f32::max`, which is a call where the processor has no instruction for it.
    let larger = |a: f32, b: f32| if b > a { b } else { a };
    numbers
        .iter()
        .fold([f32::MIN, 0.0], |[highest, largest], x| {
            [larger(highest, *x), larger(largest, x.abs())]
        })
}
