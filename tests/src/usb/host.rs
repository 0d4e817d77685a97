//! The host: control transfers, enumeration, and the two pipes under the product's own client.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::time::Duration;

use hapterra::link::{BulkEndpoints, Pipes};

use super::{Answer, Handshake, MOMENTS_A_MS, Port};

/// Milliseconds of the device's time after which an unanswered packet is an error.
const TIMEOUT_MS: u64 = 200;
/// Milliseconds of recovery for a device after a reset of the bus.
const RECOVERY_MS: u64 = 10;
/// Bytes in a full-speed packet, bulk or control.
pub const PACKET: usize = 64;

/// Cause of a failed transfer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failure {
    /// Not answered in `TIMEOUT_MS`.
    Silence,
    /// Refused.
    Stalled,
    /// The device itself stopped, with a message.
    Stopped(String),
}

/// Repeats an action until the answer is not NAK, or the time is over.
fn try_on<P: Port, T>(
    port: &mut P,
    mut attempt: impl FnMut(&mut P) -> Option<Result<T, Failure>>,
) -> Result<T, Failure> {
    for _ in 0..TIMEOUT_MS * MOMENTS_A_MS {
        if let Some(done) = attempt(port) {
            return done;
        }
        port.wait().map_err(Failure::Stopped)?;
    }
    Err(Failure::Silence)
}

fn handshake(hand: Handshake) -> Option<Result<(), Failure>> {
    match hand {
        Handshake::Ack => Some(Ok(())),
        Handshake::Nak => None,
        Handshake::Stall => Some(Err(Failure::Stalled)),
    }
}

/// Sends a packet, and waits until the device accepts it.
///
/// # Errors
/// [`Failure`].
pub fn send_packet(port: &mut impl Port, endpoint: usize, packet: &[u8]) -> Result<(), Failure> {
    try_on(port, |port| handshake(port.out(endpoint, packet)))
}

/// Requests a packet until there is one.
///
/// # Errors
/// [`Failure`].
pub fn fetch_packet(port: &mut impl Port, endpoint: usize) -> Result<Vec<u8>, Failure> {
    try_on(port, |port| match port.take_in(endpoint) {
        Answer::Data(packet) => Some(Ok(packet)),
        Answer::Nak => None,
        Answer::Stall => Some(Err(Failure::Stalled)),
    })
}

/// A control transfer's request: type, number, value, index.
pub type Request = (u8, u8, u16, u16);

/// Performs a control transfer that reads at most `length` bytes.
///
/// # Errors
/// [`Failure`].
pub fn control_in(port: &mut impl Port, request: Request, length: u16) -> Result<Vec<u8>, Failure> {
    set_up(port, request, length)?;
    let mut data = vec![];
    while data.len() < length.into() {
        let packet = fetch_packet(port, 0)?;
        data.extend(&packet);
        if packet.len() < PACKET {
            break;
        }
    }
    send_packet(port, 0, &[])?;
    Ok(data)
}

/// Performs a control transfer without data.
///
/// # Errors
/// [`Failure`].
pub fn control(port: &mut impl Port, request: Request) -> Result<(), Failure> {
    set_up(port, request, 0)?;
    fetch_packet(port, 0).map(|_| ())
}

fn set_up(
    port: &mut impl Port,
    (kind, request, value, index): Request,
    length: u16,
) -> Result<(), Failure> {
    let mut bytes = [kind, request, 0, 0, 0, 0, 0, 0];
    for (i, half) in [value, index, length].into_iter().enumerate() {
        bytes[2 + 2 * i..][..2].copy_from_slice(&half.to_le_bytes());
    }
    try_on(port, |port| handshake(port.setup(bytes)))
}

/// Reads a descriptor by its type and index.
///
/// # Errors
/// [`Failure`].
pub fn descriptor(
    port: &mut impl Port,
    kind: u8,
    index: u8,
    length: u16,
) -> Result<Vec<u8>, Failure> {
    let language = if kind == 3 && index != 0 { 0x0409 } else { 0 };
    let value = u16::from_be_bytes([kind, index]);
    control_in(port, (0x80, 6, value, language), length)
}

/// Reads a string descriptor's text.
///
/// # Errors
/// [`Failure`].
pub fn string(port: &mut impl Port, index: u8) -> Result<String, Failure> {
    let bytes = descriptor(port, 3, index, 255)?;
    let units: Vec<_> = bytes[2..]
        .as_chunks::<2>()
        .0
        .iter()
        .map(|c| u16::from_le_bytes(*c))
        .collect();
    Ok(String::from_utf16_lossy(&units))
}

/// Results of the enumeration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// Device descriptor.
    pub device: Vec<u8>,
    /// Configuration with all its descriptors.
    pub configuration: Vec<u8>,
}

/// Resets the bus, reads the descriptors, assigns an address and selects the first configuration,
/// as every host does with a new device.
///
/// # Errors
/// [`Failure`].
pub fn enumerate(port: &mut impl Port) -> Result<Found, Failure> {
    try_on(port, |port| port.is_attached().then_some(Ok(())))?;
    port.bus_reset();
    for _ in 0..RECOVERY_MS * MOMENTS_A_MS {
        port.wait().map_err(Failure::Stopped)?;
    }
    let device = descriptor(port, 1, 0, 18)?;
    control(port, (0x00, 5, 7, 0))?;
    let head = descriptor(port, 2, 0, 9)?;
    let total = u16::from_le_bytes([head[2], head[3]]);
    let configuration = descriptor(port, 2, 0, total)?;
    control(port, (0x00, 9, 1, 0))?;
    Ok(Found {
        device,
        configuration,
    })
}

/// The pipes of an enumerated device, in place of the system's USB for the real program. The
/// device's time passes while the program waits on them.
pub struct ScriptedPipes<P> {
    port: Rc<RefCell<P>>,
    endpoints: BulkEndpoints,
    /// Rest of a transfer in the host's controller.
    left: Vec<u8>,
}

impl<P: Port> ScriptedPipes<P> {
    /// Creates the pipes at these endpoints.
    #[must_use]
    pub const fn new(port: Rc<RefCell<P>>, endpoints: BulkEndpoints) -> Self {
        Self {
            port,
            endpoints,
            left: vec![],
        }
    }
}

impl<P: Port> Pipes for ScriptedPipes<P> {
    fn send(&mut self, transfer: &[u8]) -> io::Result<()> {
        let mut port = self.port.borrow_mut();
        let endpoint = usize::from(self.endpoints.output & 0xF);
        let mut packets = transfer.chunks(PACKET);
        packets.try_for_each(|packet| send_packet(&mut *port, endpoint, packet).map_err(broken))
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
        let mut port = self.port.borrow_mut();
        let endpoint = usize::from(self.endpoints.input & 0xF);
        let ms = u64::try_from(wait.as_millis()).unwrap_or(u64::MAX).max(1);
        let mut moments = ms.saturating_mul(MOMENTS_A_MS);
        while self.left.is_empty() {
            match port.take_in(endpoint) {
                Answer::Data(packet) => self.left = packet,
                Answer::Stall => return Err(broken(Failure::Stalled)),
                Answer::Nak if moments == 0 => return Err(io::ErrorKind::TimedOut.into()),
                Answer::Nak => port.wait().map_err(Failure::Stopped).map_err(broken)?,
            }
            moments = moments.saturating_sub(1);
        }
        let n = into.len().min(self.left.len());
        into[..n].copy_from_slice(&self.left[..n]);
        self.left.drain(..n);
        Ok(n)
    }
}

fn broken(failure: Failure) -> io::Error {
    io::Error::other(format!("{failure:?}"))
}
