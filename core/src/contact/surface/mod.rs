//! The surface: its patches and points, and both relative to the HIP.

pub mod patch;

mod hip_view;
mod point;

pub(crate) use hip_view::HipView;
pub(super) use point::is_well_inside;
pub use point::{Side, SurfacePoint};
