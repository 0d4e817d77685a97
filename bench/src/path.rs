//! The paths of the HIP: from a seed, relative to the surface below.

use crate::grid::Grid;
use crate::variant::Hip;

/// A path of the HIP over one terrain.
#[derive(Clone, Debug)]
pub struct Path {
    /// Its name in tables.
    pub name: &'static str,
    /// One HIP a tick; the first is above the surface.
    pub hips: Vec<Hip>,
    /// Number of HIPs at the start that descend from above the surface.
    pub approach: usize,
}

impl Path {
    const fn new(name: &'static str, hips: Vec<Hip>, approach: usize) -> Self {
        Self {
            name,
            hips,
            approach,
        }
    }
}

/// Cells kept free at the border of the field.
const MARGIN: f64 = 4.0;

/// Returns all paths of the comparison over a terrain, `ticks` long; the long sweeps only if the
/// terrain is large enough.
#[must_use]
pub fn all(grid: &Grid, ticks: usize) -> Vec<Path> {
    let mut paths = vec![
        slide(grid, "slide 0.01", 0.01, ticks),
        slide(grid, "slide 0.5", 0.5, ticks),
        tapping(grid, ticks),
        random(grid, ticks),
        resting(grid, ticks),
        flight(grid, "fly low 0.5", Flight::Low, ticks),
        flight(grid, "fly high 0.5", Flight::High, ticks),
    ];
    for (name, length) in [
        ("sweep 50", 50.0),
        ("sweep 500", 500.0),
        ("sweep 5000", 5000.0),
    ] {
        paths.extend(sweep(grid, name, length, ticks));
    }
    paths
}

/// Returns a slide 0.1 cell below the surface, `step` cells a tick.
#[must_use]
pub fn slide(grid: &Grid, name: &'static str, step: f64, ticks: usize) -> Path {
    slide_at(grid, name, [step, 0.1], ticks)
}

/// Returns a slide at any depth: `[step, depth]`, cells.
#[must_use]
pub fn slide_at(grid: &Grid, name: &'static str, [step, depth]: [f64; 2], ticks: usize) -> Path {
    let mut walk = Walk::new(grid, 11);
    let mut hips = approach_hips(grid, walk.at, -depth);
    let approach = hips.len();
    hips.extend((0..ticks).map(|_| over(grid, walk.advance(grid, step), -depth)));
    Path::new(name, hips, approach)
}

/// Returns taps half a cell deep every hundred ticks, on a slow path.
#[must_use]
pub fn tapping(grid: &Grid, ticks: usize) -> Path {
    let mut walk = Walk::new(grid, 12);
    let mut hips = vec![over(grid, walk.at, 0.5)];
    hips.extend((0..ticks).map(|tick| {
        let phase = tick as f64 * (std::f64::consts::TAU / 100.0);
        over(grid, walk.advance(grid, 0.02), 0.5 * phase.cos())
    }));
    Path::new("tapping", hips, 0)
}

/// Returns jumps of up to 0.3 cell in all directions, mostly near the surface.
#[must_use]
pub fn random(grid: &Grid, ticks: usize) -> Path {
    let mut walk = Walk::new(grid, 13);
    let mut height = 0.5;
    let mut hips = vec![over(grid, walk.at, height)];
    hips.extend((0..ticks).map(|_| {
        walk.heading = walk.random.between(0.0, std::f64::consts::TAU);
        let step = walk.random.between(0.0, 0.3);
        height += walk.random.between(-0.3, 0.3);
        // Back from 1 cell above or below.
        height -= 2.0 * (height - height.clamp(-1.0, 1.0));
        over(grid, walk.advance(grid, step), height)
    }));
    Path::new("random", hips, 0)
}

/// Returns a rest 0.1 cell below the surface, without a change of any bit.
#[must_use]
pub fn resting(grid: &Grid, ticks: usize) -> Path {
    let walk = Walk::new(grid, 14);
    let mut hips = approach_hips(grid, walk.at, -0.1);
    let approach = hips.len();
    let last = hips[approach - 1];
    hips.extend(std::iter::repeat_n(last, ticks));
    Path::new("unmoved", hips, approach)
}

/// Height of the HIP's path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flight {
    /// One cell above the surface below it.
    Low,
    /// Above the whole terrain.
    High,
}

/// Returns a free flight, 0.5 cell a tick.
#[must_use]
pub fn flight(grid: &Grid, name: &'static str, flight: Flight, ticks: usize) -> Path {
    let mut walk = Walk::new(grid, 15);
    let high = f64::from(grid.top()) + 2.0;
    let mut hips = Vec::with_capacity(ticks);
    while hips.len() < ticks {
        let at = walk.advance(grid, 0.5);
        hips.push(match flight {
            Flight::Low => over(grid, at, 1.0),
            Flight::High => Hip::at([at[0], at[1], high]),
        });
    }
    Path::new(name, hips, 0)
}

