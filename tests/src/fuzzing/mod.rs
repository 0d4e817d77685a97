//! What is done with arbitrary bytes: the bodies of the fuzz targets in `fuzz/`,
//! which a plain test drives, too (`tests/fuzzed.rs`).

mod bytes;
pub mod tick;
pub mod tile;
pub mod wire;
