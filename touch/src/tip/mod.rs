//! A tip of finite radius: the surface on which a ball's centre moves.
//!
//! The centre of a ball that rests on a height field is on another height field: at each position
//! the maximum, under the ball, of the ground's height plus the ball's own height there. So a point
//! on this surface is a ball on the ground, and device and contact need no change. The host
//! computes it from a block of samples with a halo of the radius, when a tile is cut: in
//! `tile_cutter.rs` for arrays, in `host-tools/src/terrain/tiler/tile_samples.rs` for files.
//!
//! Let `S` be the bilinear surface of the samples and `R` the radius. Then
//!
//! ```text
//! centre(p) = max over |w| <= R of  S(p + w) + sqrt(R² − |w|²)
//! ```
//!
//! A bilinear patch is straight along its grid lines and along every line parallel to them. Over a
//! straight line of slope `m` at a distance `δ` the ball is a circle of radius `ρ = sqrt(R² − δ²)`,
//! which rests on the line at `ρ m / sqrt(1 + m²)` uphill, at the height of the line below `p` plus
//! `ρ sqrt(1 + m²)`. So the maximum along such a line is exact; the maximum over the surface is
//! computed along lines of both directions. Between two lines that are `d` apart the ball may rest
//! higher, by at most `d² / 4R` on a plane; `d` is chosen so that this is at most 0.5 % of the
//! radius.
//!
//! Between two nodes the centre's surface is interpolated, with an error where it bends. So the
//! distance of a ball's nodes is a fraction of its radius, whatever the samples are: **haptic
//! cells**, a whole number of which is a cell of the ground. Lengths below are in haptic cells.

mod support;

use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;

use support::{Axis, Support};
pub use support::{Nodes, Samples};

/// Maximum radius, cells of the ground.
pub const MAX_CELLS: f64 = 8.0;
/// Minimum number of haptic cells in a radius.
pub const MIN_CELLS_IN_RADIUS: f64 = 32.0;
/// Minimum side of a haptic cell, device millimetres: half an encoder's count.
pub const MIN_CELL_MM: f64 = 1.0 / 64.0;
/// Step to which heights of the centre are rounded, haptic cells: slopes have an error of at most a
/// thousandth, and tiles have half the bytes.
pub const CENTRE_STEP: f64 = 1.0 / (1 << 10) as f64;
/// Max error of the ball's height from the distance of its lines, as a part of its radius.
const MAX_SAG: f64 = 5e-3;

/// A radius that a ball over cells of this size cannot have.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "a tip of {tip_mm} mm: {cells:.1} cells of {cell_mm} mm, where 0 to {MAX_CELLS} can be rendered"
)]
pub struct TipError {
    /// The radius, mm.
    pub tip_mm: f64,
    /// The same in cells of the ground.
    pub cells: f64,
    /// Side of a cell of the ground, mm.
    pub cell_mm: f64,
}

/// A ball over a grid.
#[derive(Clone, Debug)]
pub struct Ball {
    /// Radius.
    radius: f64,
    /// Haptic cells along the side of a cell of the ground.
    parts: u32,
    /// Samples around a block on which its nodes depend.
    halo: usize,
    /// Lines in a cell of the ground.
    lines: u32,
    /// Heights of the ball over the nodes of its square, row by row; negative infinity beside it.
    caps: Arc<[f64]>,
}

/// Returns a height of the centre, haptic cells, as rounded for tiles.
#[must_use]
pub fn round_centre(centre: f64) -> f64 {
    libm::round(centre / CENTRE_STEP) * CENTRE_STEP
}

/// Nodes along the sides of the square around one patch.
pub const PATCH_NODES: usize = 2;

impl Ball {
    /// Creates a ball of a radius in millimetres over cells of the ground; `None` for the radius 0,
    /// a point.
    ///
    /// # Errors
    /// [`TipError`] for a radius below 0, above [`MAX_CELLS`] cells, or not a number.
    pub fn new(tip_mm: f64, cell_mm: f64) -> Result<Option<Self>, TipError> {
        let cells = tip_mm / cell_mm;
        match (0.0..=MAX_CELLS).contains(&cells) {
            true => Ok((cells > 0.0).then(|| Self::of(cells, cell_mm))),
            false => Err(TipError {
                tip_mm,
                cells,
                cell_mm,
            }),
        }
    }

    fn of(cells: f64, cell_mm: f64) -> Self {
        let max_parts = libm::floor(cell_mm / MIN_CELL_MM).max(1.0);
        let parts = libm::ceil(MIN_CELLS_IN_RADIUS / cells).clamp(1.0, max_parts) as u32;
        let radius = cells * f64::from(parts);
        let reach = radius as i32;
        let cap = |(x, y): (i32, i32)| {
            let squared = radius * radius - f64::from(x * x) - f64::from(y * y);
            if squared >= 0.0 {
                libm::sqrt(squared)
            } else {
                f64::NEG_INFINITY
            }
        };
        let places = (-reach..=reach).flat_map(|y| (-reach..=reach).map(move |x| (x, y)));
        let lines = 1.0 / (libm::sqrt(4.0 * MAX_SAG) * cells);
        Self {
            radius,
            parts,
            halo: libm::ceil(cells) as usize + 1,
            lines: libm::ceil(lines).clamp(1.0, 64.0) as u32,
            caps: places.map(cap).collect(),
        }
    }

    /// Returns the haptic cells along the side of a cell of the ground.
    #[must_use]
    pub const fn parts(&self) -> u32 {
        self.parts
    }

    /// Returns the number of samples around a block on which its nodes depend.
    #[must_use]
    pub const fn halo(&self) -> usize {
        self.halo
    }

