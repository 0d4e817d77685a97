//! A tip of finite radius: the ground as a ball's centre feels it.
//!
//! A ball that rests on a height field has its centre on another height field: at each place the
//! highest of the ground under the ball plus the ball's own height there. So a point on this
//! surface is a ball on the ground, and device and contact stay as they are. It is made on the
//! host, of a block of samples with a halo of the radius, when a tile is made.
//!
//! Let `S` be the bilinear surface of the samples, in cells, and `R` the radius. Then
//!
//! ```text
//! centre(p) = max over |w| <= R of  S(p + w) + sqrt(R² − |w|²)
//! ```
//!
//! A bilinear patch is straight along its grid lines and along every line parallel to them. Over a
//! straight line of slope `m` at a distance `δ` the ball is a circle of radius `ρ = sqrt(R² − δ²)`,
//! which rests on the line at `ρ m / sqrt(1 + m²)` uphill, at the height of the line below `p` plus
//! `ρ sqrt(1 + m²)`. So the maximum along such a line is exact; that over the surface is taken
//! along lines of both directions, `1/n` of a cell apart. Between two lines the ball may rest
//! higher, by at most `1 / (4 n² R)` cells on a plane; `n` is chosen so that this is at most 0.5 %
//! of the radius.
//!
//! A stretch of a line touches the ball of exactly one node of each column that is near enough, so
//! a tile takes as many steps as there are stretches in the block, times the ball's width.

use std::sync::Arc;

/// Largest radius, cells of the level that is felt. A larger ball is felt at a coarser level.
pub const MOST_CELLS: f64 = 8.0;
/// What the ball may rest too low for want of a line, as a part of its radius.
const SAG: f64 = 5e-3;

/// A ball in a grid of cells.
#[derive(Clone, Debug)]
pub(super) struct Ball {
    /// Radius, cells.
    radius: f64,
    /// Samples around a block that its nodes depend on.
    halo: usize,
    /// Lines a cell.
    lines: usize,
    /// Places east and north of its middle, cells, and the height of the ball there.
    caps: Arc<[(isize, isize, f64)]>,
}

/// Samples of a rectangle, row by row from the south-west, in cells.
pub(super) struct Block {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// NaN where there is no data.
    pub(super) heights: Vec<f64>,
}

