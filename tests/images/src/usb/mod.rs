//! The chips' two USB peripherals, for the scripted host of `hapterra-tests`.

mod cable;
mod full_speed;
mod otg;

pub use cable::Cable;
pub use full_speed::FullSpeed;
pub use otg::Otg;

use hapterra_tests::usb::{Answer, Handshake};

/// A peripheral with its interfaces to the core and to the bus.
pub trait Peripheral {
    /// Returns a word for the core.
    fn read(&mut self, offset: u32) -> u32;
    /// Writes a word from the core, in the bytes of `mask`.
    fn write(&mut self, offset: u32, value: u32, mask: u32);
    /// Returns true if the interrupt is asserted.
    fn is_asserting(&self) -> bool;
    /// Returns true if it is attached to the bus.
    fn is_attached(&self) -> bool;
    /// Resets the bus.
    fn bus_reset(&mut self);
    /// Signals that the bus has been idle for 3 ms, as after an unplugging.
    fn suspend(&mut self);
    /// Begins a control transfer.
    fn setup(&mut self, request: [u8; 8]) -> Handshake;
    /// Sends a packet; `toggle` is true for DATA1.
    fn out(&mut self, endpoint: usize, packet: &[u8], toggle: bool) -> Handshake;
    /// Requests a packet. Returns it with its toggle.
    fn take_in(&mut self, endpoint: usize) -> (Answer, bool);
}
