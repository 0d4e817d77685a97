//! What the device holds of the height field, and how it asks for more.

mod ceiling;
mod pull;
#[cfg(test)]
pub(crate) mod testing;
mod tile;
mod window;

pub use ceiling::{Altitude, Box2};
pub use pull::{Focus, HORIZON_TICKS, IN_FLIGHT, MARGIN_CELLS, Puller, RETRY_TICKS};
pub(crate) use tile::BLOCK_SHIFT;
pub use tile::{BadTile, POSTS, TILE_CELLS, TILE_SHIFT, Tile, TileKey};
pub use window::{Corners, Ground, Window};
