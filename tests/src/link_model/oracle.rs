//! Checks every tick of a run, and the messages to the host.

use hapterra::link::LinkStats;
use hapterra_core::wire::hello::DeviceHello;

use super::frame_record::{FrameRecord, asks_to_arm};

/// Ticks in which the force fades after the answer to a request to disarm.
pub(super) const FADE: u64 = 150;
/// Silence of a host after which the device disarms: in seconds, and in ticks with the fade.
pub(super) const SILENCE_S: u16 = 5;
const SILENCE: u64 = SILENCE_S as u64 * 1_000 + FADE;

/// Violation of the protocol.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wrong {
    /// The run did not end within `MAX` ticks.
    Hangs,
    /// The amplifiers were on at this tick without a host that requested force.
    Driven(u64),
    /// The amplifiers were switched on at this tick in a session whose host had not requested it.
    Unasked(u64),
    /// The amplifiers were on at this tick, longer than allowed after the host's last frame.
    Forsaken(u64),
    /// The host accepted this as the device's message, which the device had not sent in its
    /// session.
    Misled(String),
    /// The host accepted the status of the first tick as the answer to a query made at the second,
    /// later tick.
    Outdated(u32, u32),
    /// The host received a report that the device is disarmed while it was not.
    NotDisarmed(u64),
    /// Samples were not counted exactly once: the host's counts (received or lost, and dropped),
    /// then the device's.
    Miscounted((u64, u64), (u64, u64)),
    /// An error that no fault of a frame may cause.
    Error(String),
}

/// State of a run's checks.
#[derive(Default)]
pub(super) struct RunOracle {
    account: FrameRecord,
    /// The tick since which no host requests force.
    unwished: Option<u64>,
    /// True if the present host has requested arming.
    asked: bool,
    /// The device's session, and true if the amplifiers were on at its start and ever since.
    inherited: (u32, bool),
    /// The tick of the last frame to the device.
    received_at: u64,
}

impl RunOracle {
    pub(super) fn device_says(&mut self, bytes: &[u8]) {
        self.account.hear(bytes);
    }

    pub(super) fn host_says(&mut self, bytes: &[u8]) {
        self.asked |= asks_to_arm(bytes);
    }

    /// Records a frame that arrived at the device.
    pub(super) const fn frame_came(&mut self, now: u64) {
        self.received_at = now;
    }

    /// Records that another host replaced a killed one.
    pub(super) const fn another_host(&mut self) {
        self.asked = false;
    }

    /// Records that a host requests force.
    pub(super) const fn wished(&mut self) {
        self.unwished = None;
    }

    /// Records that no host requests force from this tick on.
    pub(super) const fn unwished_from(&mut self, tick: u64) {
        self.unwished = Some(tick);
    }

    /// Checks a tick with the amplifiers on or off, while the host is in this session.
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
        if enabled && now > self.received_at + SILENCE {
            return Err(Wrong::Forsaken(now));
        }
        Ok(())
    }

    /// Checks the host's view: its session is open with this device, and these were its samples, by
    /// their ticks.
    pub(super) fn reported(
        &self,
        session: u32,
        opened: Option<&DeviceHello>,
        samples: &[u32],
    ) -> Result<(), Wrong> {
        let mut greetings = self.account.greetings(session);
        if let Some(device) = opened.filter(|device| !greetings.any(|stated| stated == *device)) {
            return Err(Wrong::Misled(format!("{device:?}")));
        }
        let has_told = |tick: &&u32| self.account.has_told(session, **tick);
        match samples.iter().find(|tick| !has_told(tick)) {
            Some(tick) => Err(Wrong::Misled(format!("the sample of tick {tick}"))),
            None => Ok(()),
        }
    }

    /// Checks that the device is disarmed, as the host concluded, and must stay so.
    pub(super) const fn agreed(&mut self, now: u64, enabled: bool) -> Result<(), Wrong> {
        self.unwished = Some(0);
        match enabled {
            true => Err(Wrong::NotDisarmed(now)),
            false => Ok(()),
        }
    }

    /// Compares the host's counts of its sessions with the device's.
    pub(super) fn count(&self, stats: &LinkStats, sessions: &[u32]) -> Result<(), Wrong> {
        let counted = (stats.samples + stats.lost, stats.dropped);
        let made = self.account.of(sessions);
        match counted == made || stats.uncertain > 0 {
            true => Ok(()),
            false => Err(Wrong::Miscounted(counted, made)),
        }
    }
}
