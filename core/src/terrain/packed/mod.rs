//! The packed form of a tile's heights, in which most tiles travel: small integers by a
//! formula, predicted from their neighbours, in Rice codes. No height is changed by it.
//!
//! [`pack`] writes it, [`Tile::unpack`](super::Tile::unpack) reads it straight into a vacant
//! tile. The reader needs 140 bytes besides the tile. It takes each sample once and reads
//! at most 82 bits for it, whatever the bytes are.
//!
//! # Bytes
//!
//! | bytes | what they hold |
//! | --- | --- |
//! | 1 | bits 0–1: how many lines follow, at most two; bit 2: whether there are holes; bits 3–7: the Rice parameter to begin with, at most 27 |
//! | 4 | the number that the first sample is predicted to have: `i32`, little-endian |
//! | 17 for each line | exponent `e` (`i8`, −126 to 126), offset `o` and step `s` (`i64`, little-endian) |
//! | the rest | codes, the highest bit of a byte first; ended by fewer than eight zero bits |
//!
//! The samples come row by row from the south, each row from the west. Where there are
//! holes, a first bit tells whether the first sample is one. Samples with a height and
//! holes then come in runs in turn: the length of a run is written in front of its first
//! sample, in Elias' γ code (`n` zeros, a one, and the `n` bits below the highest of the
//! length). The runs make 1,089 samples together. A hole has no other bits.
//!
//! # From code to number
//!
//! A sample's number is an `i32`; all sums wrap. The prediction is `west + north −
//! north-west` of the numbers around it. In the southernmost row it is the number to the
//! west, in the westernmost column the one to the south, for the first sample the one of
//! the header. ("North" here is the row before: the one to the south.) A hole has
//! the number to its west; in the westernmost column, that of the row before.
//!
//! The difference of a number and its prediction, `d`, is sent as `u = 2d` for `d ≥ 0`, else
//! `−2d − 1`. With the Rice parameter `r`: `u >> r` zeros and a one, then the lowest `r` bits of
//! `u`. Twenty zeros are followed by the 32 bits of `u` instead, without a one.
//!
//! `r` follows the mean of `u`. A sum `m` begins as `16 << r`. After each number `m` becomes
//! `m − (m >> 4) + min(u, 2²⁷)`, and `r` the place of the highest bit of `m >> 4`, 0 for none.
//!
//! # From number to height
//!
//! - Without lines the number `k` is the image of an `f32` that rises with it: its bits are
//!   those of `k`, and where `k` is below zero all but the highest are inverted.
//! - A line makes `(o + k·s)·2⁻ᵉ` of a number, the sum in 64 bits (it wraps), rounded to the
//!   nearest `f32` (ties to even) before it is multiplied.
//! - With two lines the first one's `f32` is taken as the next one's number, towards zero and
//!   saturating: the file's own heights in single precision, and then these in cells.
//!
//! ```
//! use hapterra_core::terrain::packed::{MAX_PACKED, Step, pack};
//! use hapterra_core::terrain::{TILE_SAMPLES, Tile, TileKey};
//!
//! // Whole metres, 30 of them to a cell, above a base of 12 cells.
//! let metres = |i: usize| f64::from(400 + (i % TILE_SAMPLES) as i32 / 2);
//! let heights: [f32; TILE_SAMPLES * TILE_SAMPLES] =
//!     core::array::from_fn(|i| (metres(i) / 30.0 - 12.0) as f32);
//! let steps = [Step::Cells(1.0 / 30.0)];
//! let mut buffer = [0; MAX_PACKED];
//! let packed = pack(&heights, 12, &steps, &mut buffer).expect("it pays");
//! assert!(packed.len() < 4 * heights.len() / 15);
//!
//! let mut tile = Tile::VACANT;
//! assert_eq!(tile.unpack(TileKey::new(0, 0, 0), 12, packed), Ok(()));
//! ```

mod bits;
mod line;
mod pack;
mod prediction;
mod rice;
mod unpack;

#[cfg(test)]
mod tests;

pub use pack::{MAX_PACKED, Step, pack};
pub(super) use unpack::Unpacker;

/// Bytes in front of the lines.
const HEAD: usize = 5;
/// Bytes of a line.
const LINE: usize = 17;
/// In the first byte: there are holes.
const HOLES: u8 = 4;
/// In the first byte: where the Rice parameter begins.
const PARAMETER_SHIFT: u32 = 3;
