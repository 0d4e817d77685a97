//! A press of the dead-man switch as consent, which a host cannot replace.
//!
//! A stored record sets the guard's limits from the next start on, for every later user of
//! the arm. So the user at the arm has to agree: after the request, the switch must be open and
//! then pressed, within [`PRESS_TIMEOUT_MS`], while the arm is disarmed.

use hapterra_core::guard::Mode;
use hapterra_core::scene::Health;
use hapterra_core::wire::request::Refusal;
use hapterra_core::wire::status::PRESS_TIMEOUT_MS;

/// Waits for a press.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PressWait {
    /// The tick of the request.
    start: u32,
    /// Max ticks of the wait.
    timeout: u32,
    was_open: bool,
}

impl PressWait {
    /// Begins to wait in tick `now`.
    pub(crate) const fn new(now: u32, ticks_per_ms: u32) -> Self {
        Self {
            start: now,
            timeout: PRESS_TIMEOUT_MS * ticks_per_ms,
            was_open: false,
        }
    }

    /// Handles a report of the loop, received in tick `now`. Returns the decision, if there is one.
    pub(crate) fn check(&mut self, health: &Health, now: u32) -> Option<Result<(), Refusal>> {
        if health.report.mode != Mode::Disarmed {
            // A press while armed has another purpose.
            return Some(Err(Refusal::NotWhileArmed));
        }
        if now.wrapping_sub(self.start) > self.timeout {
            return Some(Err(Refusal::NotPressed));
        }
        let is_pressed = health.sense.dead_man && self.was_open;
        self.was_open |= !health.sense.dead_man;
        is_pressed.then_some(Ok(()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn health(dead_man: bool, mode: Mode) -> Health {
        let mut health = Health::default();
        health.sense.dead_man = dead_man;
        health.report.mode = mode;
        health
    }

    /// Returns the outcome of a request in tick 1,000 of a board at 1 kHz, with a report of the
    /// switch every 100 ticks.
    fn decided(mut switch: impl FnMut(u32) -> bool) -> Option<(u32, Result<(), Refusal>)> {
        let mut wait = PressWait::new(1_000, 1);
        (1_000..20_000).step_by(100).find_map(|now| {
            let health = health(switch(now), Mode::Disarmed);
            wait.check(&health, now).map(|result| (now, result))
        })
    }

    #[test]
    fn release_then_press_is_consent() {
        assert_eq!(decided(|now| now >= 4_000), Some((4_000, Ok(()))));
    }

    #[test]
    fn missing_press_times_out_after_ten_seconds() {
        let refused = Some((11_100, Err(Refusal::NotPressed)));
        assert_eq!(decided(|_| false), refused);
        // Too late.
        assert_eq!(decided(|now| now > 11_000), refused);
    }

    #[test]
    fn switch_held_from_the_start_is_no_press() {
        assert_eq!(decided(|_| true), Some((11_100, Err(Refusal::NotPressed))));
        let released_and_pressed = |now| !(3_000..3_500).contains(&now);
        assert_eq!(decided(released_and_pressed), Some((3_500, Ok(()))));
    }

    #[test]
    fn press_while_arming_is_refused() {
        let modes = [Mode::Requested, Mode::Confirming, Mode::Armed, Mode::Fading];
        for mode in modes {
            let mut wait = PressWait::new(0, 1);
            assert_eq!(wait.check(&health(false, Mode::Disarmed), 1), None);
            let refused = wait.check(&health(true, mode), 2);
            assert_eq!(refused, Some(Err(Refusal::NotWhileArmed)));
        }
    }

    #[test]
    fn timeout_handles_tick_wrap_and_higher_rates() {
        let mut wait = PressWait::new(u32::MAX - 50, 10);
        assert_eq!(wait.check(&health(false, Mode::Disarmed), 99_949), None);
        let late = wait.check(&health(false, Mode::Disarmed), 99_951);
        assert_eq!(late, Some(Err(Refusal::NotPressed)));
    }
}
