//! A byte stream over TCP: an emulated board, or a board behind a network.

use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

use super::error::LinkError;
use super::transport::{Transport, is_time_out};

/// The link of an emulated board, or of a board behind a network.
#[derive(Debug)]
pub struct Tcp {
    stream: TcpStream,
    /// The present time-outs of reads and writes.
    wait: Duration,
    write_wait: Duration,
}

/// Max time for a connection, and for the device to read the bytes of one send before it counts as
/// gone.
const TIMEOUT: Duration = Duration::from_secs(5);
/// The shortest time-out: a socket rejects zero.
const MIN_WAIT: Duration = Duration::from_micros(1);

impl Tcp {
    /// Connects to `HOST:PORT`.
    ///
    /// # Errors
    /// [`LinkError::Absent`] names the searched address.
    pub fn connect(address: &str) -> Result<Self, LinkError> {
        let absent = |why: io::Error| LinkError::Absent {
            searched_for: format!("a device at {address} (TCP)"),
            why: why.to_string(),
        };
        let mut failure = io::Error::other("the name has no address");
        for socket in address.to_socket_addrs().map_err(absent)? {
            match TcpStream::connect_timeout(&socket, TIMEOUT) {
                Ok(stream) => return Self::over(stream).map_err(absent),
                Err(error) => failure = error,
            }
        }
        Err(absent(failure))
    }

    /// Wraps an open connection.
    ///
    /// # Errors
    /// When the connection cannot be configured.
    pub fn over(stream: TcpStream) -> io::Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_nonblocking(false)?;
        stream.set_write_timeout(Some(TIMEOUT))?;
        let wait = TIMEOUT;
        stream.set_read_timeout(Some(wait))?;
        Ok(Self {
            stream,
            wait,
            write_wait: wait,
        })
    }
}

impl Transport for Tcp {
    fn send(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        let start = Instant::now();
        // The time-out applies to all bytes, so a device that reads a byte now and then also counts
        // as gone.
        while !bytes.is_empty() {
            let remaining = TIMEOUT.saturating_sub(start.elapsed());
            if remaining.is_zero() {
                return Err(io::ErrorKind::TimedOut.into());
            }
            let sent = self.send_some(bytes, remaining)?;
            bytes = bytes.get(sent..).unwrap_or(&[]);
        }
        Ok(())
    }

    fn send_some(&mut self, bytes: &[u8], wait: Duration) -> io::Result<usize> {
        let wait = wait.max(MIN_WAIT);
        if wait != self.write_wait {
            self.stream.set_write_timeout(Some(wait))?;
            self.write_wait = wait;
        }
        match self.stream.write(bytes) {
            Err(error) if is_time_out(&error) => Ok(0),
            other => other,
        }
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
        let wait = wait.max(MIN_WAIT);
        if wait != self.wait {
            self.stream.set_read_timeout(Some(wait))?;
            self.wait = wait;
        }
        match self.stream.read(into) {
            Ok(0) => Err(io::ErrorKind::ConnectionReset.into()),
            Err(error) if is_time_out(&error) => Ok(0),
            other => other,
        }
    }
}
