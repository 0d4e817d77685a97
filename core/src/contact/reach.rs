//! How far along a way nothing is near: a look ahead, block by block.

use glam::Vec3;

use super::spot::Hand;
use super::steps::{Axis, Step, Steps};
use super::work::{BLOCK, CELL, ENTER, HEIGHT, Work};
use crate::grid::GridPoint;
use crate::terrain::{BLOCK_SHIFT, Ground, Window};

/// Rounding of a height over a long way, of the way's length: places on it are
/// known to 2⁻²⁰ of that, and so are heights on slopes as steep as it is long.
const NOISE: f32 = 1e-5;
/// Cells along a block's side.
const SIDE: f32 = (1 << BLOCK_SHIFT) as f32;

/// Looks along the way from `at` to `end`, a few hundred cells long at most.
///
/// # Errors
/// The part of the way that is surely clear (none, if below 0), where the look
/// ends before: too near to the ground to tell, a tile missing, or no work left.
pub(super) fn look_along<const D: usize>(
    window: &Window<'_, D>,
    at: &GridPoint,
    end: &GridPoint,
    work: &mut Work,
) -> Result<(), f32> {
    let view = Hand::new(*at);
    let way = at.to(end);
    let [_, longest] = extremes(&[way.x, way.y, way.z, 0.0]);
    let noise = NOISE * longest;
    let [mut east, mut north] = [0, 1].map(|axis| blocks(at, end, axis));
    let mut from = 0.0;
    while work.take(BLOCK) {
        let is_last = east.left | north.left == 0;
        let to = if is_last {
            1.0
        } else if east.t <= north.t {
            east.t
        } else {
            north.t
        };
        let low = way.z * if way.z < 0.0 { to } else { from };
        let block = [east.square, north.square];
        if !window.block_is_clear(block, view.altitude().raised(low - noise)) {
            work.charge(ENTER);
            let heights = [way.z * from, way.z * to];
            let [u, v] = [&east, &north].map(|axis| cells(axis, [from, to]));
            let mut steps = Steps::along(u, v, heights);
            if !all_clear(window, &view, &mut steps, noise, work) {
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

/// What the part of a way may be off at which it crosses a border between cells.
///
/// A way that goes on beyond a border, and was thought to be before it, would come
/// into the ground beyond from nowhere and not from the side.
fn rounding(at: &GridPoint, end: &GridPoint, way: Vec3) -> f32 {
    let [_, longest] = extremes(&[way.x, way.y, 0.0, 0.0]);
    // Of a place: the block's sides cost three bits, and so does the way's length.
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

/// The blocks under a way along an axis. Their sides cost three bits of the
/// place, which a look ahead can spare.
fn blocks(at: &GridPoint, end: &GridPoint, axis: usize) -> Axis {
    let [first, last] = [at, end].map(|point| point.cell()[axis] >> BLOCK_SHIFT);
    let origin = first << BLOCK_SHIFT;
    let places = [at, end]
        .map(|point| (point.cell()[axis].wrapping_sub(origin) as f32 + point.frac()[axis]) / SIDE);
    Axis::new(first, [first, last], places)
}

/// The cells in a block under a part of a way along an axis.
fn cells(block: &Axis, part: [f32; 2]) -> Axis {
    let origin = block.square << BLOCK_SHIFT;
    let places = part.map(|t| block.at(t) * SIDE);
    let cell = |place: f32| origin + (place as i32).min((1 << BLOCK_SHIFT) - 1);
    Axis::new(origin, places.map(cell), places)
}

/// Whether the way is clear of all cells by more than rounding; it is up to the
/// last step taken.
fn all_clear<const D: usize>(
    window: &Window<'_, D>,
    view: &Hand,
    steps: &mut Steps,
    noise: f32,
    work: &mut Work,
) -> bool {
    while let Some(step) = steps.next() {
        if !work.take(CELL) || !is_clear(window, view, &step, noise, work) {
            return false;
        }
    }
    true
}

fn is_clear<const D: usize>(
    window: &Window<'_, D>,
    view: &Hand,
    step: &Step,
    noise: f32,
    work: &mut Work,
) -> bool {
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
    work.charge(HEIGHT);
    let gap = step.gap(&patch);
    let noise = if step.runs_along(&gap, largest) {
        // Along ground as steep as the way, noise in height is next to none across
        // it.
        0.0
    } else if largest * NOISE > noise {
        largest * NOISE
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
