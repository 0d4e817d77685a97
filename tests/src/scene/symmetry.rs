//! Mirrored and turned scenes.

use super::terrain::Terrain;

/// One of the eight symmetries of a rectangle, with or without exchange of its axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Symmetry {
    /// True to exchange east and west, first.
    pub mirror_x: bool,
    /// True to exchange north and south, first.
    pub mirror_y: bool,
    /// True to exchange east and north afterwards.
    pub transpose: bool,
}

/// Returns all but the identity.
#[must_use]
pub fn all() -> [Symmetry; 7] {
    std::array::from_fn(|i| {
        let n = i + 1;
        Symmetry {
            mirror_x: n & 1 != 0,
            mirror_y: n & 2 != 0,
            transpose: n & 4 != 0,
        }
    })
}

impl Symmetry {
    /// Returns the terrain after the symmetry.
    #[must_use]
    pub fn terrain(self, terrain: &Terrain) -> Terrain {
        let [columns, rows] = terrain.size;
        let size = if self.transpose {
            [rows, columns]
        } else {
            [columns, rows]
        };
        Terrain::from_fn(terrain.kind, size, |x, y| {
            let (x, y) = if self.transpose { (y, x) } else { (x, y) };
            let x = if self.mirror_x { columns - x } else { x };
            let y = if self.mirror_y { rows - y } else { y };
            terrain.post(x, y)
        })
    }

    /// Returns a point of the terrain after the symmetry.
    #[must_use]
    pub fn point(self, terrain: &Terrain, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [columns, rows] = terrain.size.map(f64::from);
        let x = if self.mirror_x { columns - x } else { x };
        let y = if self.mirror_y { rows - y } else { y };
        if self.transpose { [y, x, z] } else { [x, y, z] }
    }
}
