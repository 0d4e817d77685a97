//! Checks every tick of a run, and the messages to the host.

use hapterra::link::LinkStats;
use hapterra_core::wire::hello::DeviceHello;

use super::frame_record::{FrameRecord, requests_arming};

/// Ticks in which the force fades after the answer to a request to disarm.
pub(super) const FADE: u64 = 150;
/// Silence of a host after which the device disarms: in seconds, and in ticks with the fade.
pub(super) const SILENCE_S: u16 = 5;
const SILENCE: u64 = SILENCE_S as u64 * 1_000 + FADE;

/// Violation of the protocol.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Violation {
    /// The run did not end within `MAX_TICKS` ticks.
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
    record: FrameRecord,
    /// The tick since which no host requests force.
    forbidden_from: Option<u64>,
    /// True if the present host has requested arming.
    arming_requested: bool,
    /// The device's session, and true if the amplifiers were on at its start and ever since.
    inherited: (u32, bool),
    /// The tick of the last frame to the device.
    received_at: u64,
}

impl RunOracle {
    pub(super) fn on_device_bytes(&mut self, bytes: &[u8]) {
        self.record.receive(bytes);
    }

    pub(super) fn on_host_bytes(&mut self, bytes: &[u8]) {
        self.arming_requested |= requests_arming(bytes);
    }

    /// Records a frame that arrived at the device.
    pub(super) const fn on_frame(&mut self, now: u64) {
        self.received_at = now;
    }

    /// Records that another host replaced a killed one.
    pub(super) const fn on_host_restart(&mut self) {
        self.arming_requested = false;
    }

    /// Records that a host requests force.
    pub(super) const fn request_force(&mut self) {
        self.forbidden_from = None;
    }

    /// Records that no host requests force from this tick on.
    pub(super) const fn forbid_force_from(&mut self, tick: u64) {
        self.forbidden_from = Some(tick);
    }

    /// Checks a tick with the amplifiers on or off, while the host is in this session.
    pub(super) fn check(&mut self, now: u64, enabled: bool, session: u32) -> Result<(), Violation> {
        let is_greeted = self.record.greetings(session).next().is_some();
        if self.inherited.0 != session && is_greeted {
            self.inherited = (session, enabled);
        }
        self.inherited.1 &= enabled;
        let unasked = is_greeted && !self.inherited.1 && !self.arming_requested;
        if enabled && self.forbidden_from.is_some_and(|since| now > since) {
            return Err(Violation::Driven(now));
        }
        if enabled && unasked {
            return Err(Violation::Unasked(now));
        }
        if enabled && now > self.received_at + SILENCE {
            return Err(Violation::Forsaken(now));
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
    ) -> Result<(), Violation> {
        let mut greetings = self.record.greetings(session);
        if let Some(device) = opened.filter(|device| !greetings.any(|sent| sent == *device)) {
            return Err(Violation::Misled(format!("{device:?}")));
        }
        let has_sent = |tick: &&u32| self.record.has_sent(session, **tick);
        match samples.iter().find(|tick| !has_sent(tick)) {
            Some(tick) => Err(Violation::Misled(format!("the sample of tick {tick}"))),
            None => Ok(()),
        }
    }

    /// Checks that the device is disarmed, as the host concluded, and must stay so.
    pub(super) const fn check_agreed_end(
        &mut self,
        now: u64,
        enabled: bool,
    ) -> Result<(), Violation> {
        self.forbidden_from = Some(0);
        match enabled {
            true => Err(Violation::NotDisarmed(now)),
            false => Ok(()),
        }
    }

    /// Compares the host's counts of its sessions with the device's.
    pub(super) fn count(&self, stats: &LinkStats, sessions: &[u32]) -> Result<(), Violation> {
        let counted = (stats.samples + stats.lost, stats.dropped);
        let made = self.record.of(sessions);
        match counted == made || stats.uncertain > 0 {
            true => Ok(()),
            false => Err(Violation::Miscounted(counted, made)),
        }
    }
}
