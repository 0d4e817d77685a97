//! Random paths of the HIP over a terrain, wild and gentle.

use super::terrain::Terrain;
use crate::random::Random;

/// Positions are integer multiples of this, in cells, so that they stay exact in single precision
/// in a mirrored, turned or shifted scene.
pub const GRAIN: f64 = 1.0 / (1 << 20) as f64;
/// An encoder count at the tip, cells of a millimetre.
const COUNT: f64 = 0.03;

/// Largest motion of the HIP along an axis in a tick, cells.
pub const JUMP_CELLS: f64 = 32.0;
/// Most leaps towards a target.
const JUMPS: usize = 12;

/// Motion of the HIP for some ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PathKind {
    /// Steps of one length near the surface.
    Wander,
    /// Jumps to any point in one tick.
    Teleport,
    /// Trembles by one encoder count.
    Tremble,
    /// Presses on a vertex from exactly below it.
    Vertex,
    /// Moves exactly along the line of an edge, at its height or near it.
    Graze,
    /// Stands exactly on lines of the grid.
    OnLines,
    /// Up and down through the surface.
    Tap,
    /// Crosses the whole field in one tick, and returns.
    Sweep,
    /// Does not move.
    Still,
}

const PATH_KINDS: [PathKind; 9] = [
    PathKind::Wander,
    PathKind::Teleport,
    PathKind::Tremble,
    PathKind::Vertex,
    PathKind::Graze,
    PathKind::OnLines,
    PathKind::Tap,
    PathKind::Sweep,
    PathKind::Still,
];

/// Returns `ticks` positions in cells; the first is high above everything.
#[must_use]
pub fn random(terrain: &Terrain, random: &mut Random, ticks: usize) -> Vec<[f64; 3]> {
    walked(terrain, random, ticks, |walker| {
        let kind = match walker.random.below(20) {
            n if n < PATH_KINDS.len() => PATH_KINDS[n],
            _ => PathKind::Wander,
        };
        walker.advance(kind);
    })
}

/// Returns `ticks` positions in cells: from the sky to far below the surface, like a hand that
/// presses into small cells: to and fro, slow and fast.
#[must_use]
pub fn deep(terrain: &Terrain, random: &mut Random, ticks: usize) -> Vec<[f64; 3]> {
    walked(terrain, random, ticks, |walker| {
        let turns = 40 + walker.random.below(160);
        walker.press_deep(turns);
    })
}

/// Returns `ticks` positions: from the sky, with an occasional return to it.
fn walked(
    terrain: &Terrain,
    random: &mut Random,
    ticks: usize,
    go_on: impl Fn(&mut Walker<'_>),
) -> Vec<[f64; 3]> {
    let mut walker = Walker::in_the_sky(terrain, random);
    while walker.path.len() < ticks {
        go_on(&mut walker);
        if walker.random.below(6) == 0 {
            walker.rise();
        }
    }
    walker.path.truncate(ticks);
    walker.path
}

struct Walker<'a> {
    terrain: &'a Terrain,
    size: [f64; 2],
    random: &'a mut Random,
    path: Vec<[f64; 3]>,
    at: [f64; 2],
}

impl<'a> Walker<'a> {
    /// Starts at a random point high above the surface.
    fn in_the_sky(terrain: &'a Terrain, random: &'a mut Random) -> Self {
        let size = terrain.size.map(f64::from);
        let at = [random.between(1.0, size[0]), random.between(1.0, size[1])];
        let mut walker = Self {
            terrain,
            size,
            random,
            path: vec![],
            at,
        };
        walker.rise();
        walker
    }

    fn rise(&mut self) {
        let [x, y] = self.at;
        self.above(x, y, 40.0);
    }

    fn put(&mut self, x: f64, y: f64, z: f64) {
        self.at = [x, y];
        for _ in 0..JUMPS {
            let to = [x, y, z];
            let last = self.path.last().copied().unwrap_or(to);
            let step = |axis: usize| (to[axis] - last[axis]).clamp(-JUMP_CELLS, JUMP_CELLS);
            let next = [0, 1, 2].map(|axis| ((last[axis] + step(axis)) / GRAIN).round() * GRAIN);
            self.path.push(next);
            if next
                .iter()
                .zip(to)
                .all(|(a, b)| (a - b).abs() < 2.0 * GRAIN)
            {
                break;
            }
        }
    }

    fn above(&mut self, x: f64, y: f64, height: f64) {
        self.put(x, y, self.terrain.height_about(x, y) + height);
    }

    /// Returns a length over many orders of magnitude, at most `max`.
    fn length(&mut self, max: f64) -> f64 {
        max * 10_f64.powf(self.random.between(-4.0, 0.0))
    }

    fn random_position(&mut self) -> [f64; 2] {
        // Also off the field.
        [0, 1].map(|axis| self.random.between(-2.0, self.size[axis] + 2.0))
    }

    fn vertex(&mut self) -> [f64; 2] {
        self.random_position().map(f64::round)
    }