    /// Returns the radius, haptic cells.
    #[must_use]
    pub const fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the samples on which `side` × `side` nodes from the node `first` depend: the first
    /// sample, which may be outside the field, the samples along a side, and the position of the
    /// nodes in them.
    #[must_use]
    pub fn samples_for(&self, first: [u32; 2], side: usize) -> ([i64; 2], usize, Nodes) {
        let (parts, halo) = (i64::from(self.parts), self.halo as i64);
        let from = first.map(|node| i64::from(node) / parts - halo);
        let nodes = Nodes {
            first: [0, 1].map(|axis| (i64::from(first[axis]) - from[axis] * parts) as usize),
            side,
        };
        // The nodes begin within the first cell after the halo.
        let cells = (side - 1).div_ceil(self.parts as usize) + 1;
        (from, cells + 1 + 2 * self.halo, nodes)
    }

    /// Returns the heights of the ball's centre over the nodes of a block, row by row: NaN on
    /// ground without data. Only patches with four samples support the ball.
    #[must_use]
    pub fn centres(&self, block: &Samples, nodes: Nodes) -> Vec<f64> {
        let support = Support::of(block);
        let mut centres = vec![f64::NEG_INFINITY; nodes.side * nodes.side];
        self.on_samples((block, &support), nodes, &mut centres);
        for axis in [Axis::North, Axis::East] {
            self.on_lines((block, &support), axis, nodes, &mut centres);
        }
        for (at, centre) in centres.iter_mut().enumerate() {
            let place = [
                nodes.first[0] + at % nodes.side,
                nodes.first[1] + at / nodes.side,
            ];
            let own = block.between(place, self.parts as usize);
            // Also if it is NaN.
            *centre = if own.is_nan() {
                own
            } else {
                centre.max(own + self.radius)
            };
        }
        centres
    }

    /// Returns the height of the bilinear surface between the four centres of a patch; `None` for
    /// no-data.
    #[must_use]
    pub fn between(&self, samples: &Samples, nodes: Nodes, [u, v]: [f64; 2]) -> Option<f64> {
        let corners = self.centres(
            samples,
            Nodes {
                side: PATCH_NODES,
                ..nodes
            },
        );
        let along = |at: usize| corners[at] * (1.0 - u) + corners[at + 1] * u;
        let height = along(0) * (1.0 - v) + along(PATCH_NODES) * v;
        Some(height).filter(|height| !height.is_nan())
    }

    /// Returns the height of the ball on a sample.
    fn on_samples(
        &self,
        (block, support): (&Samples, &Support),
        nodes: Nodes,
        centres: &mut [f64],
    ) {
        let (parts, reach) = (self.parts as usize, libm::floor(self.radius));
        let width = 2 * reach as usize + 1;
        for (at, sample) in support.nodes.iter().enumerate() {
            if *sample == f64::NEG_INFINITY || support.is_between_segments(block, at) {
                continue;
            }
            let place = [at % support.columns, at / support.columns].map(|sample| sample * parts);
            let near = |axis: usize| nodes.near(axis, place[axis] as f64, reach);
            let ((west, east), (south, north)) = (near(0), near(1));
            let beside =
                |axis: usize, node: usize| nodes.first[axis] + node + reach as usize - place[axis];
            for row in south..north {
                if west >= east {
                    break;
                }
                let line = &mut centres[row * nodes.side..][west..east];
                let caps = &self.caps[beside(1, row) * width + beside(0, west)..];
                for (centre, cap) in line.iter_mut().zip(caps) {
                    let height = sample + cap;
                    *centre = if height > *centre { height } else { *centre };
                }
            }
        }
    }

    /// Returns the height of the ball within a segment of a line along an axis.
    fn on_lines(
        &self,
        (block, support): (&Samples, &Support),
        axis: Axis,
        nodes: Nodes,
        centres: &mut [f64],
    ) {
        let (across, along) = axis.sizes(block);
        let parts = f64::from(self.parts);
        for part in 0..self.lines {
            let off = f64::from(part) / f64::from(self.lines);
            for line in 0..across - usize::from(part > 0) {
                let place = (line as f64 + off) * parts;
                let (first, end) = nodes.near(axis.across(), place, self.radius);
                for start in 0..along - 1 {
                    if first >= end || !support.supports(axis, line, start, part > 0) {
                        continue;
                    }
                    let at = |step: usize| {
                        let height = |line| block.heights[axis.at(block, line, start + step)];
                        match part {
                            0 => height(line),
                            _ => height(line) * (1.0 - off) + height(line + 1) * off,
                        }
                    };
                    let (low, slope) = (at(0), (at(1) - at(0)) / parts);
                    let steep = libm::sqrt(1.0 + slope * slope);
                    let sine = slope / steep;
                    for beside in first..end {
                        let apart = (nodes.first[axis.across()] + beside) as f64 - place;
                        // The ball's circle over the line.
                        let circle = self.radius * self.radius - apart * apart;
                        let circle = libm::sqrt(circle.max(0.0));
                        let middle = (start as f64 + 0.5) * parts - circle * sine;
                        // Includes a node that rounding puts beside both of its stretches.
                        let half = 0.5 * parts + 1e-9;
                        let (from, to) = nodes.near(axis.along(), middle, half);
                        for node in from..to {
                            let run =
                                (nodes.first[axis.along()] + node) as f64 - start as f64 * parts;
                            let height = low + slope * run + circle * steep;
                            let centre = &mut centres[axis.node(nodes.side, beside, node)];
                            *centre = if height > *centre { height } else { *centre };
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
