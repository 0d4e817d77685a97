//! USB without a cable: a host that follows a script, and what it plugs into.
//!
//! Packets are moved whole: no bits, no CRC, no frames, no time on the wire.

pub mod board;
mod driver;
pub mod host;

/// Answer of a device to a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Handshake {
    /// Taken.
    Ack,
    /// Not now.
    Nak,
    /// Never like this.
    Stall,
}

/// Answer of a device to a request for a packet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// A packet.
    Data(Vec<u8>),
    /// Not now.
    Nak,
    /// Never like this.
    Stall,
}

/// A device at the end of the cable.
pub trait Port {
    /// Returns true if it shows itself.
    fn is_attached(&self) -> bool;
    /// The host resets the bus.
    fn bus_reset(&mut self);
    /// The host begins a control transfer.
    fn setup(&mut self, request: [u8; 8]) -> Handshake;
    /// The host sends a packet.
    fn out(&mut self, endpoint: usize, packet: &[u8]) -> Handshake;
    /// The host asks for a packet.
    fn take_in(&mut self, endpoint: usize) -> Answer;
    /// Lets a moment pass, [`MOMENTS_A_MS`] of which are a millisecond.
    ///
    /// # Errors
    /// The end of the device.
    fn wait(&mut self) -> Result<(), String>;
}

/// Moments in a millisecond.
pub const MOMENTS_A_MS: u64 = 20;
