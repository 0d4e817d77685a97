//! A pipe for tests.

use std::io::{self, Write};
use std::sync::mpsc::SyncSender;

/// A pipe that blocks when its channel is full, as an unread pipe does.
pub(super) struct Pipe(pub(super) SyncSender<Vec<u8>>);

impl Write for Pipe {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let sent = self.0.send(bytes.to_vec());
        sent.map(|()| bytes.len()).map_err(io::Error::other)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