/// Returns sweeps of `length` cells in one tick each, there and back, half a cell above the highest
/// point of their path, so that they hit nothing. `None` if the terrain is too small.
#[must_use]
pub fn sweep(grid: &Grid, name: &'static str, length: f64, ticks: usize) -> Option<Path> {
    const SWEEPS_PER_LINE: usize = 4;
    let (width, height) = (grid.columns as f64, grid.rows as f64);
    if width.hypot(height) < length + 8.0 * MARGIN {
        return None;
    }
    let lines = (2e5 / length) as usize;
    let lines = lines.min(ticks / (2 * SWEEPS_PER_LINE)).max(4);
    let mut random = Random(16);
    let sky = f64::from(grid.top()) + 2.0;
    let mut hips = Vec::new();
    for _ in 0..lines {
        let (from, to) = loop {
            let from = [
                random.between(MARGIN, width - MARGIN),
                random.between(MARGIN, height - MARGIN),
            ];
            let angle = random.between(0.0, std::f64::consts::TAU);
            let to = [
                from[0] + length * angle.cos(),
                from[1] + length * angle.sin(),
            ];
            if inside(grid, to) {
                break (from, to);
            }
        };
        let low = highest_between(grid, from, to) + 0.5;
        hips.push(Hip::at([from[0], from[1], sky]));
        for _ in 0..SWEEPS_PER_LINE {
            hips.push(Hip::at([from[0], from[1], low]));
            hips.push(Hip::at([to[0], to[1], low]));
        }
        hips.push(Hip::at([to[0], to[1], sky]));
    }
    Some(Path::new(name, hips, 0))
}

/// Returns the highest sample beside a straight line: an upper bound of the surface.
fn highest_between(grid: &Grid, from: [f64; 2], to: [f64; 2]) -> f64 {
    let steps = (4.0 * (to[0] - from[0]).hypot(to[1] - from[1])).ceil();
    let mut highest = f32::NEG_INFINITY;
    for step in 0..=steps as usize {
        let t = step as f64 / steps;
        let at = [0, 1].map(|i| (from[i] + t * (to[i] - from[i])) as i32);
        for (dx, dy) in [(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1)] {
            let cell = [at[0] + dx, at[1] + dy];
            if grid.has(cell) {
                highest = grid.corners(cell).iter().fold(highest, |a, b| a.max(*b));
            }
        }
    }
    f64::from(highest)
}

/// Returns the descent from half a cell above the surface to `height`.
pub(crate) fn approach_hips(grid: &Grid, at: [f64; 2], height: f64) -> Vec<Hip> {
    (0..=10)
        .map(|i| over(grid, at, 0.5 + f64::from(i) / 10.0 * (height - 0.5)))
        .collect()
}

/// Returns a HIP at a height above the surface.
pub(crate) fn over(grid: &Grid, [x, y]: [f64; 2], height: f64) -> Hip {
    Hip::at([x, y, grid.height(x, y) + height])
}

fn inside(grid: &Grid, [x, y]: [f64; 2]) -> bool {
    let within = |at: f64, side: usize| (MARGIN..=side as f64 - MARGIN).contains(&at);
    within(x, grid.columns) && within(y, grid.rows)
}

/// A path that turns slowly and stays inside the field.
struct Walk {
    random: Random,
    at: [f64; 2],
    heading: f64,
}

impl Walk {
    fn new(grid: &Grid, seed: u64) -> Self {
        let mut random = Random(seed);
        let part = |random: &mut Random, side: usize| side as f64 * random.between(0.3, 0.7);
        Self {
            at: [
                part(&mut random, grid.columns),
                part(&mut random, grid.rows),
            ],
            heading: random.between(0.0, std::f64::consts::TAU),
            random,
        }
    }

    fn advance(&mut self, grid: &Grid, step: f64) -> [f64; 2] {
        self.heading += self.random.between(-0.05, 0.05);
        let next = [
            self.at[0] + step * self.heading.cos(),
            self.at[1] + step * self.heading.sin(),
        ];
        if inside(grid, next) {
            self.at = next;
        } else {
            self.heading += std::f64::consts::FRAC_PI_2;
        }
        self.at
    }
}

/// A small seeded generator, the same on all machines (xorshift64*).
pub struct Random(
    /// Its state: any number except zero.
    pub u64,
);

impl Random {
    /// Returns a number in `[low, high)`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11;
        low + (high - low) * (bits as f64 / (1_u64 << 53) as f64)
    }
}
