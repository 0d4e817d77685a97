//! The clutch: while it is held the terrain goes with the hand, and another view of it may
//! be put in.
//!
//! ```text
//!           held                force out               let go               force in
//! Closed ─────────▶ Opening ─────────────▶ Open ─────────────────▶ Closing ──────────▶ Closed
//!                      ▲                                              │
//!                      └──────────────────── held ────────────────────┘
//! ```
//!
//! While it opens and closes the contact continues as ever, and a share of its force is let
//! through: from all to nothing in 0.1 s, from nothing to all in 0.5 s. The rest of the path,
//! the guard and all its bounds, is as it always is.
//!
//! The host holds it, or the board's clutch input, or both: it is open until both have let go.
//!
//! It opens to the end before it closes again, however often it is held and let go. A spring that
//! gets softer takes energy from the hand and one that gets harder gives some, so one turn gives the
//! hand at most what the spring holds then: ½ F² / K, 72 mJ at 8.5 N and 0.5 N/mm, and 0.5 s pass until it may
//! be given again. Where the terrain stays in its place that is more by what the hand has moved meanwhile, 10 mm
//! at most.
//!
//! A hand that presses gives way when the force goes out: it moves on, towards where it wants to
//! be. Where the terrain goes with it the ground sinks by that. So a clutch that is held for another
//! view only ([`ClutchHold::InPlace`]) leaves the terrain in its place before the arm: the point that was
//! under the tip when the clutch opened is there when it closes, and the press returns.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::contact::Contact;
use crate::grid::GridPoint;
use crate::guard::{FADE_MS, Limits};
use crate::rate::TickRate;
use crate::scene::Scene;
use crate::terrain::Window;

/// Time that all of it takes to come in again, ms.
const IN_MS: u32 = 500;
/// Most that a hand may have moved while the terrain stayed in its place, mm. What it moved
/// beyond that the terrain goes with it: a hand that gives way under 1.2 N moves some 5 mm.
const GIVE_MM: f32 = 10.0;

/// The host's use of the clutch. In either way the HIP stays where it is over the terrain,
/// and no force is rendered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ClutchHold {
    /// Not held.
    #[default]
    LetGo,
    /// The terrain goes with the hand: it is rendered again at the new position of the hand.
    WithHand,
    /// For another view: the terrain is rendered again where it was before the arm, however the hand
    /// gave way meanwhile, up to 10 mm.
    InPlace,
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// The terrain is where it is.
    Closed,
    /// The force goes out.
    Opening,
    /// The HIP stays at its place over the terrain, wherever the tip goes. `tip_mm` is
    /// where the tip was when it opened, from its home pose: device millimetres east,
    /// north and up, which are the same in every view.
    Open { hip: GridPoint, tip_mm: Vec3 },
    /// The force comes in again.
    Closing,
}

/// The clutch of an arm's scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clutch {
    state: State,
    /// The host's use of it.
    host: ClutchHold,
    /// The board's clutch input is held: the terrain goes with the hand.
    input: bool,
    /// Since it was held the terrain was to go with the hand.
    carries: bool,
    /// Remaining return of the terrain, relative to the tip, mm.
    owed_mm: Vec3,
    /// Share of the force that is let through to a driven arm.
    ramp: f32,
    /// Share that was let through in the last tick.
    share: f32,
    /// Its limits of the last tick.
    limits: Limits,
    /// Most that it may change in a tick: out as when the arm is disarmed.
    out: f32,
    back: f32,
}

impl Clutch {
    /// Closed.
    pub(crate) fn new(rate: TickRate) -> Self {
        Self {
            state: State::Closed,
            host: ClutchHold::LetGo,
            input: false,
            carries: false,
            owed_mm: Vec3::ZERO,
            ramp: 1.0,
            share: 1.0,
            limits: Limits::empty(),
            out: 1.0 / rate.ticks(FADE_MS) as f32,
            back: 1.0 / rate.ticks(IN_MS) as f32,
        }
    }

    /// Returns true if it takes no part in a tick.
    #[inline]
    pub(crate) const fn is_closed(&self) -> bool {
        matches!(self.state, State::Closed)
    }

    /// Returns true if there is no force, and the HIP stays where it is over the terrain.
    pub(crate) const fn is_open(&self) -> bool {
        matches!(self.state, State::Open { .. })
    }

