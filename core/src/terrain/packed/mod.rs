//! The packed form of a tile's heights, used for most tiles on the link: small integers, related to
//! heights by a formula, predicted from their neighbours, and written as Rice codes. It is
//! lossless.
//!
//! [`pack`] writes it, [`Tile::unpack`](super::Tile::unpack) reads it directly into a vacant tile.
//! The reader needs 140 bytes besides the tile. It processes each sample once and reads at most 82
//! bits for it, for any bytes.
//!
//! # Bytes
//!
//! | bytes | content |
//! | --- | --- |
//! | 1 | bits 0–1: number of lines that follow, at most two; bit 2: set if there is no-data; bits 3–7: the initial Rice parameter, at most 27 |
//! | 4 | the predicted number of the first sample: `i32`, little-endian |
//! | 17 for each line | exponent `e` (`i8`, −126 to 126), offset `o` and step `s` (`i64`, little-endian) |
//! | the rest | codes, the highest bit of a byte first; ended by fewer than eight zero bits |
//!
//! The samples are in rows from the south, each row from the west. If there is no-data, a first bit
//! is set if the first sample is no-data. Samples with a height and no-data then alternate in runs:
//! the length of a run precedes its first sample, in Elias' γ code (`n` zeros, a one, and the `n`
//! bits below the highest of the length). The runs contain 1,089 samples together. A no-data sample
//! has no other bits.
//!
//! # From code to number
//!
//! A sample's number is an `i32`; all sums wrap. The prediction is `west + north − north-west` of
//! the numbers around it. In the southernmost row it is the number to the west, in the westernmost
//! column the one to the south, for the first sample the one of the header. ("North" here is the
//! row before: the one to the south.) A no-data sample has the number to its west; in the
//! westernmost column, that of the row before.
//!
//! The difference of a number and its prediction, `d`, is coded as `u = 2d` for `d ≥ 0`, else
//! `−2d − 1`. With the Rice parameter `r`: `u >> r` zeros and a one, then the lowest `r` bits of
//! `u`. Instead, twenty zeros are followed by the 32 bits of `u`, without a one.
//!
//! `r` follows the mean of `u`. A sum `m` starts as `16 << r`. After each number `m` becomes
//! `m − (m >> 4) + min(u, 2²⁷)`, and `r` the position of the highest bit of `m >> 4`, 0 if there is
//! none.
//!
//! # From number to height
//!
//! - Without lines the number `k` is an image of an `f32` that increases with it: its bits are
//!   those of `k`, and if `k` is below zero, all but the highest are inverted.
//! - A line converts a number to `(o + k·s)·2⁻ᵉ`, the sum in 64 bits (it wraps), rounded to the
//!   nearest `f32` (ties to even) before the multiplication.
//! - With two lines, the first one's `f32` is the second one's number, rounded towards zero and
//!   saturating: first the file's own heights in single precision, then these in cells.
//!
//! ```
//! use hapterra_core::terrain::packed::{MAX_PACKED, HeightStep, pack};
//! use hapterra_core::terrain::{TILE_SAMPLES, Tile, TileKey};
//!
//! // Whole metres, 30 of them to a cell, above a base of 12 cells.
//! let metres = |i: usize| f64::from(400 + (i % TILE_SAMPLES) as i32 / 2);
//! let heights: [f32; TILE_SAMPLES * TILE_SAMPLES] =
//!     core::array::from_fn(|i| (metres(i) / 30.0 - 12.0) as f32);
//! let steps = [HeightStep::Cells(1.0 / 30.0)];
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

pub use pack::{HeightStep, MAX_PACKED, pack};
pub(super) use unpack::Unpacker;

/// Bytes before the lines.
const HEAD: usize = 5;
/// Bytes of a line.
const LINE: usize = 17;
/// Bit in the first byte: there is no-data.
const NO_DATA: u8 = 4;
/// Position of the Rice parameter in the first byte.
const PARAMETER_SHIFT: u32 = 3;
