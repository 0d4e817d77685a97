//! Ground under the HIP.

use crate::grid::Grid;

/// Patches along a side.
const SIDE: usize = 64;

/// A kind of ground, as a height above the middle of the field.
pub(super) struct Ground {
    /// Its name in tables.
    pub(super) name: &'static str,
    height: fn(f64, f64) -> f64,
}

/// From the smoothest to the roughest.
pub(super) const GROUNDS: [Ground; 5] = [
    // Bilinear as a whole: its patches meet without an edge.
    Ground {
        name: "saddle",
        height: |x, y| 0.05 * x * y,
    },
    Ground {
        name: "smooth",
        height: |x, y| 1.5 * (0.2 * x).sin() * (0.17 * y).cos(),
    },
    // Every patch has the opposite twist of its neighbours.
    Ground {
        name: "patch edges",
        height: |x, y| {
            if (x + y).rem_euclid(2.0) < 0.5 {
                0.1
            } else {
                0.0
            }
        },
    },
    Ground {
        name: "ridge",
        height: |x, y| -0.3 * distance_to_line(x, y).abs(),
    },
    Ground {
        name: "valley",
        height: |x, y| 0.3 * distance_to_line(x, y).abs(),
    },
];

/// Returns the distance from a line oblique to the grid, cells.
fn distance_to_line(x: f64, y: f64) -> f64 {
    0.92 * x - 0.39 * y + 0.2
}

impl Ground {
    pub(super) fn grid(&self) -> Grid {
        let middle = SIDE as f64 / 2.0;
        Grid::from_fn(self.name, [SIDE; 2], |x, y| {
            (self.height)(x as f64 - middle, y as f64 - middle) as f32
        })
    }
}
