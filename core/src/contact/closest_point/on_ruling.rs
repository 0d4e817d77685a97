//! One ruling of a patch, and its point closest to the HIP.
//!
//! With v fixed, a patch is a straight line, a ruling, with slope m = b + a·v. Its closest point to
//! a HIP at (p, q) has a closed form:
//!
//! ```text
//! g = z(p, v)                    height of the ruling's line over the HIP
//! z = g / (1 + m²)               height of its closest point
//! u = p − m·z                    clamped to [0, 1]
//! ```
//!
//! On a steep ruling, u is computed from the height instead, as (z − z(0, v))/m, and 1 − u in the
//! same way from the other end. Both are then exact to the last place, at any distance from an end
//! or from the HIP. Height and slopes across are computed from both without cancellation.

use crate::contact::surface::patch::Patch;

/// A ruling's closest point, and the derivatives of the distance from ruling to ruling.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ruling {
    pub(super) u: f32,
    pub(super) v: f32,
    /// Height above the HIP, cells.
    pub(super) z: f32,
    /// Displacement from the HIP, east and north, cells.
    pub(super) offset: (f32, f32),
    /// F′(v)/2
    pub(super) slope: f32,
    /// F″(v)/2
    pub(super) curvature: f32,
    /// Slope of the ruling itself.
    pub(super) along: f32,
    /// Slope of the patch across the ruling at the point.
    pub(super) across: f32,
    /// True if the point is an end of the ruling, and the closest point of its line lies beyond.
    pub(super) at_end: bool,
}

/// Rounding noise of a ruling.
pub(super) struct Noise {
    /// Noise of F(v), the squared distance from the HIP, cells².
    pub(super) f: f32,
    /// Noise of F′(v)/2.
    pub(super) slope: f32,
}

impl Ruling {
    /// Returns the closest point of the ruling at `v`, for a HIP at `(p, q)` in patch coordinates.
    #[inline]
    pub(super) fn at(patch: &Patch, (p, q): (f32, f32), v: f32) -> Self {
        let left = 1.0 - v;
        let mix = |south: f32, north: f32| south * left + north * v;
        let [sw, se, nw, ne] = patch.corners;
        let (start, end, m) = (mix(sw, nw), mix(se, ne), mix(patch.b[0], patch.b[1]));
        let flatness = 1.0 / (1.0 + m * m);
        let free_z = (start + m * p) * flatness;
        let (mut free_u, mut complement) = if m.abs() <= 1.0 {
            let u = p - m * free_z;
            (u, 1.0 - u)
        } else {
            let run = 1.0 / m;
            ((free_z - start) * run, (end - free_z) * run)
        };
        // The larger one adds no information to the smaller one.
        if free_u < complement {
            complement = 1.0 - free_u;
        } else {
            free_u = 1.0 - complement;
        }
        let at_end = !(free_u >= 0.0 && complement >= 0.0);
        let (u, z, across, curvature);
        if at_end {
            (u, z, across) = if free_u > 0.5 {
                (1.0, end, patch.c[1])
            } else {
                (0.0, start, patch.c[0])
            };
            curvature = 1.0 + across * across;
        } else {
            (u, z) = (free_u, free_z);
            across = patch.c[0] * complement + patch.c[1] * u;
            let za = patch.a * z;
            curvature = 1.0 + (across * across - za * (za + 2.0 * m * across)) * flatness;
        }
        let (du, dv) = (u - p, v - q);
        Self {
            u,
            v,
            z,
            offset: (du, dv),
            slope: dv + z * across,
            curvature,
            along: m,
            across,
            at_end,
        }
    }

    /// Returns by how much F is smaller here than at another ruling.
    ///
    /// The difference of squares is computed from its factors: with a far HIP the squares
    /// themselves would lose it to rounding.
    pub(super) fn gain_on(&self, other: &Self) -> f32 {
        let (east, north) = (
            self.offset.0 + other.offset.0,
            self.offset.1 + other.offset.1,
        );
        (other.u - self.u) * east
            + (other.v - self.v) * north
            + (other.z - self.z) * (other.z + self.z)
    }

    /// Returns the rounding noise for a HIP at `p` east.
    ///
    /// A ruling's ends and its slope are interpolated between the corners and may cancel; for a
    /// place, only the part up to the nearer end counts.
    pub(super) fn noise(&self, patch: &Patch, p: f32) -> Noise {
        let [sw, se, nw, ne] = patch.with_sizes().corners;
        let mix = |south: f32, north: f32| south * (1.0 - self.v) + north * self.v;
        let (end, near) = if self.u > 0.5 {
            (mix(se, ne), 1.0 - self.u)
        } else {
            (mix(sw, nw), self.u)
        };
        let (z, across) = (self.z.abs(), self.across.abs());
        let (of_u, of_z) = if self.at_end {
            (0.0, end)
        } else {
            let slope = mix(patch.b[0].abs(), patch.b[1].abs());
            let flatness = 1.0 / (1.0 + self.along * self.along);
            let tilt = self.along.abs() * flatness;
            (
                near + (end + slope * near) * tilt + slope * z * flatness,
                (end + slope * (1.0 + p.abs())) * flatness + z * (1.0 + 2.0 * slope * tilt),
            )
        };
        let of_across = patch.a.abs() * of_u + across;
        let (du, dv) = (self.offset.0.abs(), self.offset.1.abs());
        Noise {
            // Worst case: if this hides which point is nearer, the slope decides.
            f: 4.0 * f32::EPSILON * (du * (0.5 + of_u) + z * of_z),
            // Typical case: the search ends if this hides the slope.
            slope: 0.5 * f32::EPSILON * (dv + across * of_z + z * of_across),
        }
    }
}
