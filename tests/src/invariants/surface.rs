//! The bilinear surface in f64.

use crate::scene::terrain::Terrain;

/// A field that returns the corners of a patch by its cell.
pub trait Corners {
    /// Returns the heights of a patch's corners in cells: south-west, south-east, north-west,
    /// north-east; `None` if there is no patch.
    fn corners(&self, cell: [i32; 2]) -> Option<[f64; 4]>;
}

impl Corners for Terrain {
    fn corners(&self, cell: [i32; 2]) -> Option<[f64; 4]> {
        self.patch(cell)
    }
}

/// One patch with unscaled heights: z = d + b·u + c·v + a·u·v.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// Its column and row.
    pub cell: [i32; 2],
    a: f64,
    b: f64,
    c: f64,
    d: f64,
}

impl Patch {
    /// Returns the patch of a cell, if there is one.
    #[must_use]
    pub fn at(field: &impl Corners, cell: [i32; 2]) -> Option<Self> {
        let [sw, se, nw, ne] = field.corners(cell)?;
        Some(Self {
            cell,
            a: (ne - nw) - (se - sw),
            b: se - sw,
            c: nw - sw,
            d: sw,
        })
    }

    /// Returns the height at a point of the terrain.
    #[must_use]
    pub fn height(&self, x: f64, y: f64) -> f64 {
        let (u, v) = self.local(x, y);
        self.d + self.b * u + (self.c + self.a * u) * v
    }

    /// Returns the slopes eastward and northward.
    #[must_use]
    pub fn slopes(&self, x: f64, y: f64) -> [f64; 2] {
        let (u, v) = self.local(x, y);
        [self.b + self.a * v, self.c + self.a * u]
    }

    /// Returns the slope at a point.
    #[must_use]
    pub fn slope(&self, x: f64, y: f64) -> f64 {
        let [east, north] = self.slopes(x, y);
        east.hypot(north)
    }

    /// Returns the heights of its corners.
    #[must_use]
    pub fn corners(&self) -> [f64; 4] {
        let (b, c) = (self.d + self.b, self.d + self.c);
        [self.d, b, c, b + self.c + self.a]
    }

    /// Returns the sum of the absolute terms of the height above `from` at a point: a corner with
    /// zero weight does not count.
    #[must_use]
    pub fn mixed_size(&self, x: f64, y: f64, from: f64) -> f64 {
        let (u, v) = self.local(x, y);
        let [sw, se, nw, ne] = self.corners().map(|h| (h - from).abs());
        (1.0 - v) * ((1.0 - u) * sw + u * se) + v * ((1.0 - u) * nw + u * ne)
    }

    /// Returns the twist: the change of a slope across the patch.
    #[must_use]
    pub fn twist(&self) -> f64 {
        self.a
    }

    /// Returns the middle Bernstein coefficient of the height along a straight line.
    #[must_use]
    pub fn blossom(&self, from: [f64; 2], to: [f64; 2]) -> f64 {
        let (u0, v0) = self.local(from[0], from[1]);
        let (u1, v1) = self.local(to[0], to[1]);
        self.d + 0.5 * (self.b * (u0 + u1) + self.c * (v0 + v1) + self.a * (u0 * v1 + u1 * v0))
    }

    fn local(&self, x: f64, y: f64) -> (f64, f64) {
        (x - f64::from(self.cell[0]), y - f64::from(self.cell[1]))
    }
}

/// Returns the patches of a point: one inside, two on an edge, four on a vertex, fewer next to
/// no-data.
pub fn patches_at(terrain: &Terrain, x: f64, y: f64) -> impl Iterator<Item = Patch> + '_ {
    let rows = sides(y);
    sides(x)
        .flat_map(move |col| rows.clone().map(move |row| [col, row]))
        .filter_map(|cell| Patch::at(terrain, cell))
}

/// Returns the cells along one axis that contain a coordinate.
fn sides(x: f64) -> std::ops::RangeInclusive<i32> {
    let cell = x.floor() as i32;
    if x == x.floor() {
        cell - 1..=cell
    } else {
        cell..=cell
    }
}

/// Returns the distance of two points.
#[must_use]
pub fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}
