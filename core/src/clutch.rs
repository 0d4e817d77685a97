//! The clutch: while it is held, the terrain follows the hand, and its placement may change.
//!
//! ```text
//!           held                force out               let go               force in
//! Closed ─────────▶ Opening ─────────────▶ Open ─────────────────▶ Closing ──────────▶ Closed
//!                      ▲                                              │
//!                      └──────────────────── held ────────────────────┘
//! ```
//!
//! While the clutch opens and closes, the contact continues, and a share of its force is rendered:
//! from full force to zero in 0.1 s, from zero to full force in 0.5 s. The rest of the tick, the
//! guard and all its limits stay the same.
//!
//! The host holds it, or the board's clutch input, or both: it is open until both release it.
//!
//! It always opens fully before it closes again. A spring that gets softer takes energy from the
//! hand and one that gets harder gives some, so one cycle gives the hand at most the energy of the
//! spring: ½ F² / K, 72 mJ at 8.5 N and 0.5 N/mm, and the next cycle can give it 0.5 s later at the
//! earliest. If the terrain stays in its place, the work over the hand's motion is added, 10 mm at
//! most.
//!
//! A pressing hand yields when the force fades out: it moves on towards its target. If the terrain
//! follows it, the ground sinks by that distance. So a clutch that is held only for a new placement
//! ([`ClutchMode::InPlace`]) keeps the terrain in its place relative to the arm: the point that was
//! under the tip when the clutch opened is there when it closes, and the press returns.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::contact::Contact;
use crate::grid::GridPoint;
use crate::guard::{FADE_MS, Limits};
use crate::rate::TickRate;
use crate::scene::Scene;
use crate::terrain::Window;

/// Duration of the ramp-up to full force, ms.
const RAMP_UP_MS: u32 = 500;
/// Maximum motion of the hand, mm, for which the terrain stays in its place; for any motion beyond
/// that the terrain follows the hand. A hand that yields under 1.2 N moves some 5 mm.
const MAX_OFFSET_MM: f32 = 10.0;

/// The host's use of the clutch. While it is held, the HIP stays at its place over the terrain, and
/// no force is rendered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ClutchMode {
    /// Not held.
    #[default]
    Released,
    /// The terrain follows the hand: it is rendered again at the new position of the hand.
    WithHand,
    /// For a new placement: the terrain is rendered again in its place relative to the arm, after
    /// any motion of the hand up to 10 mm.
    InPlace,
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// The clutch has no effect.
    Closed,
    /// The force fades out.
    Opening,
    /// The HIP stays at its place over the terrain for any motion of the tip. `tip_mm` is the tip's
    /// position when the clutch opened, from its home pose: device millimetres east, north and up,
    /// which are the same in every placement.
    Open { hip: GridPoint, tip_mm: Vec3 },
    /// The force ramps up.
    Closing,
}

/// The clutch of an arm's scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clutch {
    state: State,
    /// The host's use of the clutch.
    host: ClutchMode,
    /// True if the board's clutch input is held: the terrain follows the hand.
    input: bool,
    /// True if the terrain had to follow the hand at some time since the clutch was held.
    follows_hand: bool,
    /// Remaining shift of the terrain, relative to the tip, mm.
    pending_shift_mm: Vec3,
    /// Share of the force for a driven arm.
    ramp: f32,
    /// Share of the force in the last tick.
    share: f32,
    /// The clutch's limits of the last tick.
    limits: Limits,
    /// Decrease of the share in a tick: the same as for disarming.
    fade_step: f32,
    ramp_step: f32,
}

impl Clutch {
    /// Creates a closed clutch.
    pub(crate) fn new(rate: TickRate) -> Self {
        Self {
            state: State::Closed,
            host: ClutchMode::Released,
            input: false,
            follows_hand: false,
            pending_shift_mm: Vec3::ZERO,
            ramp: 1.0,
            share: 1.0,
            limits: Limits::empty(),
            fade_step: 1.0 / rate.ticks(FADE_MS) as f32,
            ramp_step: 1.0 / rate.ticks(RAMP_UP_MS) as f32,
        }
    }

