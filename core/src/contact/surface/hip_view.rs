//! The surface as the haptic interface point (HIP) sees it.

use glam::Vec3;

use super::patch::Patch;
use super::point::{Side, SurfacePoint};
use crate::contact::tolerance::RESOLUTION;
use crate::grid::{Altitude, Cell, GridPoint};
use crate::terrain::{Corners, Ground, Window};

/// A point to see patches from, with its place in their coordinates and their
/// heights counted from its own: the HIP, or where a path of the HIP begins.
#[derive(Clone, Copy)]
pub(in crate::contact) struct HipView {
    hip: GridPoint,
}

impl HipView {
    pub(in crate::contact) const fn new(hip: GridPoint) -> Self {
        Self { hip }
    }

    #[inline]
    pub(in crate::contact) fn altitude(&self) -> Altitude {
        Altitude::new(self.hip.cell()[2], self.hip.frac().z)
    }

    /// The cell that the HIP is over.
    #[inline]
    pub(in crate::contact) fn column(&self) -> Cell {
        self.hip.column()
    }

    /// The HIP in a patch's coordinates.
    #[inline]
    pub(in crate::contact) fn in_patch(&self, cell: Cell) -> (f32, f32) {
        let local = self.hip.seen_from([cell.x, cell.y, 0]);
        (local.x, local.y)
    }

    /// The patch of these corners, with heights counted from the HIP.
    #[inline]
    pub(in crate::contact) fn patch(&self, corners: &Corners) -> Patch {
        Patch::new(corners.heights).seen_from(self.altitude(), corners.base)
    }

    /// Whether any of these corners is above the HIP.
    pub(in crate::contact) fn is_below_any(&self, corners: &Corners) -> bool {
        let up = |height: &f32| self.altitude().up_to(corners.base, *height);
        corners.heights.iter().any(|height| up(height) > 0.0)
    }

    /// The cell that the HIP is over and what lies there: of cells that share the place,
    /// one that is no hole.
    pub(in crate::contact) fn ground<const D: usize>(
        &self,
        window: &Window<'_, D>,
    ) -> (Cell, Ground) {
        let (place, column) = (self.hip.frac(), self.column());
        let shared = Side::sharing(place.x, place.y);
        // A loop around one call: as an iterator it takes 240 bytes of an image more.
        for place in 0..4 {
            let side = match place {
                0 => Side::NONE,
                _ => shared.neighbour(place - 1),
            };
            let cell = column.offset(side.east, side.north);
            let ground = window.ground(cell);
            if ground != Ground::Hole {
                return (cell, ground);
            }
        }
        (column, Ground::Hole)
    }

    /// Whether the HIP is above the patch of these corners, which it is over.
    pub(in crate::contact) fn is_above(&self, cell: Cell, corners: &Corners) -> bool {
        let (u, v) = self.in_patch(cell);
        self.patch(corners).height(u, v) < 0.0
    }

    /// The position of a point of the surface, `z` cells above the HIP.
    #[inline]
    pub(in crate::contact) fn position(&self, point: &SurfacePoint, z: f32) -> GridPoint {
        point.position(self.hip.cell()[2], self.hip.frac().z + z)
    }

    /// From the HIP to a point of the surface, `z` cells above it.
    #[inline]
    pub(in crate::contact) fn displacement(&self, point: &SurfacePoint, z: f32) -> Vec3 {
        let (p, q) = self.in_patch(point.cell);
        Vec3::new(point.u - p, point.v - q, z)
    }

    /// Whether one position is nearer to the HIP than another, by more than the
    /// last places of the two may be off: of a far HIP the squared distances
    /// themselves would not tell.
    // A call: five copies of it would be a kilobyte.
    #[inline(never)]
    pub(in crate::contact) fn is_nearer(&self, this: &GridPoint, other: &GridPoint) -> bool {
        let (way, left) = (other.to(this), this.to(&self.hip));
        let noise = 2.0 * RESOLUTION * (way.abs() + left.abs()).element_sum();
        way.dot(way + 2.0 * left) > noise
    }

    /// Whether one position is nearer to the HIP than another by as much as 1/1024 cell,
    /// or 2⁻²⁰ of the way that is left: whoever comes nearer by less would need more
    /// steps than anybody can wait for.
    pub(in crate::contact) fn is_clearly_nearer(
        &self,
        this: &GridPoint,
        other: &GridPoint,
    ) -> bool {
        const LEAST: f32 = 1.0 / 1024.0;
        const SHARE: f32 = 1.0 / 1_048_576.0;
        let (way, left) = (other.to(this), this.to(&self.hip));
        // A length without a root, at most √3 times the true one.
        let length = left.abs().element_sum();
        let least = if SHARE * length > LEAST {
            SHARE * length
        } else {
            LEAST
        };
        // The difference of the squared distances.
        way.dot(way + 2.0 * left) > 2.0 * length * least
    }
}
