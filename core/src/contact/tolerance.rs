//! The tolerances of the contact, in one place, with their origins.
//!
//! Lengths are in cells. An `f32` in `[0.5, 1)` resolves 6·10⁻⁸; a value that is rounded a few
//! times is exact to a small multiple of that.

/// Distance below which two places in a patch count as the same: two units in the last place of a
/// coordinate below 1.
pub(super) const RESOLUTION: f32 = 1.2e-7;
/// Maximum of the same, for a HIP so far away that its coordinates resolve no better.
pub(super) const COARSEST_RESOLUTION: f32 = 0.25;
/// Length below which a step is omitted: a coordinate near 1 cannot resolve it.
pub(super) const MIN_STEP: f32 = 6e-8;
/// Length below which a Newton step may be rounding alone, and is compared with the rounding of its
/// slope.
pub(super) const DOUBTFUL_STEP: f32 = 1e-3;
/// Distance from a patch's border within which a place of a convex patch counts as neither inside
/// nor on it, ten times the error of its closest point. The tolerance for "on the border" is
/// [`BESIDE`].
pub(super) const BORDER: f32 = 1e-6;
/// Distance from an edge, in multiples of the resolution, within which a place is beside it and the
/// patch beyond is searched as well.
pub(super) const BESIDE: f32 = 4.0;
/// Minimum path into a neighbouring patch, away from the shared border: three units in the last
/// place.
pub(super) const MIN_DISPLACEMENT: f32 = 2e-7;
/// Rounding of a slope of the distance, relative to its summands.
pub(super) const SLOPE_NOISE: f32 = 1e-6;
/// Relative difference within which two directions downhill count as equally steep: heights of two
/// tiles count from different bases.
pub(super) const EQUALLY_STEEP: f32 = 1e-5;

/// Maximum |a| + |b| + |c| of a patch for Newton's method in both variables: the height's rounding
/// is then below 10⁻⁶ cell.
pub(super) const STEEPEST_CONVEX: f32 = 6.0;
/// Maximum |a·z| that keeps the Hessian's eigenvalues at ½ or more.
pub(super) const CONVEX: f32 = 0.5;
/// Maximum depth times slope for Newton's method to start above the HIP.
pub(super) const SHALLOW: f32 = 0.25;
/// Permitted error of Newton's method.
pub(super) const NEWTON_ERROR: f32 = 5e-8;
/// Slope of half the squared distance below which it is uncertain which side of a convex patch's
/// edge is downhill.
pub(super) const LEVEL: f32 = 1e-5;

/// Distance from a patch's border within which its neighbours may be searched, for a HIP that is
/// not far (`edge_fade::FULL_FORCE_DISTANCE`): `BESIDE` resolutions at 32 cells.
pub(super) const BESIDE_OF_NEAR_HIP: f32 = 4e-5;

/// Rounding of a height, relative to the four corner heights, with some margin.
pub(super) const HEIGHT_NOISE: f32 = 1e-5;
/// Length of a step over a cell's corner that is ignored where the path leaves the surface.
pub(super) const TINY_STEP: f32 = 1e-6;
