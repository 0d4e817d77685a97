//! Maximum distance of each tile of a window from the coarse fallback while it blends in.
//!
//! A tile that arrives where the fallback was rendered does not replace it at once: each sample
//! moves from the fallback's height to the tile's at a limited rate. A sample of a tile that may be
//! `a` cells away from the fallback is rendered at
//!
//! ```text
//! c + (f − c clamped to ±a)             c: the fallback's height there, f: the tile's
//! ```
//!
//! `a` grows from tick to tick until the tile is rendered unchanged. A sample that several tiles
//! share is that of the tile with the largest `a`, or that of the fallback if none of them is
//! stored. So every border is closed, a blended tile is rendered from its own samples alone, and a
//! missing tile's fallback bends to it along the border.
//!
//! In each tick the surface is bilinear in each cell, so the contact is as exact as on any other
//! field. Where the fallback has no height (beyond it, in its no-data, or before it arrives) a tile
//! is the surface at once.

use super::index::{TileIndex, wrap};

/// Speed of the surface from the coarse fallback to an arrived tile, millimetres of the tip a
/// second. It changes a force by at most this times the stiffness: 25 N/s at 0.5 N/mm, compared
/// with the guard's limit of 1,000 N/s.
pub const BLEND_MM_S: f32 = 50.0;

/// Maximum distance of a window's tiles from the coarse fallback.
pub(super) struct BlendAllowances<const D: usize> {
    /// For each slot, the present distance, and the distance from which the tile is rendered
    /// unchanged; cells.
    pub(super) slots: [[Allowance; D]; D],
    /// Number of tiles that blend in.
    pub(super) count: u16,
    /// True if the surface may have changed for another reason since the last tick.
    pub(super) has_changed: bool,
}

#[derive(Clone, Copy)]
pub(super) struct Allowance {
    pub(super) now: f32,
    pub(super) end: f32,
}

impl Allowance {
    /// Allowance of a slot whose tile does not blend: unlimited.
    const ANY: Self = Self {
        now: f32::INFINITY,
        end: 0.0,
    };
}

impl<const D: usize> BlendAllowances<D> {
    pub(super) const NONE: Self = Self {
        slots: [[Allowance::ANY; D]; D],
        count: 0,
        has_changed: false,
    };

    pub(super) const fn slot(index: TileIndex) -> (usize, usize) {
        (wrap::<D>(index.row), wrap::<D>(index.col))
    }

    /// Starts the blend of the tile in the slot of `index`, or renders it unchanged.
    pub(super) fn begin(&mut self, index: TileIndex, end: Option<f32>) {
        let (row, col) = Self::slot(index);
        let slot = &mut self.slots[row][col];
        if slot.now < f32::INFINITY {
            self.count -= 1;
        }
        *slot = match end {
            Some(end) => Allowance { now: 0.0, end },
            None => Allowance::ANY,
        };
        self.count += u16::from(end.is_some());
    }

    pub(super) fn allowed(&self, index: TileIndex) -> f32 {
        let (row, col) = Self::slot(index);
        self.slots[row][col].now
    }
}

/// Returns a height, clamped to within `allowed` of another; unchanged if the other is NaN.
pub(super) fn within(height: f32, of: f32, allowed: f32) -> f32 {
    let off = height - of;
    if off > allowed {
        of + allowed
    } else if off < -allowed {
        of - allowed
    } else {
        // Also if either is NaN.
        height
    }
}
