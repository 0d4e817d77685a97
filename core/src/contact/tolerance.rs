//! The tolerances of the contact, in one place, with where each comes from.
//!
//! Lengths are in cells. An `f32` in `[0.5, 1)` resolves 6·10⁻⁸; what is
//! rounded a few times on its way is known to a small multiple of that.

/// Places in a patch closer than this count as the same: two units in the last
/// place of a coordinate below 1.
pub(super) const RESOLUTION: f32 = 1.2e-7;
/// The same, at most, for a HIP so far off that its coordinates resolve no better.
pub(super) const COARSEST_RESOLUTION: f32 = 0.25;
/// A step shorter than this is not taken: a coordinate near 1 cannot tell it.
pub(super) const LEAST_STEP: f32 = 6e-8;
/// A Newton step shorter than this may be rounding alone, and is compared with
/// the rounding of the slope that it comes from.
pub(super) const DOUBTFUL_STEP: f32 = 1e-3;
/// Distance from a patch's border within which a place counts as neither inside
/// nor on it: ten times what the convex patch's closest point may be off.
pub(super) const BORDER: f32 = 1e-6;
/// Distance from an edge, in multiples of the resolution, at which a place is beside
/// it and the patch beyond is asked, too.
pub(super) const BESIDE: f32 = 4.0;
/// A neighbouring patch must offer a way at least this long away from the shared
/// border: three units in the last place.
pub(super) const LEAST_WAY: f32 = 2e-7;
/// Rounding of a slope of the distance, relative to the parts it is summed from.
pub(super) const SLOPE_NOISE: f32 = 1e-6;
/// Two ways downhill are equally steep within this, relatively: heights of two
/// tiles count from other bases.
pub(super) const EQUALLY_STEEP: f32 = 1e-5;

/// Most of |a| + |b| + |c| for a patch whose closest point Newton's method finds
/// in both variables: the height's rounding is then below 10⁻⁶ cell.
pub(super) const STEEPEST_CONVEX: f32 = 6.0;
/// Most of |a·z| for the Hessian's eigenvalues to be ½ at least.
pub(super) const CONVEX: f32 = 0.5;
/// Most of depth times slope for Newton's method to begin above the HIP.
pub(super) const SHALLOW: f32 = 0.25;
/// Error that Newton's method may leave.
pub(super) const NEWTON_ERROR: f32 = 5e-8;
/// Slope of half the squared distance below which it is not certain which side
/// of a convex patch's edge is downhill.
pub(super) const LEVEL: f32 = 1e-5;

/// Distance from a patch's border within which its neighbours may be asked, for a HIP
/// that is not far (`edge_fade::FAR`): `BESIDE` resolutions at 32 cells.
pub(super) const BESIDE_OF_NEAR_HIP: f32 = 4e-5;

/// Rounding of a height relative to the four it is mixed from, and some more.
pub(super) const HEIGHT_NOISE: f32 = 1e-5;
/// Length of a step over a cell's corner that is passed over where the path
/// leaves the surface.
pub(super) const TINY_STEP: f32 = 1e-6;