    /// Returns true if the clutch has no effect on a tick.
    #[inline]
    pub(crate) const fn is_closed(&self) -> bool {
        matches!(self.state, State::Closed)
    }

    /// Returns true if there is no force, and the HIP stays at its place over the terrain.
    pub(crate) const fn is_open(&self) -> bool {
        matches!(self.state, State::Open { .. })
    }

    /// Restarts, closed, for a new scene. A held input opens the clutch of an arm; a replay has no
    /// hand.
    pub(crate) fn restart(&mut self, rate: TickRate, of_arm: bool) {
        let input = self.input;
        *self = Self::new(rate);
        self.input = input;
        if of_arm {
            self.open_if_held();
        }
    }

    /// Sets the host's use of the clutch.
    pub(crate) fn set_mode(&mut self, host: ClutchMode) {
        self.host = host;
        self.open_if_held();
    }

    /// Sets the state of the board's clutch input.
    pub(crate) fn set_input(&mut self, held: bool) {
        self.input = held;
        self.open_if_held();
    }

    /// Returns true if the host or the input holds the clutch.
    const fn is_held(&self) -> bool {
        self.input || !matches!(self.host, ClutchMode::Released)
    }

    fn open_if_held(&mut self) {
        if !self.is_held() {
            return;
        }
        if let State::Closed | State::Closing = self.state {
            self.state = State::Opening;
            self.follows_hand = false;
        }
        self.follows_hand |= self.input || self.host == ClutchMode::WithHand;
    }

    /// Moves the HIP of an open clutch.
    pub(crate) fn set_hip(&mut self, there: GridPoint) {
        if let State::Open { hip, .. } = &mut self.state {
            *hip = there;
        }
    }

    /// Returns the clutch's limits of the tick: none if it is closed.
    #[inline]
    pub(crate) const fn limits(&self) -> Limits {
        self.limits
    }

    /// Returns the rendered share of the force: 1 if the clutch is closed.
    #[inline]
    pub(crate) const fn share(&self) -> f32 {
        self.share
    }

    /// Runs a tick of a clutch that is not closed, with the tip at a place over the terrain.
    /// Returns the HIP. During closing it moves the scene's home, to bring the terrain to its
    /// place.
    ///
    /// An arm that is not driven has the full force in its share, so that the clutch cannot hide a
    /// large force from the check of arming.
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
                self.ramp -= self.fade_step;
                if self.ramp <= 0.0 {
                    self.ramp = 0.0;
                    let tip_mm = from_home_mm(scene);
                    self.state = State::Open { hip, tip_mm };
                }
            }
            State::Open { hip: there, tip_mm } => {
                if let Some(start) = contact.place_on_surface(window) {
                    *there = start;
                }
                hip = *there;
                if !is_held && !contact.is_onset_pending() {
                    self.pending_shift_mm += from_home_mm(scene) - *tip_mm;
                    self.pending_shift_mm = match self.follows_hand {
                        true => Vec3::ZERO,
                        false => self.pending_shift_mm.clamp_length_max(MAX_OFFSET_MM),
                    };
                    move_home(scene, tip.to(&hip));
                    self.state = State::Closing;
                }
            }
            State::Closing => {
                // Together with the force, and no faster than a hand: after a jump the proxy would
                // lag.
                let share = (self.ramp_step / (1.0 - self.ramp)).min(1.0);
                let step_mm = self.pending_shift_mm * share;
                move_home(scene, step_mm / scene.cell_mm);
                self.pending_shift_mm -= step_mm;
                self.ramp += self.ramp_step;
                if self.ramp >= 1.0 {
                    self.ramp = 1.0;
                    self.state = State::Closed;
                }
            }
        }
        self.share = if drives { self.ramp } else { 1.0 };
        self.limits = self.current_limits();
        hip
    }

    const fn current_limits(&self) -> Limits {
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

/// Moves the point that is at the tip in the home pose, by `shift` cells.
fn move_home(scene: &mut Scene, shift: Vec3) {
    scene.home = GridPoint::new(scene.home.cell(), scene.home.frac() + shift);
}
