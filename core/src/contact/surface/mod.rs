//! The surface: its patches, points on it, and both as the HIP sees them.

pub mod patch;

mod hip_view;
mod point;

pub(crate) use hip_view::HipView;
pub(super) use point::is_well_inside;
pub use point::{Side, SurfacePoint};
