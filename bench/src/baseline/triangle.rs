//! The two-triangle split of a cell: the diagonal runs from its south-east to
//! its north-west corner, as in parry's height field.

use crate::grid::Grid;

/// One half of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Facet {
    pub(super) cell: [i32; 2],
    /// True for the north-eastern half.
    pub(super) upper: bool,
}

impl Facet {
    /// Returns the half at a point.
    #[inline]
    pub(super) fn under(x: f64, y: f64) -> Self {
        let cell = [x as i32, y as i32];
        let upper = (x - f64::from(cell[0])) + (y - f64::from(cell[1])) > 1.0;
        Self { cell, upper }
    }

    /// Returns its plane: height at the cell's south-west corner, slopes east and north.
    #[inline]
    pub(super) fn plane(self, grid: &Grid) -> Plane {
        let [sw, se, nw, ne] = grid.corners(self.cell).map(f64::from);
        let (east, north, base) = if self.upper {
            (ne - nw, ne - se, se + nw - ne)
        } else {
            (se - sw, nw - sw, sw)
        };
        let [x, y] = self.cell.map(f64::from);
        Plane {
            east,
            north,
            level: base - east * x - north * y,
        }
    }
}

/// The plane z = level + east·x + north·y.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plane {
    pub(super) east: f64,
    pub(super) north: f64,
    pub(super) level: f64,
}

impl Plane {
    /// Returns the height of the plane above a point, along z.
    #[inline]
    pub(super) fn above(&self, [x, y, z]: &[f64; 3]) -> f64 {
        self.level + self.east * x + self.north * y - z
    }

    /// Returns the upward normal with z = 1.
    #[inline]
    pub(super) fn normal(&self) -> [f64; 3] {
        [-self.east, -self.north, 1.0]
    }
}
