//! A point on the surface: a patch, and a place in it.

use glam::Vec3;

use crate::contact::tolerance::BORDER;
use crate::grid::{Cell, GridPoint};

/// Direction to a neighbour of a patch: −1, 0 or 1 eastward and northward.
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

    /// Returns the direction to the cells in the west and south that share a place on the border of
    /// a cell.
    #[inline]
    pub(in crate::contact) fn sharing(u: f32, v: f32) -> Self {
        Self {
            east: -i32::from(u == 0.0),
            north: -i32::from(v == 0.0),
        }
    }

    /// Returns the neighbours over a border toward this side: one over an edge, three around a
    /// vertex. [`Self::NONE`] if there is none for `index`.
    #[inline]
    pub(in crate::contact) const fn neighbour(self, index: u8) -> Self {
        let Self { east, north } = self;
        match index {
            0 => Self { east, north: 0 },
            1 => Self { east: 0, north },
            _ if east == 0 || north == 0 => Self::NONE,
            _ => self,
        }
    }

    /// Returns, for a point on a border toward this side, the same border relative to the patch
    /// beyond `side`.
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

    /// Returns, for a point on this border, the side on which a path to `to` crosses it.
    #[inline]
    pub(in crate::contact) fn toward(self, to: (f32, f32), (u, v): (f32, f32)) -> Self {
        let toward = |border: i32, offset: f32| {
            if border as f32 * offset > 0.0 {
                border
            } else {
                0
            }
        };
        Self {
            east: toward(self.east, to.0 - u),
            north: toward(self.north, to.1 - v),
        }
    }
}

/// A point on the surface, at the height of its patch.
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
    /// Returns the same point relative to the neighbouring patch on a side, for a point on the
    /// shared border or beside it within rounding.
    #[must_use]
    pub fn across(&self, side: Side) -> Self {
        Self {
            cell: self.neighbour(side),
            u: beyond(self.u, side.east),
            v: beyond(self.v, side.north),
        }
    }

    /// Returns the neighbouring cell on a side.
    #[inline]
    pub(in crate::contact) const fn neighbour(&self, side: Side) -> Cell {
        Cell::new(self.cell.x + side.east, self.cell.y + side.north)
    }

    /// Returns another place of the same patch.
    pub(in crate::contact) const fn moved_to(&self, u: f32, v: f32) -> Self {
        Self {
            cell: self.cell,
            u,
            v,
        }
    }

    /// Returns true if both are the same place, even in the coordinates of different patches.
    pub(in crate::contact) fn is_same_place(&self, other: &Self) -> bool {
        let place = |point: &Self| {
            let Cell { x, y } = point.cell;
            GridPoint::new([x, y, 0], Vec3::new(point.u, point.v, 0.0))
        };
        place(self) == place(other)
    }

    /// Returns the side of its patch on whose border the point lies; [`Side::NONE`] inside.
    #[must_use]
    pub fn border(&self) -> Side {
        self.border_within([0.0, 0.0])
    }

    /// Does the same as [`Self::border`], with a tolerance for the distance from the border,
    /// eastward and northward.
    pub(in crate::contact) fn border_within(&self, [east, north]: [f32; 2]) -> Side {
        let near = |x: f32, by: f32| i32::from(x >= 1.0 - by) - i32::from(x <= by);
        Side {
            east: near(self.u, east),
            north: near(self.v, north),
        }
    }

    /// Returns true if the point is farther from its patch's border than any rounding.
    #[inline]
    pub(in crate::contact) fn is_well_inside(&self) -> bool {
        is_well_inside(self.u) && is_well_inside(self.v)
    }

    /// Returns its position, `height` cells above the floor of the cells `up`.
    #[inline]
    pub(in crate::contact) fn position(&self, up: i32, height: f32) -> GridPoint {
        let cell = [self.cell.x, self.cell.y, up];
        if self.is_well_inside() {
            // Only the height can carry here: fewer instructions for the same bits.
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

/// Returns a coordinate relative to the patch `patches` farther on, where both share it.
fn beyond(x: f32, patches: i32) -> f32 {
    match patches {
        0 => x,
        1.. => 0.0,
        _ => 1.0,
    }
}
