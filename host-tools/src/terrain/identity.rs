//! A number that names a scene: what is felt, how large, and by which law.

use std::hash::{DefaultHasher, Hash, Hasher};

use hapterra_core::scene::Scene;

use super::{FeltGrid, Scale};
use crate::raster::Raster;

/// Hash of all heights: two files with the same content are the same terrain,
/// and a file that was changed in place is not.
pub(super) fn fingerprint(raster: &Raster) -> u64 {
    let mut hasher = DefaultHasher::new();
    (raster.columns(), raster.rows()).hash(&mut hasher);
    let mut heights = vec![0.0; raster.columns() as usize];
    let mut bytes = vec![0; 8 * heights.len()];
    for row in 0..raster.rows() {
        raster.copy_row(0, row, 0, &mut heights);
        for (to, height) in bytes.chunks_exact_mut(8).zip(&heights) {
            to.copy_from_slice(&height.to_le_bytes());
        }
        hasher.write(&bytes);
    }
    hasher.finish()
}

/// The epoch of a scene over a terrain; the scene's own epoch does not count.
pub(super) fn epoch(fingerprint: u64, grid: &FeltGrid<'_>, scale: &Scale, scene: &Scene) -> u32 {
    let mut hasher = DefaultHasher::new();
    fingerprint.hash(&mut hasher);
    grid.hash_shape(&mut hasher);
    let numbers = [scale.cell_mm(), scale.height_mm_per_unit()];
    numbers.map(f64::to_bits).hash(&mut hasher);
    // Everything else that the scene states.
    format!("{:?}", Scene { epoch: 0, ..*scene }).hash(&mut hasher);
    hasher.finish() as u32
}
