//! The page that shows what the hand feels.
//!
//! ```text
//! hapterra ══ pipe ══▶ feed ─▶ drawing ─▶ history ─▶ server ══ loopback ══▶ page (rerun in a browser)
//! ```
//!
//! - [`feed`]: messages of `hapterra` from the pipe;
//! - [`drawing`]: each message as rerun's entities, in ground metres, and the layout;
//! - [`history`]: the entries for a new page, bounded; and the pages' queues;
//! - [`server`]: the page and its stream, for this machine alone;
//! - [`options`]: what the command line says.
//!
//! Data flows one way. A page only asks for files and for the stream: nothing that it
//! sends is read beyond the request's head, and nothing goes back to `hapterra`.
#![forbid(unsafe_code)]
#![warn(missing_docs, unreachable_pub)]

pub mod drawing;
pub mod feed;
pub mod history;
pub mod options;
pub mod server;
