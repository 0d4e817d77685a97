//! Messages of `hapterra` to `hapterra-view`, over a pipe and in one direction.
//!
//! A frame is the length of its body as four bytes, least significant first, and the
//! body: one [`Message`] in postcard. A body has at most [`MAX_BODY`] bytes. The first
//! message is [`Message::Hello`] with [`VERSION`]; then comes a [`Scene`] with its
//! [`Layer`]s, coarsest first, then whatever happens, in the order of time. A later scene
//! is another view of the same terrain, and finer layers may follow it. The stream ends
//! with [`Message::End`], or wherever its writer was killed.
//!
//! Any change to a type here is a new [`VERSION`]. The two programs are built from one
//! checkout, so a viewer reads its own version alone and names the other.
//!
//! Lengths are millimetres of the arm's tip in the terrain's frame, as in a recording: x
//! east, y north, z up, origin at the south-west sample at height zero. [`Scene`] says how
//! many ground metres that is.
#![forbid(unsafe_code)]

mod frame;
mod message;

pub use frame::{FrameError, MAX_BODY, read, write};
pub use message::{
    Coordinates, Hello, Layer, Link, Message, Sample, Scene, TILE_CELLS, TILE_POSTS, TickCost,
    Tile, Tiles,
};

/// Version of the stream. The first message holds it.
pub const VERSION: u16 = 3;
