//! Events of a session, as lines of JSON on a local socket.
//!
//! ```text
//! samples, marks ─ Watcher ─ queue ─ thread of the Server ─ a buffer for each reader ═ reader
//! ```
//!
//! [`Watcher`] belongs to a device and sends an [`Event`] for each change. It never waits: the
//! queue and the buffers are bounded, and a line without room is dropped and counted
//! (`docs/how-to/events.md`).

mod event;
mod server;
mod watcher;

pub use event::{Event, FORMAT, Place};
pub use server::{Sender, Server};
pub use watcher::Watcher;
