//! A tile on the link.

use serde::{Deserialize, Serialize};

use crate::terrain::TileKey;

/// A tile's content.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TileMessage<'a> {
    /// The epoch of the tile's scene.
    pub epoch: u32,
    /// The tile's key.
    pub key: TileKey,
    /// The heights.
    #[serde(borrow)]
    pub heights: Heights<'a>,
}

/// The heights of a tile. A constant tile is a single number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Heights<'a> {
    /// No surface anywhere.
    NoData,
    /// All samples at `base + height` cells.
    Flat {
        /// Whole cells.
        base: i32,
        /// Cells above the base.
        height: f32,
    },
    /// 33 × 33 little-endian `f32`, in rows from the south, cells above the base; NaN is no-data.
    Samples {
        /// Whole cells.
        base: i32,
        /// 4,356 bytes.
        #[serde(borrow)]
        bytes: &'a [u8],
    },
    /// The same samples in the [`packed`](crate::terrain::packed) form: lossless to the bit, except
    /// for the bits of a NaN.
    Packed {
        /// Whole cells.
        base: i32,
        /// At most [`MAX_PACKED`](crate::terrain::packed::MAX_PACKED) bytes.
        #[serde(borrow)]
        bytes: &'a [u8],
    },
}
