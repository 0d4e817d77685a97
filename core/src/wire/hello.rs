//! The messages with which host and device open a session.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::session::LastSession;

/// Version of the table of messages.
pub const PROTOCOL: u16 = 16;
/// Maximum length of names in a hello, bytes.
pub const NAME: usize = 32;

/// The host's hello.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HostHello {
    /// The host's [`PROTOCOL`].
    pub protocol: u16,
    /// Number of the hello within a session; the answer repeats it.
    pub number: u8,
    /// Time, in seconds, for which the host may be silent before the device fades the force out and
    /// disarms. Clamped to [`SILENCE_S`](super::session::SILENCE_S);
    /// [`READ_ONLY_SILENCE_S`](super::session::READ_ONLY_SILENCE_S) opens no session.
    pub silence_s: u16,
}

/// Unique identifier of a board: the 96 bits from the chip's maker, shown in upper-case hexadecimal
/// digits, as in the board's USB descriptor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SerialNumber([u8; 12]);

impl SerialNumber {
    /// The serial number of a device without a chip: an emulated board, or one in memory.
    pub const NONE: Self = Self([0; 12]);

    /// Creates a serial number from a chip's identifier, in the order of its addresses.
    #[must_use]
    pub const fn new(identifier: [u8; 12]) -> Self {
        Self(identifier)
    }

    /// Returns true if there is no serial number.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }
}

impl fmt::Display for SerialNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02X}"))
    }
}

/// The device's hello.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DeviceHello {
    /// The device's [`PROTOCOL`].
    pub protocol: u16,
    /// The number of the answered hello.
    pub number: u8,
    /// The number of the hello that opened the session: if it changes, the device was restarted.
    pub opened_by: u8,
    /// Board name.
    pub board: heapless::String<NAME>,
    /// The board's serial number; [`SerialNumber::NONE`] without a chip.
    pub serial: SerialNumber,
    /// Firmware version.
    pub version: heapless::String<NAME>,
    /// Tiles along the side of the device's window.
    pub window: u8,
    /// Tick rate, Hz.
    pub tick_hz: u32,
    /// Maximum time from the start of a tick until the motors have its current, µs.
    pub latency_us: u16,
    /// Frequency of the clock that measures tick costs, Hz.
    pub clock_hz: u32,
    /// Epoch of the scene that the device stores, if any.
    pub epoch: Option<u32>,
    /// The previous session.
    pub last: LastSession,
}
