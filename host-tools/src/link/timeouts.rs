//! Time-outs of host and device.

use std::time::Duration;

use hapterra_core::wire::request::Request;
use hapterra_core::wire::session::{DEFAULT_SILENCE_S, READ_ONLY_SILENCE_S};
use hapterra_core::wire::status::PRESS_TIMEOUT_MS;

use super::host_request::HostRequest;

/// The times of the table in [`hapterra_core::wire`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timeouts {
    /// Time between two tries to send a message.
    pub retry: Duration,
    /// Time between two signs of life.
    pub heartbeat: Duration,
    /// Time without an answer after which the host sends the open message again. A restarted device
    /// needs it; otherwise it changes nothing.
    pub hello_retry: Duration,
    /// Time without an answer after which the device counts as disconnected.
    pub give_up: Duration,
    /// Max time for the device to disarm and confirm it.
    pub goodbye: Duration,
    /// Time, in seconds, for which the device keeps the arm armed while the host is silent.
    pub silence_s: u16,
}

impl Timeouts {
    /// Time for which an armed real board tolerates a silent host, unless the user sets another,
    /// seconds: longer than a host needs to reconnect.
    pub const REAL_SILENCE_S: u16 = 30;

    /// For a device that runs in real time.
    pub const REAL_TIME: Self = Self {
        retry: Duration::from_millis(400),
        heartbeat: Duration::from_millis(500),
        hello_retry: Duration::from_millis(750),
        give_up: Duration::from_secs(4),
        goodbye: Duration::from_secs(3),
        silence_s: Self::REAL_SILENCE_S,
    };

    /// For an emulated board, or a device in this program, on a shared machine.
    pub const EMULATED: Self = Self {
        retry: Duration::from_secs(5),
        heartbeat: Duration::from_millis(500),
        hello_retry: Duration::from_secs(20),
        give_up: Duration::from_secs(120),
        goodbye: Duration::from_secs(60),
        silence_s: DEFAULT_SILENCE_S,
    };

    /// Returns the time-out of an answer: storing a calibration waits for the user's dead-man
    /// press.
    pub(super) fn answer_timeout(&self, request: &HostRequest) -> Duration {
        const PRESS: Duration = Duration::from_millis(PRESS_TIMEOUT_MS as u64);
        match request {
            HostRequest::Request(Request::StoreCalibration) => self.give_up + PRESS,
            _ => self.give_up,
        }
    }

    /// Time-outs for a read-only session: all of it within `give_up`.
    #[must_use]
    pub fn read_only(give_up: Duration) -> Self {
        Self {
            silence_s: READ_ONLY_SILENCE_S,
            ..Self::for_control(give_up)
        }
    }

    /// Time-outs for a session of queries and requests: all of it within `give_up`.
    #[must_use]
    pub fn for_control(give_up: Duration) -> Self {
        Self {
            retry: Self::REAL_TIME.retry.min(give_up),
            hello_retry: Self::REAL_TIME.hello_retry.min(give_up),
            give_up,
            goodbye: Self::REAL_TIME.goodbye.min(give_up),
            ..Self::REAL_TIME
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_timeout_of_a_real_arm_is_5_to_30_seconds() {
        let control = Timeouts::for_control(Duration::from_secs(60));
        for timeout in [Timeouts::REAL_TIME, control] {
            assert!((5..=30).contains(&timeout.silence_s), "{timeout:?}");
        }
    }
}
