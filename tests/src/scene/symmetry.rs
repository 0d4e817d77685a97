//! Mirrored and turned scenes.

use super::terrain::Terrain;

/// One of the eight ways to lay a rectangle onto itself or its turned self.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Symmetry {
    /// East and west exchanged, first.
    pub mirror_x: bool,
    /// North and south exchanged, first.
    pub mirror_y: bool,
    /// Then east and north exchanged.
    pub transpose: bool,
}

/// All but the one that changes nothing.
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
    /// The terrain seen that way.
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

    /// A point of the terrain, where it lies then.
    #[must_use]
    pub fn point(self, terrain: &Terrain, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [columns, rows] = terrain.size.map(f64::from);
        let x = if self.mirror_x { columns - x } else { x };
        let y = if self.mirror_y { rows - y } else { y };
        if self.transpose { [y, x, z] } else { [x, y, z] }
    }
}
