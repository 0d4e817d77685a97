//! The feed of the viewer, `hapterra-view`, which is a separate program.
//!
//! ```text
//! samples, tiles ─▶ ViewFeed ─▶ bounded queue ─▶ thread ══ pipe ══▶ hapterra-view
//! ```
//!
//! The serving thread never waits for the viewer. Messages that do not fit in the queue are dropped
//! and counted; a viewer that is slow, hangs or is killed changes nothing else.
//! [`hapterra_view_stream`] defines the messages of the stream.

mod device_window;
mod feed;
mod first_placement;
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
