//! Largest distance of each tile of a window from the coarse fallback while it blends in.
//!
//! A tile that comes where the fallback was rendered does not take its place at once: each sample
//! moves from the fallback's height to the tile's at a bounded rate. The sample of a tile that may
//! be `a` cells away from the fallback is rendered at
//!
//! ```text
//! c + (f − c brought within ±a)        c: the fallback's height there, f: the tile's
//! ```
//!
//! `a` grows from tick to tick until the tile is the surface as it is. A
//! sample that several tiles share is that of the tile which may be farthest from the fallback,
//! and of the fallback where none of them is here. So no border is open, a tile that has settled
//! is rendered by its own samples alone, and what has not come bends to it along its border.
//!
//! In each tick the surface is bilinear in each cell, so the contact is as exact as over any
//! other field. Where the fallback has no height (beyond it, in its holes, or before it comes) a
//! tile is the surface at once.

use super::index::{TileIndex, wrap};

/// Speed of the surface from the coarse fallback to an arrived tile, millimetres of the tip
/// a second. So a force changes by it at most by this times the stiffness: 25 N/s at 0.5 N/mm, where the
/// guard lets 1,000 N/s through.
pub const SETTLING_MM_S: f32 = 50.0;

/// Largest distance of a window's tiles from the coarse fallback.
pub(super) struct TileBlend<const D: usize> {
    /// By slot: how far now, and from how far on the tile is the surface as it is; cells.
    pub(super) slots: [[Allowance; D]; D],
    /// Number of tiles that blend in.
    pub(super) count: u16,
    /// True if the surface may have changed otherwise since the last tick.
    pub(super) has_changed: bool,
}

#[derive(Clone, Copy)]
pub(super) struct Allowance {
    pub(super) now: f32,
    pub(super) far: f32,
}

impl Allowance {
    /// Of a slot whose tile does not settle: any.
    const ANY: Self = Self {
        now: f32::INFINITY,
        far: 0.0,
    };
}

impl<const D: usize> TileBlend<D> {
    pub(super) const NOTHING: Self = Self {
        slots: [[Allowance::ANY; D]; D],
        count: 0,
        has_changed: false,
    };

    pub(super) const fn slot(index: TileIndex) -> (usize, usize) {
        (wrap::<D>(index.row), wrap::<D>(index.col))
    }

    /// The tile in the slot of `index` settles from now on, or does not.
    pub(super) fn begin(&mut self, index: TileIndex, far: Option<f32>) {
        let (row, col) = Self::slot(index);
        let slot = &mut self.slots[row][col];
        if slot.now < f32::INFINITY {
            self.count -= 1;
        }
        *slot = match far {
            Some(far) => Allowance { now: 0.0, far },
            None => Allowance::ANY,
        };
        self.count += u16::from(far.is_some());
    }

    pub(super) fn allowed(&self, index: TileIndex) -> f32 {
        let (row, col) = Self::slot(index);
        self.slots[row][col].now
    }
}

/// A height brought within `allowed` of another; the very height where it is within, and where
/// the other is none.
pub(super) fn within(height: f32, of: f32, allowed: f32) -> f32 {
    let off = height - of;
    if off > allowed {
        of + allowed
    } else if off < -allowed {
        of - allowed
    } else {
        // Also where either is no number.
        height
    }
}
