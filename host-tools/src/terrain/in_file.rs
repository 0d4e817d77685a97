//! Rasters that stay in their files, for tests: no height is in memory before it is read, so the
//! first read that does not wait is pending.

use std::path::Path;

use heightfield::{OpenOptions, Raster};

/// Returns a raster whose heights stay in a file of the folder; row 0 is the southernmost.
pub(crate) fn in_file(
    folder: &Path,
    [columns, rows]: [u32; 2],
    height: impl Fn(u32, u32) -> f32,
) -> Raster {
    let shape =
        format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    let mut bytes = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
    bytes.extend(format!("{shape:117}\n").bytes());
    for row in (0..rows).rev() {
        bytes.extend((0..columns).flat_map(|column| height(column, row).to_le_bytes()));
    }
    let path = folder.join("in_file.npy");
    std::fs::write(&path, bytes).expect("written");
    let options = OpenOptions {
        max_in_memory_bytes: 0,
        ..OpenOptions::default()
    };
    Raster::open(&path, &options).expect("opened")
}
