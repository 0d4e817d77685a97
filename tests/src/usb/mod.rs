//! USB without a cable: a host that follows a script, and its device.
//!
//! Packets are transferred whole: no bits, no CRC, no frames, no time on the wire.

pub mod board;
mod driver;
pub mod host;

/// Answer of a device to a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Handshake {
    /// Accepted.
    Ack,
    /// Not now.
    Nak,
    /// Refused for good.
    Stall,
}

/// Answer of a device to an IN request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// A packet.
    Data(Vec<u8>),
    /// Not now.
    Nak,
    /// Refused for good.
    Stall,
}

/// A device at the end of the cable.
pub trait Port {
    /// Returns true if it is attached to the bus.
    fn is_attached(&self) -> bool;
    /// Resets the bus.
    fn bus_reset(&mut self);
    /// Begins a control transfer.
    fn setup(&mut self, request: [u8; 8]) -> Handshake;
    /// Sends a packet.
    fn out(&mut self, endpoint: usize, packet: &[u8]) -> Handshake;
    /// Requests a packet.
    fn take_in(&mut self, endpoint: usize) -> Answer;
    /// Lets a moment pass; [`MOMENTS_A_MS`] of them are a millisecond.
    ///
    /// # Errors
    /// The reason why the device stopped.
    fn wait(&mut self) -> Result<(), String>;
}

/// Moments in a millisecond.
pub const MOMENTS_A_MS: u64 = 20;
