//! The closest point to the HIP: of a ruling, of a patch, of the surface.

mod beyond_border;
mod on_convex_patch;
mod on_patch;
mod on_ruling;
mod on_surface;
mod ruling_search;

pub(super) use on_convex_patch::{Convexity, PatchPoint};
pub use on_patch::{MAX_PASSES, Nearest, nearest_downhill};
pub(super) use on_surface::{
    DepartureRule, Descent, DescentEnd, is_above_tangent_plane, position_on,
};
pub use ruling_search::MAX_EVALUATIONS;
