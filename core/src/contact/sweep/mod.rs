//! From free space to the surface: the first crossing of the HIP's path.

pub mod intersect;

mod cells;
mod path;

pub(super) use path::{Path, SweepEnd, lower};
