//! One straight line of a patch, and its point nearest to the hand.
//!
//! With v fixed, a patch is a straight line (a ruling) of slope m = b + a·v,
//! and its nearest point is known in closed form:
//!
//! ```text
//! g = z(p, v)                    height of the ruling's line over the hand's u
//! z = g / (1 + m²)               height of its nearest point
//! u = p − m·z                    clamped to [0, 1]
//! ```
//!
//! On a steep ruling u is taken from the height instead, (z − z(0, v))/m, and
//! 1 − u likewise from the other end: both then are right to the last place
//! however near to an end, or however far from the hand, the point is. Height
//! and slopes across come from the two, with nothing cancelled.

use super::patch::Patch;

/// A ruling's nearest point, and how the distance changes from ruling to
/// ruling.
#[derive(Clone, Copy)]
pub(super) struct Ruling {
    pub(super) u: f32,
    pub(super) v: f32,
    /// Height above the hand, cells.
    pub(super) z: f32,
    /// F(v), the squared distance from the hand, cells².
    pub(super) f: f32,
    /// What the last places of u and v make of it.
    pub(super) f_noise: f32,
    /// F′(v)/2
    pub(super) slope: f32,
    /// F″(v)/2
    pub(super) curvature: f32,
    /// Rounding error that `slope` may have.
    pub(super) noise: f32,
    /// Slope of the ruling itself.
    pub(super) along: f32,
    /// Slope of the patch across the ruling at the point.
    pub(super) across: f32,
    /// Whether the point is an end of the ruling, beyond which it would go on.
    pub(super) at_end: bool,
}

/// The nearest point of the ruling at `v`, for a hand at `(p, q)` in patch
/// coordinates.
#[inline]
pub(super) fn ruling(patch: &Patch, (p, q): (f32, f32), v: f32) -> Ruling {
    let left = 1.0 - v;
    let mix = |south: f32, north: f32| south * left + north * v;
    let [sw, se, nw, ne] = patch.corners;
    let (start, end, m) = (mix(sw, nw), mix(se, ne), mix(patch.b[0], patch.b[1]));
    let flatness = 1.0 / (1.0 + m * m);
    let free_z = (start + m * p) * flatness;
    let (mut free_u, mut rest) = if m.abs() <= 1.0 {
        let u = p - m * free_z;
        (u, 1.0 - u)
    } else {
        let run = 1.0 / m;
        ((free_z - start) * run, (end - free_z) * run)
    };
    // The larger one adds nothing to what the smaller one knows.
    if free_u < rest {
        rest = 1.0 - free_u;
    } else {
        free_u = 1.0 - rest;
    }
    let at_end = !(free_u >= 0.0 && rest >= 0.0);
    let (u, z, across, curvature, rounding);
    if at_end {
        let (low, high);
        (u, z, across, low, high) = if free_u > 0.5 {
            (1.0, end, patch.c[1], se, ne)
        } else {
            (0.0, start, patch.c[0], sw, nw)
        };
        curvature = 1.0 + across * across;
        // The rounding of a steep edge's height shows in the slope.
        rounding = across.abs() * mix(low.abs(), high.abs());
    } else {
        (u, z, rounding) = (free_u, free_z, 0.0);
        across = patch.c[0] * rest + patch.c[1] * u;
        let za = patch.a * z;
        curvature = 1.0 + (across * across - za * (za + 2.0 * m * across)) * flatness;
    }
    let (du, dv, lift) = (u - p, v - q, z * across);
    Ruling {
        u,
        v,
        z,
        f: du * du + dv * dv + z * z,
        f_noise: f32::EPSILON * (du.abs() + dv.abs()),
        slope: dv + lift,
        curvature,
        noise: f32::EPSILON * (dv.abs() + lift.abs() + rounding),
        along: m,
        across,
        at_end,
    }
}
