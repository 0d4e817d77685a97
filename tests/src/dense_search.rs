//! An oracle of a bilinear surface, in `f64` and by dense search: slow, plain, and without code of
//! the product. Everything is in cells.

/// A height field as a function of the sample; NaN is no-data.
pub struct Oracle<'h> {
    height: &'h dyn Fn(i64, i64) -> f64,
    /// Patches east and north.
    size: [i64; 2],
}

impl<'h> Oracle<'h> {
    /// Creates a field of `size` patches.
    #[must_use]
    pub fn new(size: [i64; 2], height: &'h dyn Fn(i64, i64) -> f64) -> Self {
        Self { height, size }
    }

    /// Returns the height of the surface, or `None` at no-data and off the field. A point on the
    /// border of a patch belongs to it.
    #[must_use]
    pub fn surface(&self, x: f64, y: f64) -> Option<f64> {
        let (i, j) = (x.floor() as i64, y.floor() as i64);
        let west = if x == i as f64 { i - 1 } else { i };
        let south = if y == j as f64 { j - 1 } else { j };
        let mut patches = (west..=i).flat_map(|i| (south..=j).map(move |j| [i, j]));
        patches.find_map(|patch| self.in_patch(patch, x, y))
    }

    fn in_patch(&self, [i, j]: [i64; 2], x: f64, y: f64) -> Option<f64> {
        if !(0..self.size[0]).contains(&i) || !(0..self.size[1]).contains(&j) {
            return None;
        }
        let (u, v) = (x - i as f64, y - j as f64);
        let [sw, se, nw, ne] =
            [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(di, dj)| (self.height)(i + di, j + dj));
        let height =
            (1.0 - u) * (1.0 - v) * sw + u * (1.0 - v) * se + (1.0 - u) * v * nw + u * v * ne;
        // A weight of zero times no-data is also no-data.
        (!height.is_nan()).then_some(height)
    }

    /// Returns true if all surface within `reach` of a point has data.
    #[must_use]
    pub fn is_known_around(&self, x: f64, y: f64, reach: f64) -> bool {
        let steps = (2.0 * reach).ceil() as i32 + 1;
        let at = |i: i32| reach * (2.0 * f64::from(i) / f64::from(steps) - 1.0);
        (0..=steps).all(|i| (0..=steps).all(|j| self.surface(x + at(i), y + at(j)).is_some()))
    }

    /// Returns how much closer to the HIP than `from` a point of the surface within `reach` is:
    /// zero at a local closest point if `reach` excludes the next one.
    ///
    /// Dense search in circles of shrinking radius.
    #[must_use]
    pub fn closer_nearby(&self, hip: [f64; 3], from: [f64; 2], reach: f64) -> f64 {
        let distance = |x: f64, y: f64| {
            self.surface(x, y).map_or(f64::INFINITY, |z| {
                ((x - hip[0]).powi(2) + (y - hip[1]).powi(2) + (z - hip[2]).powi(2)).sqrt()
            })
        };
        let here = distance(from[0], from[1]);
        let mut best = here;
        let mut radius = reach;
        while radius > 1e-6 {
            for step in 0..48 {
                let (sin, cos) = (f64::from(step) * std::f64::consts::TAU / 48.0).sin_cos();
                best = best.min(distance(from[0] + radius * cos, from[1] + radius * sin));
            }
            radius *= 0.6;
        }
        here - best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oracle_finds_plane_surface_and_detects_wrong_proxy() {
        let height = |x: i64, _: i64| x as f64;
        let oracle = Oracle::new([10, 10], &height);
        assert_eq!(oracle.surface(2.5, 3.0), Some(2.5));
        assert_eq!(oracle.surface(10.5, 3.0), None);
        // Below the slope at (5, 5, 4) the closest point is (4.5, 5, 4.5).
        assert!(oracle.closer_nearby([5.0, 5.0, 4.0], [4.5, 5.0], 0.3) < 1e-12);
        assert!(oracle.closer_nearby([5.0, 5.0, 4.0], [4.6, 5.0], 0.02) > 1e-3);
    }

    #[test]
    fn no_data_removes_every_patch_that_touches_it() {
        let height = |x: i64, y: i64| if (x, y) == (5, 5) { f64::NAN } else { 0.0 };
        let oracle = Oracle::new([10, 10], &height);
        assert_eq!(oracle.surface(4.5, 5.0), None);
        assert_eq!(oracle.surface(3.9, 5.0), Some(0.0));
        assert!(!oracle.is_known_around(3.9, 5.0, 0.5));
    }
}
