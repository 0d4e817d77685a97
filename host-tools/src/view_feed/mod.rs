//! The feed of a viewer: `hapterra-view`, a program of its own.
//!
//! ```text
//! samples, tiles ─▶ ViewFeed ─▶ bounded queue ─▶ thread ══ pipe ══▶ hapterra-view
//! ```
//!
//! The serving thread never waits for the viewer. What its queue has no room for is
//! dropped and counted; a viewer that is slow, hangs or is killed changes nothing else.
//! The stream's messages are in [`hapterra_view_stream`].

mod feed;
mod first_placement;
mod held_tiles;
mod layers;
#[cfg(test)]
mod pipe;
mod program;
mod queue;
mod scene;
mod surroundings;
mod tiles;

pub use feed::{Dropped, ViewFeed};
pub use program::{Program, ProgramError, VARIABLE};
pub use scene::{Picture, Prepared};
