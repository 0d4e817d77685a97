//! Samples under a ball, and which of them support it.

use alloc::vec;
use alloc::vec::Vec;

/// Samples of a rectangle, row by row from the south-west.
pub struct Samples {
    /// Samples from west to east.
    pub columns: usize,
    /// Samples from south to north.
    pub rows: usize,
    /// Heights; NaN for no-data.
    pub heights: Vec<f64>,
}

/// Nodes of a square within a rectangle of samples.
#[derive(Clone, Copy, Debug)]
pub struct Nodes {
    /// The south-western node, from the block's first sample.
    pub first: [usize; 2],
    /// Nodes along a side.
    pub side: usize,
}

impl Nodes {
    /// Returns the nodes within `reach` of a position along an axis, as the first and the one after
    /// the last.
    pub(super) fn near(&self, axis: usize, place: f64, reach: f64) -> (usize, usize) {
        let (first, side) = (self.first[axis] as f64, self.side as f64);
        let from = (place - reach - first).clamp(0.0, side);
        let to = place + reach - first;
        // Rounded up, and down: a cast truncates.
        let whole = from as usize;
        let from = whole + usize::from((whole as f64) < from);
        let to = if to < 0.0 { 0 } else { to as usize + 1 };
        (from, to.min(self.side))
    }
}

/// Direction of a line.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Axis {
    East,
    North,
}

impl Axis {
    /// Returns the samples across lines of this axis, and along them.
    pub(super) const fn sizes(self, block: &Samples) -> (usize, usize) {
        match self {
            Self::North => (block.columns, block.rows),
            Self::East => (block.rows, block.columns),
        }
    }

    pub(super) const fn at(self, block: &Samples, across: usize, along: usize) -> usize {
        match self {
            Self::North => block.at(across, along),
            Self::East => block.at(along, across),
        }
    }

    /// Returns the axis of its nodes across lines: 0 east, 1 north.
    pub(super) const fn across(self) -> usize {
        1 - self.along()
    }

    /// Returns the axis of its nodes along lines.
    pub(super) const fn along(self) -> usize {
        match self {
            Self::East => 0,
            Self::North => 1,
        }
    }

    pub(super) const fn node(self, side: usize, across: usize, along: usize) -> usize {
        match self {
            Self::North => along * side + across,
            Self::East => across * side + along,
        }
    }
}

impl Samples {
    pub(super) const fn at(&self, column: usize, row: usize) -> usize {
        row * self.columns + column
    }

    /// Returns the bilinear height at a node, in parts of a cell from the first sample; NaN for
    /// no-data.
    pub(super) fn between(&self, node: [usize; 2], parts: usize) -> f64 {
        let [(column, east), (row, north)] = node.map(|node| (node / parts, node % parts));
        let mix = |from: usize, to: usize, share: usize, at: &dyn Fn(usize) -> f64| match share {
            // The next sample has weight zero, even if it is no-data.
            0 => at(from),
            _ => {
                let share = share as f64 / parts as f64;
                at(from) * (1.0 - share) + at(to) * share
            }
        };
        mix(row, row + 1, north, &|row| {
            mix(column, column + 1, east, &|column| {
                self.heights[self.at(column, row)]
            })
        })
    }
}

/// Part of a block that supports a ball.
pub(super) struct Support {
    pub(super) columns: usize,
    /// True if the patch north-east of a sample has four samples.
    patches: Vec<bool>,
    /// Samples of such patches; negative infinity for a sample of no such patch.
    pub(super) nodes: Vec<f64>,
}

impl Support {
    pub(super) fn of(block: &Samples) -> Self {
        let mut support = Self {
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
                support.patches[corners[0]] = true;
                for at in corners {
                    support.nodes[at] = block.heights[at];
                }
            }
        }
        support
    }

    /// Returns true if a ball that touches a sample also touches the ground beside it: along an
    /// axis the ground rises there, or is straight.
    pub(super) fn is_between_segments(&self, block: &Samples, at: usize) -> bool {
        let (column, row) = (at % block.columns, at / block.columns);
        [Axis::East, Axis::North].into_iter().any(|axis| {
            let (line, place) = match axis {
                Axis::East => (row, column),
                Axis::North => (column, row),
            };
            let supports = |start: usize| self.supports(axis, line, start, false);
            let last = axis.sizes(block).1 - 1;
            if place == 0 || place == last || !supports(place - 1) || !supports(place) {
                return false;
            }
            let height = |place: usize| block.heights[axis.at(block, line, place)];
            height(place + 1) - height(place) >= height(place) - height(place - 1)
        })
    }

    /// Returns true if a stretch of a line is in a patch with four samples, or on its edge.
    pub(super) fn supports(&self, axis: Axis, line: usize, start: usize, within: bool) -> bool {
        let patch = |line: usize| match axis {
            Axis::North => self.patches[start * self.columns + line],
            Axis::East => self.patches[line * self.columns + start],
        };
        patch(line) || (!within && line > 0 && patch(line - 1))
    }
}
