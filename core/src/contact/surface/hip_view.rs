//! The surface relative to the haptic interface point (HIP).

use glam::Vec3;

use super::patch::Patch;
use super::point::{Side, SurfacePoint};
use crate::contact::tolerance::RESOLUTION;
use crate::grid::{Altitude, Cell, GridPoint};
use crate::terrain::{CellContent, Corners, Window};

/// A reference point for patches, whose coordinates and heights are relative to it: the HIP, or the
/// start of its path.
#[derive(Clone, Copy)]
pub(crate) struct HipView {
    hip: GridPoint,
}

impl HipView {
    pub(crate) const fn new(hip: GridPoint) -> Self {
        Self { hip }
    }

    #[inline]
    pub(crate) fn altitude(&self) -> Altitude {
        Altitude::new(self.hip.cell()[2], self.hip.frac().z)
    }

    /// Returns the cell under the HIP.
    #[inline]
    pub(crate) fn column(&self) -> Cell {
        self.hip.column()
    }

    /// Returns the HIP in a patch's coordinates.
    #[inline]
    pub(crate) fn in_patch(&self, cell: Cell) -> (f32, f32) {
        let local = self.hip.relative_to([cell.x, cell.y, 0]);
        (local.x, local.y)
    }

    /// Returns the patch of these corners, with heights relative to the HIP.
    #[inline]
    pub(crate) fn patch(&self, corners: &Corners) -> Patch {
        Patch::new(corners.heights).relative_to(self.altitude(), corners.base)
    }

    /// Returns the cell under the HIP and its content; at a border, a cell that is not no-data.
    pub(crate) fn ground<const D: usize>(&self, window: &Window<'_, D>) -> (Cell, CellContent) {
        let (place, column) = (self.hip.frac(), self.column());
        let shared = Side::sharing(place.x, place.y);
        // A loop around one call: an iterator would add 240 bytes to an image.
        for index in 0..4 {
            let side = match index {
                0 => Side::NONE,
                _ => shared.neighbour(index - 1),
            };
            let cell = column.offset(side.east, side.north);
            let ground = window.ground(cell);
            if ground != CellContent::NoData {
                return (cell, ground);
            }
        }
        (column, CellContent::NoData)
    }

    /// Returns true if the HIP is above the patch of these corners, in the cell under it.
    pub(crate) fn is_above(&self, cell: Cell, corners: &Corners) -> bool {
        let (u, v) = self.in_patch(cell);
        self.patch(corners).height(u, v) < 0.0
    }

    /// Returns the height of the HIP above another place, cells.
    #[inline]
    pub(crate) fn above(&self, other: &GridPoint) -> f32 {
        other.to(&self.hip).z
    }

    /// Returns the position of a point of the surface, `z` cells above the HIP.
    #[inline]
    pub(crate) fn position(&self, point: &SurfacePoint, z: f32) -> GridPoint {
        point.position(self.hip.cell()[2], self.hip.frac().z + z)
    }

    /// Returns the vector from the HIP to a point of the surface, `z` cells above it.
    #[inline]
    pub(crate) fn displacement(&self, point: &SurfacePoint, z: f32) -> Vec3 {
        let (p, q) = self.in_patch(point.cell);
        Vec3::new(point.u - p, point.v - q, z)
    }

    /// Returns true if one position is nearer to the HIP than another by more than their rounding.
    /// With a far HIP the squared distances themselves could not decide.
    // Not inlined: five copies would take a kilobyte.
    #[inline(never)]
    pub(crate) fn is_nearer(&self, this: &GridPoint, other: &GridPoint) -> bool {
        let (displacement, remaining) = (other.to(this), this.to(&self.hip));
        let noise = 2.0 * RESOLUTION * (displacement.abs() + remaining.abs()).element_sum();
        displacement.dot(displacement + 2.0 * remaining) > noise
    }
}
