//! The number of a scene: a hash of the terrain, its size and the surface parameters.

use std::hash::{Hash, Hasher};

use hapterra_core::scene::Scene;
use twox_hash::XxHash64;

use super::{HapticGrid, Scale};
use heightfield::{Raster, Wait};

/// Returns the hash of the numbers of columns and rows and all heights from south-west to
/// north-east: two files with the same content are the same terrain, and a file that was changed in
/// place is another.
///
/// XXH64 with seed 0 over little-endian bytes. Recordings contain it, so it has to be the same on
/// every machine and in every later version; the standard library's hasher is not. It is computed
/// from the samples in memory: the file is not read again.
///
/// For a raster that stays in its file it is the hash of the file's index and of the heights that
/// were read when it was opened.
pub(crate) fn fingerprint(raster: &Raster) -> u64 {
    if let Some(print) = raster.print_in_file() {
        return print;
    }
    let mut hasher = XxHash64::with_seed(0);
    for count in [raster.columns(), raster.rows()] {
        hasher.write(&count.to_le_bytes());
    }
    let mut heights = vec![0.0; raster.columns() as usize];
    let mut bytes = vec![0; 8 * heights.len()];
    for row in 0..raster.rows() {
        // All samples are in memory.
        let _ = raster.read_row(0, row, 0, &mut heights, Wait::UntilRead);
        for (to, height) in bytes.chunks_exact_mut(8).zip(&heights) {
            // One bit pattern for all no-data.
            let height = if height.is_nan() { f64::NAN } else { *height };
            to.copy_from_slice(&height.to_le_bytes());
        }
        hasher.write(&bytes);
    }
    hasher.finish()
}

/// Returns the epoch of a scene over a terrain; the scene's own epoch is ignored.
pub(super) fn epoch(fingerprint: u64, grid: &HapticGrid<'_>, scale: &Scale, scene: &Scene) -> u32 {
    let mut hasher = XxHash64::with_seed(0);
    fingerprint.hash(&mut hasher);
    grid.hash_shape(&mut hasher);
    let numbers = [scale.cell_mm(), scale.height_mm_per_unit()];
    numbers.map(f64::to_bits).hash(&mut hasher);
    // All other fields of the scene.
    format!("{:?}", Scene { epoch: 0, ..*scene }).hash(&mut hasher);
    hasher.finish() as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use heightfield::{Fill, OpenOptions};

    /// Recordings identify terrains by this number, so it may never change: computed with an
    /// independent implementation of XXH64.
    const STABLE_HASH: u64 = 0x7046_36b8_d443_a868;

    #[test]
    fn fingerprint_is_stable() {
        let heights = |hole: f32| {
            Raster::from_fn(3, 2, move |x, y| match (x, y) {
                (2, 1) => hole,
                _ => (x + 10 * y) as f32,
            })
        };
        let print = |hole| fingerprint(&heights(hole).expect("raster"));
        assert_eq!(print(f32::NAN), STABLE_HASH);
        assert_eq!(print(-f32::NAN), STABLE_HASH);
        assert_ne!(print(12.0), STABLE_HASH);
    }

    #[test]
    fn filled_heights_change_the_fingerprint() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("t.asc");
        let grid = "ncols 3\nnrows 2\ncellsize 1\nNODATA_value -1\n1 -1 3 4 5 6";
        std::fs::write(&path, grid).expect("written");
        let print = |fill| {
            let options = OpenOptions {
                fill,
                ..OpenOptions::default()
            };
            fingerprint(&Raster::open(&path, &options).expect("opened"))
        };
        assert_ne!(print(None), print(Fill::within(1)));
    }
}
