//! Sessions: which conversation a frame belongs to, how a session ended, and how
//! many of its samples there were.

use serde::{Deserialize, Serialize};

/// A session's number. The host draws it at random for each session, so that what is
/// left on the line of one session is not taken for part of another.
///
/// No number is below 128: its first byte on the wire has its highest bit set, which
/// tells a frame of a session from a [`VersionCheck`](super::version::VersionCheck).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct SessionNumber(u32);

impl SessionNumber {
    /// A number from 32 random bits, of which 31 count.
    #[must_use]
    pub const fn new(random: u32) -> Self {
        Self(random | 0x80)
    }

    /// The number.
    #[must_use]
    pub const fn get(self) -> u32 {
        self.0
    }
}

/// Content of a frame of the link: a message and the session that it belongs to.
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
    /// Number of samples that were put into messages and given to the line.
    pub sent: u32,
    /// Samples that the device itself dropped because the line was slow.
    pub dropped: u32,
}

/// End of a session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SessionEnd {
    /// There was no session since the device started.
    #[default]
    None,
    /// The host closed the session: the arm was disarmed.
    Goodbye,
    /// Another session was opened. The device continued with what it held.
    Replaced,
    /// The host was silent for too long: the force was let out and the arm disarmed.
    HostSilent,
}

/// The session before the present one, not counting those that were detached
/// ([`ToDevice::Detach`](super::message::ToDevice::Detach)): a host that only looked does
/// not hide what became of the session before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LastSession {
    /// Its number; zero where there was none.
    pub session: u32,
    /// The number of the hello that opened it.
    pub opened_by: u8,
    /// Its end.
    pub end: SessionEnd,
    /// Its samples.
    pub count: SampleCount,
}

/// Bounds of the time for which a host may be silent while the arm is armed, seconds.
pub const SILENCE_S: (u16, u16) = (5, 3_600);
/// Session number of a host that only looks: it opens no session, and is no host
/// whose silence ends anything.
pub const ONLY_LOOKS: u16 = 0;
/// The time of a session whose host states none, seconds.
pub const DEFAULT_SILENCE_S: u16 = 180;
