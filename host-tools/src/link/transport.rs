//! What a byte stream to a device is, whatever it runs over.

use std::io;
use std::time::Duration;

/// A byte stream to a device.
pub trait Transport {
    /// Sends all of `bytes`.
    ///
    /// # Errors
    /// When the device is gone.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Receives what has come, after waiting for at most `wait` for the first
    /// byte; zero when none came in that time.
    ///
    /// # Errors
    /// When the device is gone.
    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize>;
}

impl<T: Transport + ?Sized> Transport for &mut T {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        (**self).send(bytes)
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
        (**self).receive(into, wait)
    }
}

/// Whether a read ended because nothing came in time.
pub(super) fn is_time_out(error: &io::Error) -> bool {
    use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), TimedOut | WouldBlock | Interrupted)
}
