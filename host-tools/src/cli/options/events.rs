//! Options of [events](crate::events), and the end of their server, shared by `run` and `demo`.

use std::num::NonZeroU32;

use crate::cli::failure::{Failure, OrHint};
use crate::cli::terminal::writer::notify;
use crate::events::{Server, Watcher};

/// Events to other programs.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
#[command(next_help_heading = "While it is touched")]
pub struct EventOptions {
    /// Send events as lines of JSON at this port of 127.0.0.1
    ///
    /// 0 takes a free one. With PORT,N every N-th of the 1,000 samples a second is also sent.
    #[arg(long, value_name = "PORT[,N]", value_parser = events)]
    pub events: Option<Events>,
}

/// Destination of events, and interval of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Events {
    /// The port of 127.0.0.1; 0 selects a free one.
    port: u16,
    /// N, if every N-th sample is sent too.
    samples: Option<NonZeroU32>,
}

fn events(text: &str) -> Result<Events, String> {
    let (port, samples) = match text.split_once(',') {
        None => (text, None),
        Some((port, every)) => (port, Some(every.trim().parse::<NonZeroU32>())),
    };
    match (port.trim().parse(), samples.transpose()) {
        (Ok(port), Ok(samples)) => Ok(Events { port, samples }),
        _ => Err("a port from 0 to 65535, and with samples PORT,N, as 4100,10".into()),
    }
}

impl EventOptions {
    /// Listens for readers, if events are requested.
    ///
    /// # Errors
    /// The port is in use.
    pub(in crate::cli) fn listen(&self) -> Result<Option<Server>, Failure> {
        let Some(Events { port, .. }) = self.events else {
            return Ok(None);
        };
        let server = Server::listen(port)
            .map_err(|why| format!("events cannot be sent on port {port} of 127.0.0.1: {why}"))
            .or_hint("name another port with --events, or 0 for any that is free")?;
        notify(format!("events         {}", server.address()));
        Ok(Some(server))
    }

    /// Creates the watcher of a device, counted from 1.
    pub(in crate::cli) fn watcher(&self, server: &Server, device: usize) -> Watcher {
        Watcher::new(server.sender(), device).with_samples(self.events.and_then(|it| it.samples))
    }
}

/// Ends the server and reports the number of dropped lines.
pub(in crate::cli) fn end(server: Server) {
    let dropped = server.end();
    if dropped > 0 {
        notify(format!(
            "events         {dropped} lines were dropped: a reader was too slow"
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn port_and_sample_interval_are_parsed() {
        let samples = None;
        assert_eq!(
            events("4100"),
            Ok(Events {
                port: 4100,
                samples
            })
        );
        let samples = NonZeroU32::new(10);
        assert_eq!(events("0,10"), Ok(Events { port: 0, samples }));
        for bad in ["", "70000", "-1", "1,0", "1,", "1,2,3", ",5"] {
            assert!(events(bad).is_err(), "{bad}");
        }
    }
}
