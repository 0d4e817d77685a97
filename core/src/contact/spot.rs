//! A point on the surface: a patch and the place in it.

use glam::Vec3;

use super::closest::Nearest;
use super::patch::Patch;
use crate::grid::GridPoint;
use crate::terrain::{Altitude, Corners, TileKey};

/// A point on the surface, its height left to the patch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spot {
    /// The patch's column and row.
    pub cell: [i32; 2],
    /// Eastward coordinate in the patch, `[0, 1]`.
    pub u: f32,
    /// Northward coordinate in the patch, `[0, 1]`.
    pub v: f32,
}

impl Spot {
    /// The same point as patch `cell + shift` sees it, for a point on, or as good
    /// as on, an edge or a corner that both share.
    #[must_use]
    pub fn across(&self, [east, north]: [i32; 2]) -> Self {
        Self {
            cell: self.neighbour([east, north]),
            u: beyond(self.u, east),
            v: beyond(self.v, north),
        }
    }

    /// Whether it is the very place that `other` is, also as another patch sees it.
    pub(super) fn is_same_place(&self, other: &Self) -> bool {
        let place = |spot: &Self| {
            let [x, y] = spot.cell;
            GridPoint::new([x, y, 0], Vec3::new(spot.u, spot.v, 0.0))
        };
        place(self) == place(other)
    }

    /// The patch so many columns and rows from this one.
    #[inline]
    pub(super) const fn neighbour(&self, [east, north]: [i32; 2]) -> [i32; 2] {
        [self.cell[0] + east, self.cell[1] + north]
    }

    /// Another place of the same patch.
    pub(super) const fn moved_to(&self, place: &Nearest) -> Self {
        Self {
            cell: self.cell,
            u: place.u,
            v: place.v,
        }
    }

    /// As [`Self::border`], for a point that may be as far off as that,
    /// eastward and northward.
    pub(super) fn border_within(&self, [u, v]: [f32; 2]) -> [i32; 2] {
        let near = |x: f32, by: f32| i32::from(x >= 1.0 - by) - i32::from(x <= by);
        [near(self.u, u), near(self.v, v)]
    }

    /// Toward which neighbours the point lies on the patch's border: −1, 0 or
    /// 1 eastward and northward. `[0, 0]` inside.
    #[must_use]
    pub fn border(&self) -> [i32; 2] {
        [side(self.u), side(self.v)]
    }
}

impl Spot {
    /// Whether it is well inside its patch.
    #[inline]
    pub(super) fn is_inside(&self) -> bool {
        is_inside(self.u) && is_inside(self.v)
    }

    /// Whether the way from here to a hand at `(p, q)` begins in this patch: a
    /// place on the border may face another.
    #[inline]
    pub(super) fn faces(&self, (p, q): (f32, f32)) -> bool {
        let faces = |hand: f32, x: f32| is_inside(x) || (x < 0.5) == (hand >= x);
        faces(p, self.u) && faces(q, self.v)
    }

    /// Whether the patch's tangent plane here passes over a hand at `(p, q)`, over
    /// which the patch is `above` cells high: the way to it leads into the ground.
    #[inline]
    pub(super) fn stays(&self, patch: &Patch, (p, q): (f32, f32), above: f32) -> bool {
        above >= patch.a * ((p - self.u) * (q - self.v))
    }
}

/// Distance from a patch's border, in cells, within which a place counts as
/// neither inside nor on it: only the general search goes there.
const BORDER: f32 = 1e-6;

/// Whether a coordinate is well inside a patch.
#[inline]
pub(super) fn is_inside(x: f32) -> bool {
    x > BORDER && x < 1.0 - BORDER
}

fn side(x: f32) -> i32 {
    i32::from(x == 1.0) - i32::from(x == 0.0)
}

fn beyond(x: f32, shift: i32) -> f32 {
    match shift {
        0 => x,
        1.. => 0.0,
        _ => 1.0,
    }
}

/// Column and row of the tile that holds a patch.
pub(super) fn tile_of(cell: [i32; 2]) -> [i32; 2] {
    let key = TileKey::holding(0, cell);
    [key.col, key.row]
}

/// The hand as the patches see it.
#[derive(Clone, Copy)]
pub(super) struct Hand {
    point: GridPoint,
}

impl Hand {
    pub(super) const fn new(point: GridPoint) -> Self {
        Self { point }
    }

    #[inline]
    pub(super) fn altitude(&self) -> Altitude {
        Altitude::new(self.point.cell()[2], self.point.frac().z)
    }

    #[inline]
    pub(super) fn column(&self) -> [i32; 2] {
        self.point.column()
    }

    /// The hand in a patch's coordinates.
    #[inline]
    pub(super) fn in_patch(&self, [x, y]: [i32; 2]) -> (f32, f32) {
        let local = self.point.seen_from([x, y, 0]);
        (local.x, local.y)
    }

    /// The patch of these corners, with heights counted from the hand.
    #[inline]
    pub(super) fn patch(&self, corners: &Corners) -> Patch {
        Patch::new(corners.heights).seen_from(self.altitude(), corners.base)
    }

    /// Whether any of these corners is above the hand.
    pub(super) fn is_below_any(&self, corners: &Corners) -> bool {
        let up = |height: &f32| self.altitude().up_to(corners.base, *height);
        corners.heights.iter().any(|height| up(height) > 0.0)
    }

    /// The point of the surface at `spot`, `z` cells above the hand.
    #[inline]
    pub(super) fn point_at(&self, spot: &Spot, z: f32) -> GridPoint {
        let up = self.point.cell()[2];
        let [x, y] = spot.cell;
        GridPoint::new(
            [x, y, up],
            Vec3::new(spot.u, spot.v, self.point.frac().z + z),
        )
    }

    /// As [`Self::point_at`], for a spot that is on no border.
    #[inline]
    pub(super) fn point_inside(&self, spot: &Spot, z: f32) -> GridPoint {
        let [x, y] = spot.cell;
        let cell = [x, y, self.point.cell()[2]];
        GridPoint::over(cell, [spot.u, spot.v], self.point.frac().z + z)
    }

    /// From the hand to the spot, `z` cells above it.
    pub(super) fn stretch(&self, spot: &Spot, z: f32) -> Vec3 {
        let (p, q) = self.in_patch(spot.cell);
        Vec3::new(spot.u - p, spot.v - q, z)
    }
}
