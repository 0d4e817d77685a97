//! Positions over the terrain: an integer cell plus a fraction of it.
//!
//! One cell is 1 in x (east), y (north) *and* z (up). The origin is the
//! south-west sample at height zero. Differences of positions are formed cell
//! by cell first, so shifting a whole scene by any number of whole cells
//! changes no bit of what is computed from it.

mod altitude;
mod cell;
mod point;

pub use altitude::Altitude;
pub use cell::{Cell, MAX_CELL};
pub use point::GridPoint;
