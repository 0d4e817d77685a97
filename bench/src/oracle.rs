//! The oracle: the exact local closest point of the bilinear surface, in f64, by the slow and
//! simple descent of the product's tests. No variant uses it.

use hapterra_tests::invariants::descent;
use hapterra_tests::invariants::surface::{Corners, Patch};

use crate::grid::Grid;
use crate::variant::{ContactResult, Hip};

/// Errors of a result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Distance from the result's proxy to the exact closest point, cells.
    pub error: f64,
    /// Angle between the result's force and the exact one, degrees.
    pub angle: f64,
}

/// Compares a result in contact with the local closest point at the end of a descent from it.
/// `None` over the border of the field.
#[must_use]
pub fn deviation(grid: &Grid, hip: &Hip, result: &ContactResult) -> Option<Deviation> {
    let displacement = result.displacement.map(f64::from);
    let proxy = [0, 1, 2].map(|i| hip.wide[i] + displacement[i]);
    let deviation_from = |from: [f64; 2]| {
        let exact = closest(grid, &hip.wide, from)?;
        let off = [0, 1, 2].map(|i| proxy[i] - exact[i]);
        let force = [0, 1, 2].map(|i| exact[i] - hip.wide[i]);
        Some(Deviation {
            error: length(&off),
            angle: angle(&displacement, &force),
        })
    };
    let (xs, ys) = (sides(proxy[0]), sides(proxy[1]));
    let places = xs.iter().flat_map(|x| ys.iter().map(|y| [*x, *y]));
    places
        .filter_map(deviation_from)
        .min_by(|a, b| a.error.total_cmp(&b.error))
}

/// Returns the starts for a proxy at `x`: there, and on both sides of a border of patches that
/// equals it to single precision. From a sharp ridge the two sides lead to different valleys, and
/// rounding must not decide.
fn sides(x: f64) -> [f64; 3] {
    const ROUNDING: f64 = 1e-6;
    let border = x.round();
    if (x - border).abs() > ROUNDING {
        return [x; 3];
    }
    [x, border, border - 1e-12]
}

/// Returns the closest point to `hip` at the end of a descent from the point `from`; `None` off the
/// field.
#[must_use]
pub fn closest(grid: &Grid, hip: &[f64; 3], from: [f64; 2]) -> Option<[f64; 3]> {
    let patch = Patch::at(grid, from.map(|x| x.floor() as i32))?;
    Some(descent::from(grid, *hip, from, patch).at)
}

impl Corners for Grid {
    fn corners(&self, cell: [i32; 2]) -> Option<[f64; 4]> {
        self.has(cell)
            .then(|| Self::corners(self, cell).map(f64::from))
    }
}

pub(crate) fn length(v: &[f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Forces below this, in cells of displacement, have no reliable direction.
const MIN_FORCE: f64 = 1e-3;

/// Returns the angle between two forces, degrees.
pub(crate) fn angle(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    if length(b) < MIN_FORCE {
        return 0.0;
    }
    let cross = [0, 1, 2].map(|i| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        a[j] * b[k] - a[k] * b[j]
    });
    let dot = (0..3).map(|i| a[i] * b[i]).sum::<f64>();
    length(&cross).atan2(dot).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::Random;

    fn rough() -> Grid {
        let mut random = Random(5);
        Grid::from_fn("rough", [12, 12], |_, _| random.between(0.0, 3.0) as f32)
    }

    #[test]
    fn closest_point_has_no_nearer_neighbour() {
        let grid = rough();
        let mut random = Random(9);
        for _ in 0..2000 {
            let from = [random.between(1.0, 11.0), random.between(1.0, 11.0)];
            let hip = [
                from[0] + random.between(-0.5, 0.5),
                from[1] + random.between(-0.5, 0.5),
                grid.height(from[0], from[1]) - random.between(0.0, 1.0),
            ];
            let exact = closest(&grid, &hip, from).expect("inside");
            let distance = |p: &[f64; 3]| length(&[0, 1, 2].map(|i| p[i] - hip[i]));
            for i in 0..32 {
                let turn = f64::from(i) / 32.0 * std::f64::consts::TAU;
                let (x, y) = (exact[0] + 1e-5 * turn.cos(), exact[1] + 1e-5 * turn.sin());
                if grid.has([x.floor() as i32, y.floor() as i32]) {
                    let near = [x, y, grid.height(x, y)];
                    assert!(
                        distance(&near) > distance(&exact) - 1e-12,
                        "{hip:?} {exact:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn oracle_measures_error_and_angle_of_a_result() {
        let flat = Grid::from_fn("flat", [4, 4], |_, _| 2.0);
        let hip = Hip::at([1.5, 1.5, 1.75]);
        let exact = deviation(&flat, &hip, &ContactResult::touching([0.0, 0.0, 0.25]));
        assert_eq!(
            exact,
            Some(Deviation {
                error: 0.0,
                angle: 0.0
            })
        );
        let off =
            deviation(&flat, &hip, &ContactResult::touching([0.25, 0.0, 0.25])).expect("inside");
        assert!((off.error - 0.25).abs() < 1e-9 && (off.angle - 45.0).abs() < 1e-6);
    }
}
