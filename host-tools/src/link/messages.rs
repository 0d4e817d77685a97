//! Whole messages over a byte stream.

use std::io;
use std::time::Duration;

use hapterra_core::wire::frame::{FrameError, FrameReader, MAX_FRAME, decode, encode};
use hapterra_core::wire::message::ToHost;
use hapterra_core::wire::session::InSession;
use hapterra_core::wire::version::VersionCheck;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::transport::Transport;

/// Appends a frame to `out`. All messages fit in [`MAX_FRAME`] bytes.
pub(super) fn append(content: &impl Serialize, out: &mut Vec<u8>) {
    let mut frame = [0; MAX_FRAME];
    out.extend_from_slice(encode(content, &mut frame).unwrap_or(&[]));
}

/// Sends a message. All messages fit in [`MAX_FRAME`] bytes.
pub(super) fn send(transport: &mut dyn Transport, message: &impl Serialize) -> io::Result<()> {
    let mut frame = [0; MAX_FRAME];
    transport.send(encode(message, &mut frame).unwrap_or(&[]))
}

/// Removes the next frame from `bytes`, which keep the rest, and reads its content with `read`;
/// returns `None` if no frame ends in them.
pub(super) fn next_frame<T>(
    reader: &mut FrameReader<MAX_FRAME>,
    bytes: &mut &[u8],
    read: impl Fn(&[u8]) -> Result<T, FrameError>,
) -> Option<Result<T, FrameError>> {
    while !bytes.is_empty() {
        let (consumed, frame) = reader.push(bytes);
        *bytes = bytes.get(consumed..).unwrap_or(&[]);
        if let Some(frame) = frame {
            return Some(frame.and_then(&read));
        }
    }
    None
}

/// Content of a device's frame.
#[derive(Debug)]
// Short-lived, so its size does not matter.
#[allow(clippy::large_enum_variant)]
pub(super) enum FromDevice {
    /// A message of a session.
    Message(InSession<ToHost>),
    /// The device's protocol, if it is another one.
    Version(VersionCheck),
}

/// Reads a frame of the link.
pub(super) fn from_device(content: &[u8]) -> Result<FromDevice, FrameError> {
    match VersionCheck::is_in(content) {
        true => decode(content).map(FromDevice::Version),
        false => decode(content).map(FromDevice::Message),
    }
}

/// Messages received from a transport, one at a time.
#[derive(Default)]
pub(super) struct Inbox {
    reader: Box<FrameReader<MAX_FRAME>>,
    /// Received bytes that are not read yet.
    unread: Vec<u8>,
}

impl Inbox {
    /// Returns the next message, or `None` if none arrives within `wait`. Invalid frames are
    /// skipped: they are the rest of earlier messages.
    ///
    /// # Errors
    /// When the device is disconnected.
    pub(super) fn next<T: DeserializeOwned>(
        &mut self,
        transport: &mut dyn Transport,
        wait: Duration,
    ) -> io::Result<Option<T>> {
        if self.unread.is_empty() {
            let mut incoming = [0; 1024];
            let received = transport.receive(&mut incoming, wait)?;
            self.unread.extend(incoming.iter().take(received));
        }
        let mut bytes = self.unread.as_slice();
        let found = std::iter::from_fn(|| {
            next_frame(&mut self.reader, &mut bytes, |content| decode(content))
        })
        .find_map(Result::ok);
        let read = self.unread.len() - bytes.len();
        self.unread.drain(..read);
        Ok(found)
    }
}
