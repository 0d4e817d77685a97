//! Checks every tick of a run, and the messages to the host.

use hapterra::link::LinkStats;
use hapterra_core::wire::hello::DeviceHello;

use super::frame_record::{FrameRecord, asks_to_arm};

/// Ticks in which the force goes out after a request to disarm was answered.
pub(super) const FADE: u64 = 150;
/// For so long the device lets a silent host's arm be, seconds, and ticks with the force
/// going out.
pub(super) const SILENCE_S: u16 = 5;
const SILENCE: u64 = SILENCE_S as u64 * 1_000 + FADE;

/// Violation of the protocol.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wrong {
    /// Nothing came to an end in `LONGEST` ticks.
    Hangs,
    /// The amplifiers were on at this tick, and no host wished it.
    Driven(u64),
    /// The amplifiers were switched on at this tick in a session without a request of its host.
    Unasked(u64),
    /// The amplifiers were on at this tick, and nothing had come for longer than the host
    /// had sent.
    Forsaken(u64),
    /// The host took this for a message of the device, which had not sent it in its
    /// session.
    Misled(String),
    /// The host took this tick's status for the answer to a question that it asked at that
    /// tick of the device, which was later.
    Outdated(u32, u32),
    /// The host got a report that the device is disarmed, and it is not.
    NotDisarmed(u64),
    /// Samples were not counted once: what the host counted as here or lost, and as
    /// dropped; what the device had.
    Miscounted((u64, u64), (u64, u64)),
    /// An error that no harm to frames may lead to.
    Error(String),
}

/// State of a run, and its faults.
#[derive(Default)]
pub(super) struct RunOracle {
    account: FrameRecord,
    /// Since when no host wishes that anything is driven.
    unwished: Option<u64>,
    /// The present host has asked to arm.
    asked: bool,
    /// The session that the device is in, and whether the amplifiers were on when it began
    /// and ever since.
    inherited: (u32, bool),
    /// The tick of the last frame to the device.
    heard_at: u64,
}

impl RunOracle {
    pub(super) fn device_says(&mut self, bytes: &[u8]) {
        self.account.hear(bytes);
    }

    pub(super) fn host_says(&mut self, bytes: &[u8]) {
        self.asked |= asks_to_arm(bytes);
    }

    /// A frame has come to the device.
    pub(super) const fn frame_came(&mut self, now: u64) {
        self.heard_at = now;
    }

    /// A host was started in the place of one that was killed.
    pub(super) const fn another_host(&mut self) {
        self.asked = false;
    }

    /// A host is there that wishes that something is driven.
    pub(super) const fn wished(&mut self) {
        self.unwished = None;
    }

    /// From this tick on no host wishes it any more.
    pub(super) const fn unwished_from(&mut self, tick: u64) {
        self.unwished = Some(tick);
    }

    /// After a tick in which the amplifiers were on or off, while the host is in this
    /// session.
    pub(super) fn look(&mut self, now: u64, enabled: bool, session: u32) -> Result<(), Wrong> {
        let is_greeted = self.account.greetings(session).next().is_some();
        if self.inherited.0 != session && is_greeted {
            self.inherited = (session, enabled);
        }
        self.inherited.1 &= enabled;
        let unasked = is_greeted && !self.inherited.1 && !self.asked;
        if enabled && self.unwished.is_some_and(|since| now > since) {
            return Err(Wrong::Driven(now));
        }
        if enabled && unasked {
            return Err(Wrong::Unasked(now));
        }
        if enabled && now > self.heard_at + SILENCE {
            return Err(Wrong::Forsaken(now));
        }
        Ok(())
    }

    /// The host believes that its session is open with this device, and that these were
    /// samples of it, by their ticks.
    pub(super) fn told(
        &self,
        session: u32,
        opened: Option<&DeviceHello>,
        samples: &[u32],
    ) -> Result<(), Wrong> {
        let mut greetings = self.account.greetings(session);
        if let Some(device) = opened.filter(|device| !greetings.any(|said| said == *device)) {
            return Err(Wrong::Misled(format!("{device:?}")));
        }
        let has_told = |tick: &&u32| self.account.has_told(session, **tick);
        match samples.iter().find(|tick| !has_told(tick)) {
            Some(tick) => Err(Wrong::Misled(format!("the sample of tick {tick}"))),
            None => Ok(()),
        }
    }

    /// The host believes that the device is disarmed, and so it has to stay.
    pub(super) const fn agreed(&mut self, now: u64, enabled: bool) -> Result<(), Wrong> {
        self.unwished = Some(0);
        match enabled {
            true => Err(Wrong::NotDisarmed(now)),
            false => Ok(()),
        }
    }

    /// The host's account of its sessions against the device's.
    pub(super) fn count(&self, tally: &LinkStats, sessions: &[u32]) -> Result<(), Wrong> {
        let counted = (tally.samples + tally.lost, tally.dropped);
        let made = self.account.of(sessions);
        match counted == made || tally.uncertain > 0 {
            true => Ok(()),
            false => Err(Wrong::Miscounted(counted, made)),
        }
    }
}
