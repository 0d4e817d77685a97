//! The device's part of the height field, and its requests for more.
//!
//! - `tile`, `coarse_tile`, `packed`: the samples of a tile, fine and coarse, and their packed
//!   form;
//! - `window`: the stored tiles around the HIP, and the content of a cell; `window::late_tiles`:
//!   the surface while a tile is late;
//! - `fallback`, `blend_allowances`: the coarse tiles below the window, and the speed at which the
//!   surface moves from them to a tile that arrived;
//! - `max_pyramid`: the largest heights of squares of cells, for paths through the air;
//! - `tile_requests`: the tile to request next;
//! - `extent`, `index`, `storage`: sizes, numbers of tiles, and memory.

mod blend_allowances;
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
mod tile_requests;
mod window;

pub use blend_allowances::BLEND_MM_S;
pub use coarse_tile::CoarseTile;
pub use extent::{CellBox, FieldSize};
pub use fallback::Fallback;
pub use index::{TILE_CELLS, TILE_SAMPLES, TILE_SHIFT, TileIndex, TileKey};
pub use storage::{FieldError, TileArena};
pub use tile::{MAX_STEP_CELLS, Tile, TileError};
pub use tile_requests::{
    HORIZON_TICKS, IN_FLIGHT, MARGIN_CELLS, RETRY_TICKS, RequestHint, TileRequester,
};
pub use window::{CellContent, Corners, Window};
