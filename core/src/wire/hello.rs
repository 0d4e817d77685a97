//! How host and device introduce themselves to each other.

use serde::{Deserialize, Serialize};

/// Version of the table of messages.
pub const PROTOCOL: u16 = 3;
/// Length limit of names in a hello, bytes.
pub const NAME: usize = 32;

/// The host introduces itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HostHello {
    /// The host's [`PROTOCOL`].
    pub protocol: u16,
}

/// The device introduces itself.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DeviceHello {
    /// The device's [`PROTOCOL`].
    pub protocol: u16,
    /// Board name.
    pub board: heapless::String<NAME>,
    /// Firmware version.
    pub version: heapless::String<NAME>,
    /// Tiles along the side of the device's window.
    pub window: u8,
    /// Ticks a second.
    pub tick_hz: u32,
    /// Ticks of the clock in which tick costs are given, a second.
    pub clock_hz: u32,
    /// Epoch of the scene that the device still holds, if any.
    pub epoch: Option<u32>,
}
