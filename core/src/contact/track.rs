//! The proxy's way when the hand has hardly moved: the closest point of the
//! patch it rests on.
//!
//! Nearly every tick in contact is of this kind. What is answered here is the
//! point that the general search ([`super::descent`]) would come to rest at;
//! as soon as that is not plain, more is looked at ([`super::glide`]).

use glam::Vec3;

use super::gentle::Gentle;
use super::presence::is_far;
use super::spot::{Hand, Spot, is_inside, tile_of};
use crate::grid::GridPoint;
use crate::terrain::{Ground, Window};

/// A proxy at rest on a gentle patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Track {
    pub(super) spot: Spot,
    /// Whether the spot is well inside the patch.
    inside: bool,
    /// A column known to hold a patch, for the hand to be over.
    pub(super) over: [i32; 2],
    pub(super) gentle: Gentle,
}

impl Track {
    /// A proxy at `spot`, which is on that patch, for a hand over `over`.
    pub(super) fn new(gentle: Gentle, over: [i32; 2], spot: Spot) -> Self {
        Self {
            spot,
            inside: spot.is_inside(),
            over,
            gentle,
        }
    }

    /// The proxy rests at another spot now, of a patch entered or of the same.
    #[inline]
    pub(super) fn rests_at(&mut self, spot: Spot, entered: Option<Gentle>) {
        self.spot = spot;
        self.inside = spot.is_inside();
        if let Some(gentle) = entered {
            self.gentle = gentle;
        }
    }

    /// The proxy, `z` cells above the hand.
    #[inline]
    pub(super) fn proxy(&self, hand: &Hand, z: f32) -> GridPoint {
        if self.inside {
            hand.point_inside(&self.spot, z)
        } else {
            hand.point_at(&self.spot, z)
        }
    }

    /// Whether a patch lies under a hand in `column`, or nothing that matters for a
    /// proxy in `cell`: the force needs no fading.
    ///
    /// # Errors
    /// The tile (column, row) under the hand is not here.
    #[inline]
    pub(super) fn is_under<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        column: [i32; 2],
        cell: [i32; 2],
    ) -> Result<bool, [i32; 2]> {
        if self.over == column || is_far(cell, column) {
            return Ok(true);
        }
        if cell != column {
            match window.ground(column) {
                Ground::Patch(_) => {}
                Ground::Hole => return Ok(false),
                Ground::Missing => return Err(tile_of(column)),
            }
        }
        self.over = column;
        Ok(true)
    }

    /// Moves the spot to the closest point for a shallow hand, and tells how far
    /// it is from the hand; `None`, and the spot as it was, where more has to be
    /// looked at.
    #[inline]
    pub(super) fn follow(&mut self, hand: &Hand) -> Option<Vec3> {
        let patch = self.gentle.seen_by(hand);
        let (p, q) = hand.in_patch(self.spot.cell);
        let above = patch.polynomial(p, q);
        let stays = self.spot.stays(&patch, (p, q), above);
        if !(self.inside && stays && self.gentle.is_shallow(above)) {
            return None;
        }
        let (to, is_exact) = self.gentle.leap(&patch, (p, q), above);
        let (u, v) = (p + to.x, q + to.y);
        let plain = is_exact && to.z >= 0.0 && self.gentle.is_convex(to.z);
        if !(plain && is_inside(u) && is_inside(v)) {
            return None;
        }
        (self.spot.u, self.spot.v) = (u, v);
        Some(to)
    }
}

#[cfg(test)]
#[path = "track_tests.rs"]
mod tests;
