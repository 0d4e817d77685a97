//! Events: what happens while a terrain is touched, as lines of JSON on a local socket.
//!
//! ```text
//! samples, marks ─ Watcher ─ queue ─ thread of the Server ─ a buffer for each reader ═ reader
//! ```
//!
//! [`Watcher`] belongs to a device and makes an [`Event`] of a change. It never waits: the queue and
//! the buffers have bounds, and a line that finds no room is dropped and counted
//! (`docs/how-to/events.md`).

mod event;
mod server;
mod watcher;

pub use event::{Event, FORMAT, Place};
pub use server::{Sender, Server};
pub use watcher::Watcher;
