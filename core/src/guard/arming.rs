//! The conditions and times of each change of the mode, and the gain of the force's ramps.

use serde::{Deserialize, Serialize};

use super::flags::Blockers;
use super::mode::Mode;
use crate::rate::TickRate;
use crate::scalar::smaller;

/// Time after which a blocked arm command is refused, ms.
const BLOCKED_TIMEOUT_MS: u32 = 50;
/// Time for which an arm command waits for the dead-man switch, ms.
const SWITCH_TIMEOUT_MS: u32 = 30_000;
/// Time for which the force must stay small, ms.
const CONFIRM_MS: u32 = 100;
/// Duration of the force's ramp-up, ms.
const RAMP_MS: u32 = 2_000;
/// Duration of the force's fade-out, ms.
pub(crate) const FADE_MS: u32 = 100;

/// Upper limit of a small force, N.
pub const SMALL_FORCE_N: f32 = 0.2;

/// Outcome of the arm commands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Decision {
    /// Number of decided arm commands, wrapping.
    pub count: u8,
    /// Reasons for the refusal of the last arm command; empty if it was granted.
    pub refused: Blockers,
}

/// State of arming, and its time.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Arming {
    pub(super) mode: Mode,
    /// Ticks since the mode began.
    since: u32,
    /// Ticks for which a request has been blocked.
    blocked: u32,
    /// True if the current request has been decided.
    decided: bool,
    pub(super) decision: Decision,
    /// True if the switch was open at some time during the request.
    was_switch_open: bool,
    /// Rendered share of the force.
    pub(super) gain: f32,
    pub(super) rate: TickRate,
}

impl Arming {
    pub(super) fn new(rate: TickRate) -> Self {
        Self {
            decided: true,
            rate,
            ..Self::default()
        }
    }

    fn enter(&mut self, mode: Mode) {
        debug_assert!(self.mode.exits().contains(&mode));
        self.mode = mode;
        self.since = 0;
    }

    /// Requests arming. A repeated request restarts the time-out.
    pub(super) fn request(&mut self) {
        match self.mode {
            Mode::Disarmed => self.enter(Mode::Requested),
            Mode::Requested => self.since = 0,
            Mode::Fading => return self.decide(Blockers::HOST_DISARMED),
            // Arming is already in progress.
            _ => return self.decide(Blockers::empty()),
        }
        self.blocked = 0;
        self.decided = false;
        self.was_switch_open = false;
    }

    /// Switches off at once; `why` is the decision of an open request.
    pub(super) fn stop(&mut self, why: Blockers) {
        if self.mode != Mode::Disarmed {
            self.enter(Mode::Disarmed);
        }
        self.gain = 0.0;
        if !self.decided {
            self.decide(why);
        }
    }

    /// Switches off, after fading out a force.
    pub(super) fn fade(&mut self) {
        match self.mode {
            Mode::Ramping | Mode::Armed => self.enter(Mode::Fading),
            Mode::Fading => {}
            Mode::Disarmed | Mode::Requested | Mode::Confirming => {
                self.stop(Blockers::HOST_DISARMED);
            }
        }
    }

    fn decide(&mut self, refused: Blockers) {
        self.decided = true;
        self.decision = Decision {
            count: self.decision.count.wrapping_add(1),
            refused,
        };
    }

    /// Advances by a tick with the amplifiers off, with the blockers other than those that the user
    /// can clear.
    pub(super) fn advance_off(&mut self, blockers: Blockers, dead_man: bool) {
        self.since = self.since.saturating_add(1);
        match self.mode {
            Mode::Requested => self.wait_for_press(blockers, dead_man),
            Mode::Confirming if !blockers.is_empty() => self.stop(blockers),
            Mode::Confirming if !dead_man => {
                self.enter(Mode::Requested);
                self.was_switch_open = true;
            }
            _ => {}
        }
    }

    fn wait_for_press(&mut self, blockers: Blockers, dead_man: bool) {
        if !blockers.is_empty() {
            self.blocked += 1;
            self.was_switch_open = false;
            if self.blocked > self.rate.ticks(BLOCKED_TIMEOUT_MS) {
                self.stop(blockers);
            }
            return;
        }
        self.blocked = 0;
        if !self.decided {
            self.decide(Blockers::empty());
        }
        if !dead_man {
            self.was_switch_open = true;
        } else if self.was_switch_open {
            return self.enter(Mode::Confirming);
        }
        if self.since > self.rate.ticks(SWITCH_TIMEOUT_MS) {
            self.stop(Blockers::empty());
        }
    }

    /// Advances the confirmation; `small` is true if the commanded force is small.
    pub(super) fn confirm(&mut self, small: bool) {
        if !small {
            self.since = 0;
        } else if self.since >= self.rate.ticks(CONFIRM_MS) {
            self.enter(Mode::Ramping);
            self.gain = 0.0;
        }
    }

    /// Returns the gain of this tick before [`Arming::advance_on`] sets it; `None` while the force
    /// does not follow the target force.
    pub(super) fn next_gain(&self) -> Option<f32> {
        match self.mode {
            Mode::Ramping => Some(smaller(
                self.gain + 1.0 / self.rate.ticks(RAMP_MS) as f32,
                1.0,
            )),
            Mode::Armed => Some(self.gain),
            _ => None,
        }
    }

    /// Advances the gain by a tick with the amplifiers on.
    pub(super) fn advance_on(&mut self) {
        match self.mode {
            Mode::Ramping => {
                self.gain = self.next_gain().unwrap_or_default();
                if self.gain >= 1.0 {
                    self.enter(Mode::Armed);
                }
            }
            Mode::Fading => {
                self.gain -= 1.0 / self.rate.ticks(FADE_MS) as f32;
                if self.gain <= 0.0 {
                    self.stop(Blockers::HOST_DISARMED);
                }
            }
            _ => {}
        }
    }

    /// Returns the blockers that the user and the host can clear.
    pub(super) fn user_blockers(&self, dead_man: bool) -> Blockers {
        let host = match self.mode {
            Mode::Disarmed => Blockers::HOST_DISARMED,
            _ => Blockers::empty(),
        };
        let hand = match (self.mode.is_driving(), dead_man) {
            (false, false) => Blockers::DEAD_MAN_RELEASED,
            (false, true) if self.mode != Mode::Confirming && !self.was_switch_open => {
                Blockers::DEAD_MAN_STILL_HELD
            }
            _ => Blockers::empty(),
        };
        host | hand
    }
}
