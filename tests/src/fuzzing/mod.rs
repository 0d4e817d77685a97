//! Bodies of the fuzz targets in `fuzz/`: arbitrary bytes, which a plain test also runs
//! (`tests/fuzz_targets.rs`).

mod bytes;
mod materials;
pub mod terrain;
pub mod text;
pub mod tick;
pub mod tile;
pub mod wire;
