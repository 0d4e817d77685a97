//! The chips' two USB peripherals, for the scripted host of `hapterra-tests`.

mod cable;
mod full_speed;
mod otg;

pub use cable::Cable;
pub use full_speed::FullSpeed;
pub use otg::Otg;

use hapterra_tests::usb::{Answer, Handshake};

/// A peripheral, seen from the core and from the wire.
pub trait Peripheral {
    /// A word that the core reads.
    fn read(&mut self, offset: u32) -> u32;
    /// A word that the core writes, in the bytes of `mask`.
    fn write(&mut self, offset: u32, value: u32, mask: u32);
    /// Returns true if the interrupt is asserted.
    fn is_asserting(&self) -> bool;
    /// Returns true if it shows itself to a host.
    fn is_attached(&self) -> bool;
    /// The host resets the bus.
    fn bus_reset(&mut self);
    /// The bus has been idle for 3 ms, as after an unplugging.
    fn suspend(&mut self);
    /// The host begins a control transfer.
    fn setup(&mut self, request: [u8; 8]) -> Handshake;
    /// The host sends a packet with this toggle: whether it is DATA1.
    fn out(&mut self, endpoint: usize, packet: &[u8], toggle: bool) -> Handshake;
    /// The host asks for a packet, and gets its toggle with it.
    fn take_in(&mut self, endpoint: usize) -> (Answer, bool);
}
