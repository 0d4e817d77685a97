//! The device's part of the height field, and its requests for more.

mod coarse_tile;
mod extent;
mod fallback;
mod index;
mod max_pyramid;
pub mod packed;
mod storage;
#[cfg(test)]
pub(crate) mod testing;
mod tile;
mod tile_blend;
mod tile_requests;
mod window;

pub use coarse_tile::CoarseTile;
pub use extent::{CellBox, FieldSize};
pub use fallback::Fallback;
pub use index::{TILE_CELLS, TILE_SAMPLES, TILE_SHIFT, TileIndex, TileKey};
pub use storage::{FieldError, TileArena};
pub use tile::{MAX_STEP_CELLS, Tile, TileError};
pub use tile_blend::BLEND_MM_S;
pub use tile_requests::{
    HORIZON_TICKS, IN_FLIGHT, MARGIN_CELLS, RETRY_TICKS, RequestHint, TileRequester,
};
pub use window::{CellContent, Corners, Window};
