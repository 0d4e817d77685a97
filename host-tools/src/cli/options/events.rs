//! Options of [events](crate::events), and the end of their server; shared by `run` and `demo`.

use std::num::NonZeroU32;

use crate::cli::failure::{Failure, OrHint};
use crate::cli::terminal::voice::tell;
use crate::events::{Server, Watcher};

/// Whether other programs are told what happens.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct EventOptions {
    /// Tell what happens in lines of JSON on this port of 127.0.0.1, to any program of this
    /// machine that connects; 0 takes a free one
    #[arg(long, value_name = "PORT")]
    pub events: Option<u16>,

    /// Tell every N-th sample, too, of the thousand that a device reports a second
    #[arg(long, value_name = "N", requires = "events")]
    pub event_samples: Option<NonZeroU32>,
}

impl EventOptions {
    /// Listens for readers, if events are asked for.
    ///
    /// # Errors
    /// A port that is taken.
    pub(in crate::cli) fn listen(&self) -> Result<Option<Server>, Failure> {
        let Some(port) = self.events else {
            return Ok(None);
        };
        let server = Server::listen(port)
            .map_err(|why| format!("events cannot be told on port {port} of 127.0.0.1: {why}"))
            .or_hint("name another port with --events, or 0 for any that is free")?;
        tell(format!("events         {}", server.address()));
        Ok(Some(server))
    }

    /// Watches a device, counted from 1.
    pub(in crate::cli) fn watcher(&self, server: &Server, device: usize) -> Watcher {
        Watcher::new(server.sender(), device).with_samples(self.event_samples)
    }
}

/// Ends the server, and tells how many lines were dropped.
pub(in crate::cli) fn end(server: Server) {
    let dropped = server.end();
    if dropped > 0 {
        tell(format!(
            "events         {dropped} lines were dropped: a reader was too slow"
        ));
    }
}
