//! The page that shows the contact of the hand with the terrain.
//!
//! ```text
//! hapterra ══ pipe ══▶ feed ─▶ drawing ─▶ history ─▶ server ══ loopback ══▶ page (rerun in a browser)
//! ```
//!
//! - [`feed`]: messages of `hapterra` from the pipe;
//! - [`drawing`]: each message as rerun's entities, in ground metres, and the layout;
//! - [`history`]: the entries for a new page, bounded; and the pages' queues;
//! - [`server`]: the page and its stream, for this machine only;
//! - [`options`]: the options of the command line.
//!
//! Data flows in one direction. A page only requests files and the stream: only the head of a
//! request is read, and nothing is sent back to `hapterra`.
#![forbid(unsafe_code)]
#![warn(missing_docs, unreachable_pub)]

pub mod drawing;
pub mod feed;
pub mod history;
pub mod options;
pub mod server;
