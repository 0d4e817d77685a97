//! A transport, the clock that a conversation over it is told, and bytes on their way.

use std::time::{Duration, Instant};

use super::error::LinkError;
use super::transport::Transport;

/// Between two looks at the clock while something is waited for.
pub(super) const LOOK: Duration = Duration::from_millis(50);

/// What [`Session`](super::Session) and [`Dialogue`](super::Dialogue) hold their
/// conversation over.
pub(super) struct Line<'t> {
    transport: Box<dyn Transport + 't>,
    began: Instant,
    incoming: Box<[u8; 4096]>,
    /// What is to be said with the next [`Line::flush`].
    pub(super) out: Vec<u8>,
}

impl<'t> Line<'t> {
    pub(super) fn new(transport: Box<dyn Transport + 't>) -> Self {
        Self {
            transport,
            began: Instant::now(),
            incoming: Box::new([0; 4096]),
            out: vec![],
        }
    }

    /// Goes on over another transport; what was not said yet is forgotten.
    pub(super) fn replace(&mut self, transport: Box<dyn Transport + 't>) {
        self.transport = transport;
        self.out.clear();
    }

    /// The time since the line was made.
    pub(super) fn now(&self) -> Duration {
        self.began.elapsed()
    }

    /// Says what is to be said.
    pub(super) fn flush(&mut self) -> Result<(), LinkError> {
        if self.out.is_empty() {
            return Ok(());
        }
        let sent = self.transport.send(&self.out);
        self.out.clear();
        sent.map_err(LinkError::Gone)
    }

    /// What comes within `wait`: when, the bytes, and where the answers go.
    pub(super) fn receive(
        &mut self,
        wait: Duration,
    ) -> Result<(Duration, &[u8], &mut Vec<u8>), LinkError> {
        let received = self.transport.receive(self.incoming.as_mut_slice(), wait);
        let received = received.map_err(LinkError::Gone)?;
        let bytes = self.incoming.get(..received).unwrap_or(&[]);
        Ok((self.began.elapsed(), bytes, &mut self.out))
    }
}
