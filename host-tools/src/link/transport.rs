//! The byte stream to a device, over any carrier.

use std::io;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

/// A byte stream to a device.
pub trait Transport {
    /// Sends all of `bytes`.
    ///
    /// # Errors
    /// When the device is disconnected.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Receives the available bytes; waits at most `wait` for the first. Returns zero if none
    /// arrived in that time.
    ///
    /// # Errors
    /// When the device is disconnected.
    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize>;

    /// Sends as much of `bytes` as the device reads within about `wait`; returns the number of sent
    /// bytes. A transport that never waits for its device sends all of them.
    ///
    /// # Errors
    /// When the device is disconnected.
    fn send_some(&mut self, bytes: &[u8], wait: Duration) -> io::Result<usize> {
        let _ = wait;
        self.send(bytes).map(|()| bytes.len())
    }

    /// Returns the time since a fixed moment, for the time-outs of a conversation: this machine's
    /// time, unless the device has its own.
    fn now(&self) -> Duration {
        static BEGAN: LazyLock<Instant> = LazyLock::new(Instant::now);
        BEGAN.elapsed()
    }
}

impl<T: Transport + ?Sized> Transport for &mut T {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        (**self).send(bytes)
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
        (**self).receive(into, wait)
    }

    fn send_some(&mut self, bytes: &[u8], wait: Duration) -> io::Result<usize> {
        (**self).send_some(bytes, wait)
    }

    fn now(&self) -> Duration {
        (**self).now()
    }
}

/// A closed line, with the time of its closing.
pub(super) struct NoLine(pub(super) Duration);

impl Transport for NoLine {
    fn send(&mut self, _: &[u8]) -> io::Result<()> {
        Err(io::ErrorKind::NotConnected.into())
    }

    fn receive(&mut self, _: &mut [u8], _: Duration) -> io::Result<usize> {
        Err(io::ErrorKind::NotConnected.into())
    }

    fn now(&self) -> Duration {
        self.0
    }
}

/// Returns true if a read ended because no byte arrived in time.
pub(super) fn is_time_out(error: &io::Error) -> bool {
    use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), TimedOut | WouldBlock | Interrupted)
}
