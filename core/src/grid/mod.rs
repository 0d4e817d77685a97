//! Positions over the terrain: an integer cell plus a fraction of it.
//!
//! One cell is 1 in x (east), y (north) *and* z (up). The origin is the south-west sample at height
//! zero. Differences of positions are computed cell by cell first, so a shift of a whole scene by
//! whole cells changes no bit of any result.

mod altitude;
mod cell;
mod point;

pub use altitude::Altitude;
pub use cell::{Cell, MAX_CELL};
pub use point::GridPoint;
