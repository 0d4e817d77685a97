//! A transport with its clock, and bytes in transit.

use std::io;
use std::time::Duration;

use super::error::LinkError;
use super::transport::{NoLine, Transport};

/// Time between two checks of the clock during a wait.
pub(super) const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Max time for a device to read the bytes of one message before it counts as disconnected.
const SEND_TIMEOUT: Duration = Duration::from_secs(5);

/// Line of a [`Session`](super::Session) or [`ControlSession`](super::ControlSession).
pub(super) struct Line<'t> {
    transport: Box<dyn Transport + 't>,
    is_open: bool,
    incoming: Box<[u8; 4096]>,
    /// Bytes for the next [`Line::flush`].
    pub(super) out: Vec<u8>,
}

impl<'t> Line<'t> {
    pub(super) fn new(transport: Box<dyn Transport + 't>) -> Self {
        Self {
            transport,
            is_open: true,
            incoming: Box::new([0; 4096]),
            out: vec![],
        }
    }

    /// Continues over another transport; unsent bytes are dropped.
    pub(super) fn replace(&mut self, transport: Box<dyn Transport + 't>) {
        self.transport = transport;
        self.is_open = true;
        self.out.clear();
    }

    /// Returns the time since a fixed moment ([`Transport::now`]).
    pub(super) fn now(&self) -> Duration {
        self.transport.now()
    }

    /// Closes the line. Some devices can be opened only once: another line to them can be opened
    /// after this call.
    pub(super) fn close(&mut self) {
        self.replace(Box::new(NoLine(self.now())));
        self.is_open = false;
    }

    /// Returns true if the line is open.
    pub(super) const fn is_open(&self) -> bool {
        self.is_open
    }

    /// Sends the pending bytes.
    pub(super) fn flush(&mut self) -> Result<(), LinkError> {
        self.flush_while(None, &|| true)
    }

    /// Sends the pending bytes. A device that reads none of them for a while, or has not read all
    /// by `until`, counts as gone; if `should_continue` returns false, the rest is not sent.
    pub(super) fn flush_while(
        &mut self,
        until: Option<Duration>,
        should_continue: &dyn Fn() -> bool,
    ) -> Result<(), LinkError> {
        let until = until.unwrap_or_else(|| self.now() + SEND_TIMEOUT);
        let mut sent = 0;
        while let Some(unsent) = self.out.get(sent..).filter(|unsent| !unsent.is_empty()) {
            let accepted = match self.now() < until {
                true => self.transport.send_some(unsent, POLL_INTERVAL),
                false => Err(io::ErrorKind::TimedOut.into()),
            };
            match accepted {
                Ok(accepted) => sent += accepted,
                Err(error) => {
                    self.out.clear();
                    return Err(LinkError::Disconnected(error));
                }
            }
            if !should_continue() {
                break;
            }
        }
        self.out.clear();
        Ok(())
    }

    /// Receives bytes within `wait`; returns the time, the bytes, and the buffer for answers.
    pub(super) fn receive(
        &mut self,
        wait: Duration,
    ) -> Result<(Duration, &[u8], &mut Vec<u8>), LinkError> {
        let received = self.transport.receive(self.incoming.as_mut_slice(), wait);
        let received = received.map_err(LinkError::Disconnected)?;
        let now = self.now();
        let bytes = self.incoming.get(..received).unwrap_or(&[]);
        Ok((now, bytes, &mut self.out))
    }
}
