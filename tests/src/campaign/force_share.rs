//! The share of a scene's force that passes the guard, from the modes and limits that the device
//! reports.

use hapterra_core::guard::{Limits, Mode};
use hapterra_core::scene::TickRecord;

/// Increments of the ramps in a tick of 1 ms: 2 s after arming, 0.1 s and 0.5 s of the clutch.
const RAMPS: f32 = 1.0 / 2_000.0;
const OPENS: f32 = 1.0 / 100.0;
const CLOSES: f32 = 1.0 / 500.0;

/// State of the clutch.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Clutch {
    Closed,
    Opening(f32),
    Open,
    Closing(f32),
}

/// The shares of a scene's force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shares {
    /// The clutch's share, before the guard's clamp.
    pub clutch: f32,
    /// The ramp's share, after the clamp.
    pub ramp: f32,
}

impl Shares {
    /// Returns the share of a force that the guard does not clamp.
    #[must_use]
    pub fn product(self) -> f32 {
        self.clutch * self.ramp
    }
}

/// Follows ramp and clutch from tick to tick.
#[derive(Clone, Copy, Debug)]
pub struct Share {
    ramp: Option<f32>,
    clutch: Option<Clutch>,
}

impl Share {
    /// The state before the first sample.
    pub const UNKNOWN: Self = Self {
        ramp: None,
        clutch: None,
    };

    /// Takes the sample after `last`, or `None` as `last` if samples are missing. Returns the
    /// shares of the force if they are known and agree with the scene.
    pub fn update(&mut self, last: Option<&TickRecord>, sample: &TickRecord) -> Option<Shares> {
        self.ramp = match (last.map(|last| last.mode), sample.mode) {
            (_, Mode::Armed) => Some(1.0),
            (Some(Mode::Confirming), Mode::Ramping) => Some(RAMPS),
            (Some(Mode::Ramping), Mode::Ramping) => self.ramp.map(|ramp| ramp + RAMPS),
            _ => None,
        };
        let moves = sample.limits.contains(Limits::CLUTCH_MOVES);
        let is_open = sample.limits.contains(Limits::CLUTCH_OPEN);
        self.clutch = match (self.clutch.filter(|_| last.is_some()), moves, is_open) {
            (_, _, true) => Some(Clutch::Open),
            (_, false, false) => Some(Clutch::Closed),
            // A placement has changed under the hand: the force turns, and no share is known.
            (Some(Clutch::Closed), ..) if last.is_some_and(|last| last.view != sample.view) => None,
            (Some(Clutch::Closed), ..) => Some(Clutch::Opening(1.0 - OPENS)),
            (Some(Clutch::Opening(share)), ..) => Some(Clutch::Opening(share - OPENS)),
            (Some(Clutch::Open), ..) => Some(Clutch::Closing(0.0)),
            (Some(Clutch::Closing(share)), ..) => Some(Clutch::Closing(share + CLOSES)),
            (None, ..) => None,
        };
        let clutch = match self.clutch? {
            Clutch::Closed => 1.0,
            Clutch::Open => 0.0,
            Clutch::Opening(share) | Clutch::Closing(share) => share.clamp(0.0, 1.0),
        };
        Some(Shares {
            clutch,
            ramp: self.ramp?.min(1.0),
        })
    }
}