    fn advance(&mut self, kind: PathKind) {
        let ticks = 1 + self.random.below(40);
        match kind {
            PathKind::Wander => self.wander(4 * ticks),
            PathKind::Teleport => self.teleport(ticks),
            PathKind::Tremble => self.tremble(ticks),
            PathKind::Vertex => self.press_vertex(ticks),
            PathKind::Graze => self.graze(ticks),
            PathKind::OnLines => self.on_lines(ticks),
            PathKind::Tap => self.tap(ticks),
            PathKind::Sweep => self.sweep(1 + ticks / 8),
            PathKind::Still => self.hold_still(ticks),
        }
    }

    fn wander(&mut self, ticks: usize) {
        let stride = self.length(3.0);
        let mut heading = self.random.between(0.0, std::f64::consts::TAU);
        let mut height = self.random.between(-1.5, 0.8);
        for _ in 0..ticks {
            heading += self.random.between(-0.4, 0.4);
            height += 0.1 * stride * self.random.between(-1.0, 1.0);
            let x = (self.at[0] + stride * heading.cos()).clamp(-1.0, self.size[0] + 1.0);
            let y = (self.at[1] + stride * heading.sin()).clamp(-1.0, self.size[1] + 1.0);
            self.above(x, y, height);
        }
    }

    fn press_deep(&mut self, ticks: usize) {
        let stride = self.length(3.0);
        let mut heading = self.random.between(0.0, std::f64::consts::TAU);
        let [x, y] = self.at;
        let depth = self.random.between(2.0, 100.0);
        let mut z = self.terrain.height_about(x, y) - depth;
        for _ in 0..ticks {
            heading += self.random.between(-0.2, 0.2);
            z += stride * self.random.between(-1.0, 1.0);
            let x = (self.at[0] + stride * heading.cos()).clamp(0.0, self.size[0]);
            let y = (self.at[1] + stride * heading.sin()).clamp(0.0, self.size[1]);
            self.put(x, y, z);
        }
    }

    fn teleport(&mut self, ticks: usize) {
        for _ in 0..ticks {
            let [x, y] = self.random_position();
            let height = self.length(10.0) * if self.random.below(2) == 0 { 1.0 } else { -1.0 };
            self.above(x, y, height);
        }
    }

    fn tremble(&mut self, ticks: usize) {
        let [x, y] = self.at;
        let z = self.terrain.height_about(x, y) - self.length(2.0);
        for _ in 0..ticks {
            let mut off = || (self.random.below(3) as f64 - 1.0) * COUNT;
            let (dx, dy, dz) = (off(), off(), off());
            self.put(x + dx, y + dy, z + dz);
        }
        self.at = [x, y];
    }

    fn press_vertex(&mut self, ticks: usize) {
        let [x, y] = self.vertex();
        self.above(x, y, 0.5);
        let depth = self.length(2.0);
        for tick in 0..ticks {
            // Exactly below it, or beside it by the smallest step.
            let off = if tick % 3 == 2 { GRAIN } else { 0.0 };
            let z = self.terrain.height_about(x, y) - depth;
            self.put(x + off, y - off, z);
        }
    }

    fn graze(&mut self, ticks: usize) {
        let [x, y] = self.vertex();
        let above = [0.0, GRAIN, -GRAIN, 1e-3][self.random.below(4)];
        let step = [1.0, 0.5, 0.25, 0.125][self.random.below(4)];
        let along = self.random.below(2);
        self.above(x, y, 1.0);
        for tick in 0..ticks {
            let mut at = [x, y];
            at[along] += step * tick as f64;
            self.above(at[0], at[1], above);
        }
    }

    fn on_lines(&mut self, ticks: usize) {
        for _ in 0..ticks {
            let axis = self.random.below(2);
            let stride = self.length(2.0);
            let mut at = self.at;
            at[axis] = at[axis].round() + self.random.below(3) as f64 - 1.0;
            at[1 - axis] += stride * self.random.between(-1.0, 1.0);
            let height = self.random.between(-0.7, 0.4);
            self.above(at[0], at[1], height);
        }
    }

    fn tap(&mut self, ticks: usize) {
        let (depth, stride) = (self.length(2.0), self.length(0.5));
        for tick in 0..ticks {
            let [x, y] = self.at;
            let height = depth * (tick as f64 * 0.7).cos();
            self.above(x + stride, y - 0.3 * stride, height);
        }
    }

    fn sweep(&mut self, times: usize) {
        let height = self.random.between(-0.5, 1.0);
        for _ in 0..times {
            let [x, y] = self.random_position();
            self.above(x, y, height);
            let (x, y) = (self.size[0] - x, self.size[1] - y);
            let z = self.path[self.path.len() - 1][2];
            if self.random.below(2) == 0 {
                self.put(x, y, z);
            } else {
                self.above(x, y, height);
            }
        }
    }

    fn hold_still(&mut self, ticks: usize) {
        let last = self.path[self.path.len() - 1];
        self.path.extend(std::iter::repeat_n(last, ticks));
    }
}
