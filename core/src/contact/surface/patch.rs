//! One bilinear patch (paper §4.1, eq. 1-7).

use glam::Vec3;

use crate::grid::Altitude;

/// z(u, v) = `d + b·u + c·v + a·u·v` in cells, u (east) and v (north) in [0, 1].
///
/// Usually the heights are relative to the haptic interface point's own height
/// ([`Self::relative_to`]), so that the altitude of the terrain costs no bit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Twist, A in eq. 2: the change of the slope along u with v.
    pub a: f32,
    /// Slope along u at v = 0 (B) and at v = 1.
    pub b: [f32; 2],
    /// Slope along v at u = 0 (C) and at u = 1.
    pub c: [f32; 2],
    /// Heights of the corners: south-west (D), south-east, north-west,
    /// north-east.
    pub corners: [f32; 4],
}

impl Patch {
    /// Creates a patch from the corner heights: south-west, south-east, north-west, north-east.
    #[must_use]
    #[inline]
    pub fn new(corners: [f32; 4]) -> Self {
        let [sw, se, nw, ne] = corners;
        Self {
            a: (ne - nw) - (se - sw),
            b: [se - sw, ne - nw],
            c: [nw - sw, ne - se],
            corners,
        }
    }

    /// Returns the patch with heights relative to the altitude `from`; its own heights count from
    /// `base` whole cells.
    #[must_use]
    #[inline]
    pub fn relative_to(self, from: Altitude, base: i32) -> Self {
        self.with_corners(|height| from.up_to(base, height))
    }

    /// Returns the patch with the magnitudes of its corners' heights, for rounding bounds.
    #[inline]
    pub(in crate::contact) fn with_sizes(self) -> Self {
        self.with_corners(f32::abs)
    }

    /// Returns the patch with other corners and the same slopes.
    #[inline]
    fn with_corners(self, change: impl Fn(f32) -> f32) -> Self {
        // Not `map`, which compiles to a loop with calls: a third of a tick.
        let [sw, se, nw, ne] = self.corners;
        Self {
            corners: [change(sw), change(se), change(nw), change(ne)],
            ..self
        }
    }

    /// Returns the patch with u and v exchanged.
    #[must_use]
    #[inline]
    pub const fn transposed(&self) -> Self {
        let [sw, se, nw, ne] = self.corners;
        Self {
            a: self.a,
            b: self.c,
            c: self.b,
            corners: [sw, nw, se, ne],
        }
    }

    /// Returns the height at a place in the patch, cells. Exact on the edges and relatively
    /// accurate everywhere: a spike in one corner costs no bit in the others.
    #[must_use]
    #[inline]
    pub fn height(&self, u: f32, v: f32) -> f32 {
        let [sw, se, nw, ne] = self.corners;
        mix(mix(sw, se, u), mix(nw, ne, u), v)
    }

    /// Returns the height by the polynomial, also beyond the borders. It takes fewer instructions
    /// than [`Self::height`], and loses the bits that a spike cancels.
    #[must_use]
    #[inline]
    pub fn polynomial(&self, u: f32, v: f32) -> f32 {
        (self.corners[0] + self.b[0] * u) + (self.c[0] + self.a * u) * v
    }

    /// Returns ∂z/∂u, the slope eastward. Exact on the edges.
    #[must_use]
    #[inline]
    pub fn slope_u(&self, v: f32) -> f32 {
        mix(self.b[0], self.b[1], v)
    }

    /// Returns ∂z/∂v, the slope northward. Exact on the edges.
    #[must_use]
    #[inline]
    pub fn slope_v(&self, u: f32) -> f32 {
        mix(self.c[0], self.c[1], u)
    }

    /// Returns the upward normal, not normalised: its z is 1.
    #[must_use]
    pub fn normal(&self, u: f32, v: f32) -> Vec3 {
        Vec3::new(-self.slope_u(v), -self.slope_v(u), 1.0)
    }

    /// Returns the polar form (blossom) of the height: symmetric, affine in each point, and equal
    /// to [`Self::height`] if both points are equal. It is the middle Bernstein coefficient of the
    /// height along the straight line between the two points.
    #[must_use]
    #[inline]
    pub fn blossom(&self, (u0, v0): (f32, f32), (u1, v1): (f32, f32)) -> f32 {
        0.5 * (self.height(u0, v1) + self.height(u1, v0))
    }
}

/// Interpolates from `x` at 0 to `y` at 1, exact at both.
#[inline]
pub(crate) fn mix(x: f32, y: f32, t: f32) -> f32 {
    x * (1.0 - t) + y * t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patch_reproduces_its_corner_heights() {
        let p = Patch::new([1.0, 3.0, 7.0, 2.0]);
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
        assert_eq!(corners.map(|(u, v)| p.height(u, v)), [1.0, 3.0, 7.0, 2.0]);
    }

    #[test]
    fn edges_are_straight_and_the_middle_is_the_mean() {
        let p = Patch::new([1.0, 3.0, 7.0, 2.0]);
        assert_eq!(p.height(0.5, 0.0), 2.0);
        assert_eq!(p.height(1.0, 0.25), 2.75);
        assert_eq!(p.height(0.5, 0.5), 3.25);
    }

    #[test]
    fn slopes_and_normal_are_the_derivatives() {
        let p = Patch::new([0.5, -0.25, 1.5, 4.0]);
        let (u, v, h) = (0.375, 0.625, 1.0 / 64.0);
        let along_u = (p.height(u + h, v) - p.height(u - h, v)) / (2.0 * h);
        let along_v = (p.height(u, v + h) - p.height(u, v - h)) / (2.0 * h);
        assert!((along_u - p.slope_u(v)).abs() < 1e-5);
        assert!((along_v - p.slope_v(u)).abs() < 1e-5);
        assert_eq!(p.normal(u, v), Vec3::new(-p.slope_u(v), -p.slope_v(u), 1.0));
    }

    #[test]
    fn blossom_is_the_middle_bernstein_coefficient() {
        let p = Patch::new([0.5, -0.25, 1.5, 4.0]);
        let (from, to) = ((0.125, 0.875), (0.75, 0.25));
        let (f0, f1, f2) = (
            p.height(from.0, from.1),
            p.blossom(from, to),
            p.height(to.0, to.1),
        );
        for s in [0.0_f32, 0.2, 0.5, 0.9, 1.0] {
            let at = (from.0 + s * (to.0 - from.0), from.1 + s * (to.1 - from.1));
            let bernstein = f0 * (1.0 - s) * (1.0 - s) + 2.0 * f1 * s * (1.0 - s) + f2 * s * s;
            assert!((bernstein - p.height(at.0, at.1)).abs() < 1e-5);
        }
    }

    #[test]
    fn spike_costs_no_bit_in_other_corners() {
        let p = Patch::new([0.645_8, 1e6, 0.645_8, -3e7]);
        assert_eq!(p.height(0.0, 0.3), 0.645_8);
        assert_eq!(p.slope_v(0.0), 0.0);
        let q = Patch::new([1e6, 0.645_8, -1e6, 0.25]);
        assert_eq!(q.height(1.0, 0.0), 0.645_8);
        assert_eq!(q.height(1.0, 1.0), 0.25);
        assert_eq!(q.slope_v(1.0), 0.25 - 0.645_8);
        assert_eq!(q.blossom((1.0, 0.0), (1.0, 1.0)), 0.5 * (0.645_8 + 0.25));
    }
}
