//! A USB host by script, and the byte stream it gives to the host's program.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::time::Duration;

use hapterra::link::Transport;

use super::{Answer, Handshake};
use crate::machine::{Machine, Stop};

/// Milliseconds of the device's time after which an unanswered packet is an
/// error.
const PATIENCE_MS: u64 = 200;
/// Packets tried in a millisecond.
const TRIES_A_MS: u64 = 20;
/// The link's endpoints, as the configuration descriptor gives them.
const ENDPOINT: usize = 1;
/// Bytes in a full-speed bulk packet.
const PACKET: usize = 64;

/// Why a transfer failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failure {
    /// Not answered in [`PATIENCE_MS`].
    Silence,
    /// Refused.
    Stalled,
    /// The machine stopped.
    Stopped(Stop),
}

/// A chip with a host at its connector.
pub type Shared = Rc<RefCell<Machine>>;

/// Tries until it is neither answered with NAK nor too late.
fn try_on<T>(
    machine: &mut Machine,
    mut attempt: impl FnMut(&mut Machine) -> Option<Result<T, Failure>>,
) -> Result<T, Failure> {
    for _ in 0..PATIENCE_MS * TRIES_A_MS {
        if let Some(done) = attempt(machine) {
            return done;
        }
        let until_ns = machine.bus().now_ns + 1_000_000 / TRIES_A_MS;
        match machine.run_until(1, |m| m.bus().now_ns >= until_ns) {
            Stop::Asked | Stop::Time => {}
            stop => return Err(Failure::Stopped(stop)),
        }
    }
    Err(Failure::Silence)
}

fn shaken(hand: Handshake) -> Option<Result<(), Failure>> {
    match hand {
        Handshake::Ack => Some(Ok(())),
        Handshake::Nak => None,
        Handshake::Stall => Some(Err(Failure::Stalled)),
    }
}

/// Sends a packet, waiting for the device to take it.
///
/// # Errors
/// [`Failure`].
pub fn send_packet(machine: &mut Machine, endpoint: usize, packet: &[u8]) -> Result<(), Failure> {
    try_on(machine, |m| shaken(m.bus().usb.out(endpoint, packet)))
}

/// Asks for a packet until there is one.
///
/// # Errors
/// [`Failure`].
pub fn fetch_packet(machine: &mut Machine, endpoint: usize) -> Result<Vec<u8>, Failure> {
    try_on(machine, |m| match m.bus().usb.take_in(endpoint) {
        Answer::Data(packet) => Some(Ok(packet)),
        Answer::Nak => None,
        Answer::Stall => Some(Err(Failure::Stalled)),
    })
}

/// A control transfer that reads at most `length` bytes.
///
/// # Errors
/// [`Failure`].
pub fn control_in(
    machine: &mut Machine,
    [kind, request]: [u8; 2],
    value: u16,
    index: u16,
    length: u16,
) -> Result<Vec<u8>, Failure> {
    set_up(machine, [kind, request], value, index, length)?;
    let mut data = vec![];
    loop {
        let packet = fetch_packet(machine, 0)?;
        data.extend(&packet);
        if packet.len() < PACKET || data.len() >= length.into() {
            break;
        }
    }
    send_packet(machine, 0, &[])?;
    Ok(data)
}

/// A control transfer without data.
///
/// # Errors
/// [`Failure`].
pub fn control(
    machine: &mut Machine,
    request: [u8; 2],
    value: u16,
    index: u16,
) -> Result<(), Failure> {
    set_up(machine, request, value, index, 0)?;
    fetch_packet(machine, 0).map(|_| ())
}

fn set_up(
    machine: &mut Machine,
    [kind, request]: [u8; 2],
    value: u16,
    index: u16,
    length: u16,
) -> Result<(), Failure> {
    let mut bytes = [kind, request, 0, 0, 0, 0, 0, 0];
    for (i, half) in [value, index, length].into_iter().enumerate() {
        bytes[2 + 2 * i..][..2].copy_from_slice(&half.to_le_bytes());
    }
    try_on(machine, |m| shaken(m.bus().usb.setup(bytes)))
}

/// What enumeration read.
#[derive(Clone, Debug)]
pub struct Found {
    /// Device descriptor.
    pub device: Vec<u8>,
    /// Configuration with everything in it.
    pub configuration: Vec<u8>,
}

/// Resets the bus, reads the descriptors, gives an address and the first
/// configuration: what every host does with a device that was plugged in.
///
/// # Errors
/// [`Failure`].
pub fn enumerate(machine: &mut Machine) -> Result<Found, Failure> {
    try_on(machine, |m| m.bus().usb.is_attached().then_some(Ok(())))?;
    machine.bus().usb.bus_reset();
    // A host leaves a device 10 ms to recover.
    if let stop @ (Stop::Watchdog | Stop::Lockup(_)) = machine.run_ms(10) {
        return Err(Failure::Stopped(stop));
    }
    let device = control_in(machine, [0x80, 6], 0x0100, 0, 18)?;
    control(machine, [0x00, 5], 7, 0)?;
    let head = control_in(machine, [0x80, 6], 0x0200, 0, 9)?;
    let total = u16::from_le_bytes([head[2], head[3]]);
    let configuration = control_in(machine, [0x80, 6], 0x0200, 0, total)?;
    control(machine, [0x00, 9], 1, 0)?;
    Ok(Found {
        device,
        configuration,
    })
}

/// The link as a byte stream: what `nusb` is to the real program. Waiting on it
/// is what lets the machine's time pass.
pub struct UsbLink(pub Shared);

impl Transport for UsbLink {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut machine = self.0.borrow_mut();
        for packet in bytes.chunks(PACKET) {
            send_packet(&mut machine, ENDPOINT, packet).map_err(broken)?;
        }
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
        let mut machine = self.0.borrow_mut();
        let mut packet = None;
        let ask = |m: &mut Machine| {
            if let Answer::Data(bytes) = m.bus().usb.take_in(ENDPOINT) {
                packet = Some(bytes);
            }
            packet.is_some()
        };
        let ms = u64::try_from(wait.as_millis()).unwrap_or(u64::MAX).max(1);
        match machine.run_until(ms, ask) {
            Stop::Asked | Stop::Time => {}
            stop => return Err(broken(Failure::Stopped(stop))),
        }
        let packet = packet.unwrap_or_default();
        into[..packet.len()].copy_from_slice(&packet);
        Ok(packet.len())
    }
}

fn broken(failure: Failure) -> io::Error {
    io::Error::other(format!("{failure:?}"))
}
