//! How host and device introduce themselves to each other.

use serde::{Deserialize, Serialize};

use super::session::LastSession;

/// Version of the table of messages.
pub const PROTOCOL: u16 = 5;
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
    /// force out and disarms. Brought within [`SILENCE_S`](super::session::SILENCE_S).
    pub silence_s: u16,
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
    /// The session before this one.
    pub last: LastSession,
}
