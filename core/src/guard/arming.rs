//! The way from off to on, and back.

use serde::{Deserialize, Serialize};

use super::flags::Blockers;
use super::mode::Mode;
use super::rate::TickRate;

/// How long an arm command may wait for what the host cannot change, ms.
const GRACE_MS: u32 = 50;
/// How long it may wait for the dead-man switch, ms.
const PATIENCE_MS: u32 = 30_000;
/// For how long the force has to stay small, ms.
const CONFIRM_MS: u32 = 100;
/// How long force takes to come in, ms.
const RAMP_MS: u32 = 2_000;
/// How long it takes to go out, ms.
const FADE_MS: u32 = 100;

/// The force that counts as small, N.
pub const SMALL_FORCE_N: f32 = 0.2;

/// What became of the arm commands so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Decision {
    /// Arm commands decided, wrapping.
    pub count: u8,
    /// Why the last of them was refused; nothing if it was granted.
    pub refused: Blockers,
}

/// Where arming stands, and since when.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arming {
    mode: Mode,
    /// Ticks since the mode began.
    since: u32,
    /// Ticks that something has been in the way of a request.
    blocked: u32,
    /// Whether the request in force has been decided.
    decided: bool,
    decision: Decision,
    /// The switch was seen open during the request.
    seen_open: bool,
    /// Share of the force that is let through.
    gain: f32,
    times: Times,
}

/// The constants above in ticks.
#[derive(Clone, Copy, Debug)]
struct Times {
    grace: u32,
    patience: u32,
    confirm: u32,
    ramp_step: f32,
    fade_step: f32,
}

impl Arming {
    pub(super) fn new(rate: TickRate) -> Self {
        Self {
            mode: Mode::Disarmed,
            since: 0,
            blocked: 0,
            decided: true,
            decision: Decision::default(),
            seen_open: false,
            gain: 0.0,
            times: Times {
                grace: rate.ticks(GRACE_MS),
                patience: rate.ticks(PATIENCE_MS),
                confirm: rate.ticks(CONFIRM_MS),
                ramp_step: 1.0 / rate.ticks(RAMP_MS) as f32,
                fade_step: 1.0 / rate.ticks(FADE_MS) as f32,
            },
        }
    }

    pub(super) const fn mode(&self) -> Mode {
        self.mode
    }

    pub(super) const fn decision(&self) -> Decision {
        self.decision
    }

    pub(super) const fn gain(&self) -> f32 {
        self.gain
    }

    fn enter(&mut self, mode: Mode) {
        debug_assert!(self.mode.exits().contains(&mode));
        self.mode = mode;
        self.since = 0;
    }

    /// The host asks to arm. Asked again, it waits anew.
    pub(super) fn request(&mut self) {
        match self.mode {
            Mode::Disarmed => self.enter(Mode::Requested),
            Mode::Requested => self.since = 0,
            Mode::Fading => return self.decide(Blockers::HOST_DISARMED),
            // It is on its way already.
            _ => return self.decide(Blockers::empty()),
        }
        self.blocked = 0;
        self.decided = false;
        self.seen_open = false;
    }

    /// Off at once; `why` answers a request that is still open.
    pub(super) fn stop(&mut self, why: Blockers) {
        if self.mode != Mode::Disarmed {
            self.enter(Mode::Disarmed);
        }
        self.gain = 0.0;
        if !self.decided {
            self.decide(why);
        }
    }

    /// Off, after force has gone out where there is any.
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

    /// Before the amplifiers are on: one tick, with what is in the way of
    /// arming besides the user's hand.
    pub(super) fn wait(&mut self, in_the_way: Blockers, dead_man: bool) {
        self.since = self.since.saturating_add(1);
        match self.mode {
            Mode::Requested => self.wait_for_press(in_the_way, dead_man),
            Mode::Confirming if !in_the_way.is_empty() => self.stop(in_the_way),
            Mode::Confirming if !dead_man => {
                self.enter(Mode::Requested);
                self.seen_open = true;
            }
            _ => {}
        }
    }

    fn wait_for_press(&mut self, in_the_way: Blockers, dead_man: bool) {
        if !in_the_way.is_empty() {
            self.blocked += 1;
            self.seen_open = false;
            if self.blocked > self.times.grace {
                self.stop(in_the_way);
            }
            return;
        }
        self.blocked = 0;
        if !self.decided {
            self.decide(Blockers::empty());
        }
        if !dead_man {
            self.seen_open = true;
        } else if self.seen_open {
            return self.enter(Mode::Confirming);
        }
        if self.since > self.times.patience {
            self.stop(Blockers::empty());
        }
    }

    /// While confirming: whether the force that would be made is small.
    pub(super) fn confirm(&mut self, small: bool) {
        if !small {
            self.since = 0;
        } else if self.since >= self.times.confirm {
            self.enter(Mode::Ramping);
            self.gain = 0.0;
        }
    }

    /// With the amplifiers on: moves the gain by a tick.
    pub(super) fn drive(&mut self) {
        match self.mode {
            Mode::Ramping => {
                self.gain += self.times.ramp_step;
                if self.gain >= 1.0 {
                    self.gain = 1.0;
                    self.enter(Mode::Armed);
                }
            }
            Mode::Fading => {
                self.gain -= self.times.fade_step;
                if self.gain <= 0.0 {
                    self.stop(Blockers::HOST_DISARMED);
                }
            }
            _ => {}
        }
    }

    /// What the user's hand and the host still have to do.
    pub(super) fn by_hand(&self, dead_man: bool) -> Blockers {
        let host = match self.mode {
            Mode::Disarmed => Blockers::HOST_DISARMED,
            _ => Blockers::empty(),
        };
        let hand = match (self.mode.drives(), dead_man) {
            (false, false) => Blockers::DEAD_MAN_RELEASED,
            (false, true) if self.mode != Mode::Confirming && !self.seen_open => {
                Blockers::DEAD_MAN_STILL_HELD
            }
            _ => Blockers::empty(),
        };
        host | hand
    }
}
