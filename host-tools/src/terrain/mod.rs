//! A raster in the device's form: at a scale, counted in cells, cut into tiles.
//!
//! [`HapticGrid`] lays square cells over the raster; [`Scale`] converts the file's units to device
//! millimetres and to cells; [`Terrain`] is a raster at that scale and one level of detail. Its
//! tiles are made one by one on request: nothing of the raster is copied or kept.

mod distortion;
mod fallback;
mod haptic_grid;
mod identity;
#[cfg(test)]
pub(crate) mod in_file;
mod steps;
mod tiler;

pub use distortion::Distortion;
pub use hapterra_touch::tip::MAX_CELLS as MAX_TIP_CELLS;
pub use hapterra_touch::{Scale, ScaleError};
pub use haptic_grid::{HapticCells, HapticGrid};
pub(crate) use identity::fingerprint;
pub use tiler::{INTERPOLATED_STEP, Terrain, TerrainError, TileBuffer};
