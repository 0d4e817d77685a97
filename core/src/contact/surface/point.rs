//! A point on the surface: a patch, and the place in it.

use glam::Vec3;

use crate::contact::tolerance::BORDER;
use crate::grid::{Cell, GridPoint};

/// Toward which neighbours of a patch: −1, 0 or 1 eastward and northward.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Side {
    /// Eastward.
    pub east: i32,
    /// Northward.
    pub north: i32,
}

impl Side {
    /// Neither east nor north: inside the patch.
    pub const NONE: Self = Self { east: 0, north: 0 };

    /// Toward the cells to the west and south that have a place of a cell on their own
    /// border.
    #[inline]
    pub(in crate::contact) fn sharing(u: f32, v: f32) -> Self {
        Self {
            east: -i32::from(u == 0.0),
            north: -i32::from(v == 0.0),
        }
    }

    /// The neighbours over a border toward this side: one over an edge, three around
    /// a vertex. [`Self::NONE`] where a place is empty.
    #[inline]
    pub(in crate::contact) const fn neighbour(self, place: u8) -> Self {
        let Self { east, north } = self;
        match place {
            0 => Self { east, north: 0 },
            1 => Self { east: 0, north },
            _ if east == 0 || north == 0 => Self::NONE,
            _ => self,
        }
    }

    /// Of a point on a border toward this side: the border as the patch beyond `side`
    /// has it.
    #[inline]
    pub(in crate::contact) const fn across(self, side: Self) -> Self {
        Self {
            east: if side.east == 0 {
                self.east
            } else {
                -side.east
            },
            north: if side.north == 0 {
                self.north
            } else {
                -side.north
            },
        }
    }

    /// Of a point on this border: the side on which a way to `to` leads over it.
    #[inline]
    pub(in crate::contact) fn toward(self, to: (f32, f32), (u, v): (f32, f32)) -> Self {
        let toward = |border: i32, way: f32| if border as f32 * way > 0.0 { border } else { 0 };
        Self {
            east: toward(self.east, to.0 - u),
            north: toward(self.north, to.1 - v),
        }
    }
}

/// A point on the surface; its height is its patch's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfacePoint {
    /// The patch.
    pub cell: Cell,
    /// Eastward coordinate in the patch, `[0, 1]`.
    pub u: f32,
    /// Northward coordinate in the patch, `[0, 1]`.
    pub v: f32,
}

impl SurfacePoint {
    /// The same point as the neighbouring patch on a side has it, for a point on,
    /// or as good as on, the border that both share.
    #[must_use]
    pub fn across(&self, side: Side) -> Self {
        Self {
            cell: self.neighbour(side),
            u: beyond(self.u, side.east),
            v: beyond(self.v, side.north),
        }
    }

    /// The neighbouring patch on a side.
    #[inline]
    pub(in crate::contact) const fn neighbour(&self, side: Side) -> Cell {
        Cell::new(self.cell.x + side.east, self.cell.y + side.north)
    }

    /// Another place of the same patch.
    pub(in crate::contact) const fn moved_to(&self, u: f32, v: f32) -> Self {
        Self {
            cell: self.cell,
            u,
            v,
        }
    }

    /// Returns true if it is the very place that `other` is, also where they name it in
    /// different patches.
    pub(in crate::contact) fn is_same_place(&self, other: &Self) -> bool {
        let place = |point: &Self| {
            let Cell { x, y } = point.cell;
            GridPoint::new([x, y, 0], Vec3::new(point.u, point.v, 0.0))
        };
        place(self) == place(other)
    }

    /// On which side of its patch the point lies on the border;
    /// [`Side::NONE`] inside.
    #[must_use]
    pub fn border(&self) -> Side {
        self.border_within([0.0, 0.0])
    }

    /// As [`Self::border`], for a point that may be as far as that from the
    /// border, eastward and northward.
    pub(in crate::contact) fn border_within(&self, [east, north]: [f32; 2]) -> Side {
        let near = |x: f32, by: f32| i32::from(x >= 1.0 - by) - i32::from(x <= by);
        Side {
            east: near(self.u, east),
            north: near(self.v, north),
        }
    }

    /// Returns true if it is farther from its patch's border than any rounding.
    #[inline]
    pub(in crate::contact) fn is_well_inside(&self) -> bool {
        is_well_inside(self.u) && is_well_inside(self.v)
    }

    /// Its position, `height` cells above the floor of the cells `up`.
    #[inline]
    pub(in crate::contact) fn position(&self, up: i32, height: f32) -> GridPoint {
        let cell = [self.cell.x, self.cell.y, up];
        if self.is_well_inside() {
            // Only the height may carry: fewer instructions for the same bits.
            return GridPoint::over(cell, [self.u, self.v], height);
        }
        GridPoint::new(cell, Vec3::new(self.u, self.v, height))
    }
}

/// Returns true if a coordinate is farther from its patch's border than any rounding.
#[inline]
pub(in crate::contact) fn is_well_inside(x: f32) -> bool {
    x > BORDER && x < 1.0 - BORDER
}

/// A coordinate as the patch so many patches on has it, where both share it.
fn beyond(x: f32, patches: i32) -> f32 {
    match patches {
        0 => x,
        1.. => 0.0,
        _ => 1.0,
    }
}
