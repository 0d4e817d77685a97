//! Bulk endpoints as streams of bytes.

use embassy_usb::driver::{Endpoint, EndpointError, EndpointIn, EndpointOut};
use embedded_io_async::{ErrorKind, ErrorType, Read, Write};

use super::PACKET;

/// A bulk endpoint as a stream of bytes.
pub struct BulkStream<E> {
    endpoint: E,
    /// True if the host uses the interface, by the last event at this end.
    up: bool,
}

impl<E: Endpoint> BulkStream<E> {
    pub(super) const fn new(endpoint: E) -> Self {
        Self {
            endpoint,
            up: false,
        }
    }

    /// Waits until the host uses the interface.
    async fn until_up(&mut self) {
        if !self.up {
            self.endpoint.wait_enabled().await;
            self.up = true;
        }
    }
}

impl<E> ErrorType for BulkStream<E> {
    type Error = ErrorKind;
}

impl<E: EndpointOut> Read for BulkStream<E> {
    /// Reads one packet. Returns 0 when the host has disconnected; the next call waits until it is
    /// back. A packet longer than `bytes` is an error.
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        self.until_up().await;
        loop {
            match self.endpoint.read(bytes).await {
                // An empty packet only ends a transfer.
                Ok(0) => {}
                Ok(n) => return Ok(n),
                Err(EndpointError::Disabled) => {
                    self.up = false;
                    return Ok(0);
                }
                Err(EndpointError::BufferOverflow) => return Err(ErrorKind::OutOfMemory),
            }
        }
    }
}

impl<E: EndpointIn> Write for BulkStream<E> {
    /// Writes one packet, never a full one: a host's read ends with a short packet.
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        self.until_up().await;
        let packet = bytes.get(..PACKET - 1).unwrap_or(bytes);
        if self.endpoint.write(packet).await.is_err() {
            self.up = false;
            return Err(ErrorKind::NotConnected);
        }
        Ok(packet.len())
    }

    async fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}