    /// As at the beginning of a scene: closed. An input that is held opens the clutch of an
    /// arm; a replay has no hand.
    pub(crate) fn begin(&mut self, rate: TickRate, of_arm: bool) {
        let input = self.input;
        *self = Self::new(rate);
        self.input = input;
        if of_arm {
            self.open_if_held();
        }
    }

    /// The host holds it like this from now on, or no longer.
    pub(crate) fn hold(&mut self, host: ClutchHold) {
        self.host = host;
        self.open_if_held();
    }

    /// The board's clutch input is held from now on, or no longer.
    pub(crate) fn press(&mut self, held: bool) {
        self.input = held;
        self.open_if_held();
    }

    /// Returns true if it is held.
    const fn is_held(&self) -> bool {
        self.input || !matches!(self.host, ClutchHold::LetGo)
    }

    fn open_if_held(&mut self) {
        if !self.is_held() {
            return;
        }
        if let State::Closed | State::Closing = self.state {
            self.state = State::Opening;
            self.carries = false;
        }
        self.carries |= self.input || self.host == ClutchHold::WithHand;
    }

    /// Puts the HIP of an open clutch somewhere else.
    pub(crate) fn put(&mut self, there: GridPoint) {
        if let State::Open { hip, .. } = &mut self.state {
            *hip = there;
        }
    }

    /// Returns its limits of the tick: none where it is closed.
    #[inline]
    pub(crate) const fn limits(&self) -> Limits {
        self.limits
    }

    /// Share of the force that it lets through: all where it is closed.
    #[inline]
    pub(crate) const fn share(&self) -> f32 {
        self.share
    }

    /// One tick of a clutch that is not closed, with the tip at a place over the terrain.
    /// Returns where the HIP is. When it closes it moves the scene's home, so that the
    /// terrain is where it is to be.
    ///
    /// An arm that is not driven has all of the force in its share: nothing is armed by
    /// holding the clutch in the ground.
    #[cold]
    #[inline(never)]
    pub(crate) fn tick<const D: usize>(
        &mut self,
        tip: GridPoint,
        scene: &mut Scene,
        (contact, window): (&mut Contact, &Window<'_, D>),
        drives: bool,
    ) -> GridPoint {
        let is_held = self.is_held();
        let from_home_mm = |scene: &Scene| scene.home.to(&tip) * scene.cell_mm;
        let mut hip = tip;
        match &mut self.state {
            State::Closed => {}
            State::Opening => {
                self.ramp -= self.out;
                if self.ramp <= 0.0 {
                    self.ramp = 0.0;
                    let tip_mm = from_home_mm(scene);
                    self.state = State::Open { hip, tip_mm };
                }
            }
            State::Open { hip: there, tip_mm } => {
                if let Some(landed) = contact.land(window) {
                    *there = landed;
                }
                hip = *there;
                if !is_held && !contact.is_landing() {
                    self.owed_mm += from_home_mm(scene) - *tip_mm;
                    self.owed_mm = match self.carries {
                        true => Vec3::ZERO,
                        false => self.owed_mm.clamp_length_max(GIVE_MM),
                    };
                    move_home(scene, tip.to(&hip));
                    self.state = State::Closing;
                }
            }
            State::Closing => {
                // With the force, and no faster than a hand: in a leap the proxy would lag.
                let share = (self.back / (1.0 - self.ramp)).min(1.0);
                let step_mm = self.owed_mm * share;
                move_home(scene, step_mm / scene.cell_mm);
                self.owed_mm -= step_mm;
                self.ramp += self.back;
                if self.ramp >= 1.0 {
                    self.ramp = 1.0;
                    self.state = State::Closed;
                }
            }
        }
        self.share = if drives { self.ramp } else { 1.0 };
        self.limits = self.limits_now();
        hip
    }

    const fn limits_now(&self) -> Limits {
        let by = match self.input {
            true => Limits::CLUTCH_INPUT,
            false => Limits::empty(),
        };
        match self.state {
            State::Closed => Limits::empty(),
            State::Open { .. } => by.union(Limits::CLUTCH_OPEN),
            State::Opening | State::Closing => by.union(Limits::CLUTCH_MOVES),
        }
    }
}

/// Moves the point that is at the tip in the home pose, cells.
fn move_home(scene: &mut Scene, shift: Vec3) {
    scene.home = GridPoint::new(scene.home.cell(), scene.home.frac() + shift);
}
