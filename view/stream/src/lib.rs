//! Messages of `hapterra` to `hapterra-view`, over a pipe and in one direction.
//!
//! A frame is the length of its body as four bytes, least significant first, and the body: one
//! [`Message`] in postcard. A body has at most [`MAX_BODY`] bytes. The first message is
//! [`Message::Hello`] with [`VERSION`]. A [`Scene`] with its [`Layer`]s follows, coarsest first,
//! then all events in the order of time. A later scene is another placement of the same terrain,
//! and finer layers may follow it. The stream ends with [`Message::End`], or anywhere if its writer
//! is killed.
//!
//! Any change to a type here needs a new [`VERSION`]. The two programs are built from one checkout,
//! so a viewer reads only its own version and reports a different one.
//!
//! Lengths are millimetres of the arm's tip in the terrain's frame, as in a recording: x east, y
//! north, z up, origin at the south-west sample at height zero. [`Scene`] contains the ground
//! metres in a millimetre.
#![forbid(unsafe_code)]

mod frame;
mod message;

pub use frame::{FrameError, MAX_BODY, read, write};
pub use message::{
    Coordinates, Hello, Layer, Link, Message, Sample, Scene, TILE_CELLS, TILE_POSTS, TickCost,
    Tile, Tiles,
};

/// Version of the stream, part of the first message.
pub const VERSION: u16 = 3;
