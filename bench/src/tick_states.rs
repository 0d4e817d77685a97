//! States of a tick: one path of the HIP for each state, on which the ticks of that state are
//! marked.

use crate::grid::Grid;
use crate::path::{self, Flight, Path};
use crate::variant::Hip;

/// Ticks counted for each state.
pub const TICKS: usize = 2000;

/// A state's name and its path of the HIP.
pub type Make = fn(&Grid) -> Vec<Step>;

/// One tick: the HIP, and whether the tick is one of the state's own.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// The HIP.
    pub hip: Hip,
    /// True if it counts.
    pub counts: bool,
}

/// All states, in the order of the table.
pub const STATES: [(&str, Make); 8] = [
    ("unmoved", |grid| last(path::resting(grid, TICKS))),
    ("free high", |grid| {
        last(path::flight(grid, "", Flight::High, TICKS + 1))
    }),
    ("free low", |grid| {
        last(path::flight(grid, "", Flight::Low, TICKS + 1))
    }),
    ("first contact", first_contact),
    ("sliding", |grid| last(path::slide(grid, "", 0.01, TICKS))),
    ("sliding fast", |grid| {
        last(path::slide(grid, "", 0.5, TICKS))
    }),
    ("resting", resting),
    ("sweep 50, miss", |grid| {
        last(path::sweep(grid, "", 50.0, TICKS).expect("50 cells fit"))
    }),
];

/// Returns the terrain of the counts.
#[must_use]
pub fn terrain() -> Grid {
    Grid::fractal("256 × 256", [256, 256], 6, 1.0)
}

/// Marks the last [`TICKS`] of a path.
fn last(path: Path) -> Vec<Step> {
    let uncounted = path.hips.len().saturating_sub(TICKS).max(1);
    let step = |(tick, hip): (usize, &Hip)| Step {
        hip: *hip,
        counts: tick >= uncounted,
    };
    path.hips.iter().enumerate().map(step).collect()
}

/// Moves up and down through the surface; the ticks downward count.
fn first_contact(grid: &Grid) -> Vec<Step> {
    let above = path::slide(grid, "", 0.03, TICKS).hips;
    let step = |hip: &Hip| {
        let [x, y, _] = hip.wide;
        let at = |height| Hip::at([x, y, grid.height(x, y) + height]);
        let (free, touching) = (at(0.2), at(-0.1));
        [(free, false), (touching, true)].map(|(hip, counts)| Step { hip, counts })
    };
    above[above.len() - TICKS..].iter().flat_map(step).collect()
}

/// Presses on one spot with a tremor of one encoder count of 0.03 mm, with cells of 1 mm.
fn resting(grid: &Grid) -> Vec<Step> {
    const COUNT: f64 = 0.03;
    let mut steps = last(path::resting(grid, TICKS));
    let mut random = path::Random(31);
    for step in steps.iter_mut().filter(|step| step.counts) {
        let tremble = step.hip.wide.map(|x| {
            let counts = random.between(-1.5, 1.5).round();
            x + counts * COUNT
        });
        step.hip = Hip::at(tremble);
    }
    steps
}
