//! Sessions: the session of a frame, its end, and the number of its samples.

use serde::{Deserialize, Serialize};

/// A session's number. The host draws it at random for each session, so that late frames of one
/// session are not mistaken for frames of another.
///
/// No number is below 128: its first byte on the wire has its highest bit set, which distinguishes
/// a frame of a session from a [`VersionCheck`](super::version::VersionCheck).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct SessionNumber(u32);

impl SessionNumber {
    /// Creates a number from 32 random bits, of which 31 count.
    #[must_use]
    pub const fn new(random: u32) -> Self {
        Self(random | 0x80)
    }

    /// Returns the number.
    #[must_use]
    pub const fn get(self) -> u32 {
        self.0
    }
}

/// Content of a frame of the link: a message and its session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InSession<M> {
    /// The session.
    pub session: SessionNumber,
    /// The message.
    pub message: M,
}

/// Number of samples in a session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SampleCount {
    /// Number of samples that were put into messages and sent.
    pub sent: u32,
    /// Number of samples that the device dropped because the line was slow.
    pub dropped: u32,
}

/// End of a session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SessionEnd {
    /// There has been no session since the start of the device.
    #[default]
    None,
    /// The host closed the session: the arm was disarmed.
    Goodbye,
    /// Another session was opened. The device kept its state.
    Replaced,
    /// The host was silent for too long: the force was faded out and the arm disarmed.
    HostSilent,
}

/// The previous session, without those that were detached
/// ([`ToDevice::Detach`](super::message::ToDevice::Detach)): a host that only read does not hide
/// the end of the session before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LastSession {
    /// The session's number; zero if there was none.
    pub session: u32,
    /// The number of the hello that opened it.
    pub opened_by: u8,
    /// The session's end.
    pub end: SessionEnd,
    /// The number of the session's samples.
    pub count: SampleCount,
}

/// Minimum and maximum time for which a host may be silent while the arm is armed, seconds.
pub const SILENCE_S: (u16, u16) = (5, 3_600);
/// Silence time of a host that only reads: it opens no session, and its silence ends nothing.
pub const READ_ONLY_SILENCE_S: u16 = 0;
/// The silence time of a session whose host states none, seconds.
pub const DEFAULT_SILENCE_S: u16 = 180;
