//! Introduction of host and device to each other.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::session::LastSession;

/// Version of the table of messages.
pub const PROTOCOL: u16 = 14;
/// Length limit of names in a hello, bytes.
pub const NAME: usize = 32;

/// The host introduces itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HostHello {
    /// The host's [`PROTOCOL`].
    pub protocol: u16,
    /// Tells hellos of a session apart; the answer repeats it.
    pub number: u8,
    /// For how long, in seconds, the host may be silent before the device lets the
    /// force out and disarms. Brought within [`SILENCE_S`](super::session::SILENCE_S);
    /// [`ONLY_LOOKS`](super::session::ONLY_LOOKS) opens no session.
    pub silence_s: u16,
}

/// Identifier of a board among others of its kind: the one that the chip's maker gave it,
/// 96 bits. Shown in upper-case hexadecimal digits, as the board's USB descriptor has it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SerialNumber([u8; 12]);

impl SerialNumber {
    /// The number of a device that has no chip: an emulated board, or one in memory.
    pub const NONE: Self = Self([0; 12]);

    /// From a chip's identifier, in the order of its addresses.
    #[must_use]
    pub const fn new(identifier: [u8; 12]) -> Self {
        Self(identifier)
    }

    /// Returns true if there is none.
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

/// The device introduces itself.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DeviceHello {
    /// The device's [`PROTOCOL`].
    pub protocol: u16,
    /// The number of the hello that this answers.
    pub number: u8,
    /// The number of the hello that opened the session: another than before tells that
    /// the device was restarted meanwhile.
    pub opened_by: u8,
    /// Board name.
    pub board: heapless::String<NAME>,
    /// The board's serial number; [`SerialNumber::NONE`] where it has none.
    pub serial: SerialNumber,
    /// Firmware version.
    pub version: heapless::String<NAME>,
    /// Tiles along the side of the device's window.
    pub window: u8,
    /// Ticks a second.
    pub tick_hz: u32,
    /// From the beginning of a tick until the motors have its current, at most, µs.
    pub latency_us: u16,
    /// Ticks of the clock in which tick costs are given, a second.
    pub clock_hz: u32,
    /// Epoch of the scene that the device still holds, if any.
    pub epoch: Option<u32>,
    /// The session before this one.
    pub last: LastSession,
}