impl Ball {
    /// A ball of a radius in cells, positive and at most [`MOST_CELLS`].
    pub(super) fn new(radius: f64) -> Self {
        let reach = radius.floor() as isize;
        let places = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| (x, y)));
        let cap = |(x, y): (isize, isize)| {
            let squared = radius * radius - (x * x + y * y) as f64;
            (squared >= 0.0).then(|| (x, y, squared.sqrt()))
        };
        Self {
            radius,
            halo: radius.ceil() as usize + 1,
            lines: (1.0 / (4.0 * SAG * radius * radius))
                .sqrt()
                .ceil()
                .clamp(1.0, 64.0) as usize,
            caps: places.filter_map(cap).collect(),
        }
    }

    /// Radius, cells.
    pub(super) const fn radius(&self) -> f64 {
        self.radius
    }

    /// Samples around a block that its nodes depend on.
    pub(super) const fn halo(&self) -> usize {
        self.halo
    }

    /// The heights of the ball's centre over the samples of a block but for its halo. A sample
    /// without data stays without, and only patches with four samples bear the ball.
    pub(super) fn centres(&self, block: &Block) -> Block {
        let bearing = Bearing::of(block);
        let inner = |samples: usize| samples.saturating_sub(2 * self.halo);
        let (columns, rows) = (inner(block.columns), inner(block.rows));
        let mut centres = Block {
            columns,
            rows,
            heights: vec![f64::NEG_INFINITY; columns * rows],
        };
        self.on_nodes(block, &bearing, &mut centres);
        for axis in [Axis::North, Axis::East] {
            self.on_lines(block, &bearing, axis, &mut centres);
        }
        for row in 0..rows {
            for column in 0..columns {
                let own = block.heights[block.at(column + self.halo, row + self.halo)];
                let centre = &mut centres.heights[row * columns + column];
                // Also where it is NaN.
                *centre = if own.is_nan() {
                    own
                } else {
                    centre.max(own + self.radius)
                };
            }
        }
        centres
    }

    /// Where the ball rests on a sample.
    fn on_nodes(&self, block: &Block, bearing: &Bearing, centres: &mut Block) {
        for (x, y, cap) in self.caps.iter() {
            let first = self.halo.saturating_add_signed(*x);
            for row in 0..centres.rows {
                let from = block.at(first, (row + self.halo).saturating_add_signed(*y));
                let samples = &bearing.nodes[from..from + centres.columns];
                let line = row * centres.columns;
                let line = &mut centres.heights[line..line + centres.columns];
                for (centre, sample) in line.iter_mut().zip(samples) {
                    let height = sample + cap;
                    *centre = if height > *centre { height } else { *centre };
                }
            }
        }
    }

    /// Where the ball rests within a stretch of a line along an axis.
    fn on_lines(&self, block: &Block, bearing: &Bearing, axis: Axis, centres: &mut Block) {
        let (across, along) = axis.sizes(block);
        let (to_across, to_along) = axis.sizes(centres);
        let (wide, reach) = (self.halo as isize, self.radius.ceil() as isize);
        for part in 0..self.lines {
            let off = part as f64 / self.lines as f64;
            // The ball's circle over the line, by the column of its middle beside the line's cell.
            let circles: Vec<_> = (-reach..=reach + 1)
                .map(|beside| {
                    (
                        beside,
                        self.radius * self.radius - (beside as f64 - off).powi(2),
                    )
                })
                .filter(|(_, squared)| *squared > 0.0)
                .map(|(beside, squared)| (beside, squared.sqrt()))
                .collect();
            for line in 0..across - usize::from(part > 0) {
                for start in 0..along - 1 {
                    if !bearing.bears(axis, line, start, part > 0) {
                        continue;
                    }
                    let at = |step: usize| {
                        let height = |line| block.heights[axis.at(block, line, start + step)];
                        match part {
                            0 => height(line),
                            _ => height(line) * (1.0 - off) + height(line + 1) * off,
                        }
                    };
                    let (low, slope) = (at(0), at(1) - at(0));
                    let steep = (1.0 + slope * slope).sqrt();
                    let sine = slope / steep;
                    for (beside, circle) in &circles {
                        let to = line as isize + beside - wide;
                        let middle = (start as f64 - circle * sine).ceil();
                        let node = middle as isize - wide;
                        if to < 0
                            || to >= to_across as isize
                            || node < 0
                            || node >= to_along as isize
                        {
                            continue;
                        }
                        let height = low + slope * (middle - start as f64) + circle * steep;
                        let index = axis.at(centres, to as usize, node as usize);
                        let centre = &mut centres.heights[index];
                        *centre = if height > *centre { height } else { *centre };
                    }
                }
            }
        }
    }
}

/// Which way a line runs.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Axis {
    East,
    North,
}

impl Axis {
    /// Samples across lines of this axis, and along them.
    const fn sizes(self, block: &Block) -> (usize, usize) {
        match self {
            Self::North => (block.columns, block.rows),
            Self::East => (block.rows, block.columns),
        }
    }

    const fn at(self, block: &Block, across: usize, along: usize) -> usize {
        match self {
            Self::North => block.at(across, along),
            Self::East => block.at(along, across),
        }
    }
}

impl Block {
    const fn at(&self, column: usize, row: usize) -> usize {
        row * self.columns + column
    }
}

/// What of a block bears a ball.
struct Bearing {
    columns: usize,
    /// Whether the patch north-east of a sample has four samples.
    patches: Vec<bool>,
    /// Samples of such patches; less than everything where a sample is of none.
    nodes: Vec<f64>,
}

impl Bearing {
    fn of(block: &Block) -> Self {
        let mut bearing = Self {
            columns: block.columns,
            patches: vec![false; block.heights.len()],
            nodes: vec![f64::NEG_INFINITY; block.heights.len()],
        };
        for row in 0..block.rows.saturating_sub(1) {
            for column in 0..block.columns.saturating_sub(1) {
                let corners = [(0, 0), (1, 0), (0, 1), (1, 1)];
                let corners = corners.map(|(x, y)| block.at(column + x, row + y));
                if corners.iter().any(|at| block.heights[*at].is_nan()) {
                    continue;
                }
                bearing.patches[corners[0]] = true;
                for at in corners {
                    bearing.nodes[at] = block.heights[at];
                }
            }
        }
        bearing
    }

    /// Returns true if a stretch of a line is in a patch with four samples, or on its edge.
    fn bears(&self, axis: Axis, line: usize, start: usize, within: bool) -> bool {
        let patch = |line: usize| match axis {
            Axis::North => self.patches[start * self.columns + line],
            Axis::East => self.patches[line * self.columns + start],
        };
        patch(line) || (!within && line > 0 && patch(line - 1))
    }
}

#[cfg(test)]
#[path = "tip_tests.rs"]
mod tests;
