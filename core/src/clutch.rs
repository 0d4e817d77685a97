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
//!
//! A placement may also change under a pressing hand, with the clutch closed
//! ([`SceneChange::in_contact`](crate::scene::SceneChange::in_contact)):
//!
//! ```text
//!         a change arrives            its terrain arrives, and the force turns
//! Closed ─────────────────▶ Turning ─────────────────────────────────────────▶ Closed
//! ```
//!
//! While the force turns, it is at most the larger of the forces before and after. It does work over
//! the hand's motion, in half a second more than a spring if the hand moves with it.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::contact::Contact;
use crate::grid::GridPoint;
use crate::guard::{FADE_MS, Limits};
use crate::rate::TickRate;
use crate::scalar::{clamp_length, larger};
use crate::scene::Scene;
use crate::terrain::Window;

/// Duration of the ramp-up to full force, ms.
const RAMP_UP_MS: u32 = 500;
/// Maximum ratio of the difference of two placements' forces to that of the new one: a force that
/// decreases more does so at the guard's rate.
const MAX_TURN_RATIO: f32 = 20.0;
/// Ticks after a change in which the force stays.
const SETTLING_TICKS: u8 = 8;
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
    /// As closed, while a placement waits to change under the pressing hand, or has changed: the
    /// force turns to that of the new one.
    Turning,
    /// The force fades out.
    Opening,
    /// The HIP stays at its place over the terrain for any motion of the tip. `tip_mm` is the tip's
    /// position when the clutch opened, from its home pose: device millimetres east, north and up,
    /// which are the same in every placement.
    Open { hip: GridPoint, tip_mm: Vec3 },
    /// The force ramps up.
    Closing,
}

/// Difference of the force before a change of placement under the hand and after it. It decreases
/// to zero, and with the force itself: a hand that leaves the surface feels nothing of it.
#[derive(Clone, Copy, Debug, Default)]
struct ForceTurn {
    /// The force before, until the first tick after the change.
    from_n: Option<Vec3>,
    /// Ticks in which the force stays, because the proxy still finds its place on the new surface.
    begins: u8,
    /// Maximum of the forces before and after the change, N.
    max_n: f32,
    rest_n: Vec3,
    /// Maximum ratio of the difference to the force.
    max_ratio: f32,
    /// Decrease in a tick, N, and at least that of a closing clutch; `None` for that one.
    step_n: Option<f32>,
}

impl ForceTurn {
    /// Returns true if the force is that of the placement alone.
    fn is_over(&self) -> bool {
        self.from_n.is_none() && self.rest_n == Vec3::ZERO
    }

    /// Returns the difference to add to the force of this tick. While the tile under the proxy is
    /// late, the surface stays, and the part of the difference along the force stays, too.
    fn advance(&mut self, target_n: Vec3, ramp_step: f32, has_tile: bool) -> Vec3 {
        if let Some(from_n) = self.from_n {
            self.begins = self.begins.saturating_sub(1);
            if self.begins == 0 {
                self.from_n = None;
            }
            self.rest_n = from_n - target_n;
            self.max_n = larger(from_n.length(), target_n.length());
            let rest = self.rest_n.length();
            let ratio = rest / target_n.length();
            // Not for NaN, and not without a force.
            if ratio > 1.0 && ratio < MAX_TURN_RATIO {
                self.max_ratio = ratio;
            }
            if self.begins == 0 {
                // Also on a soft surface, no slower than a closing clutch.
                let slowest_n = rest * ramp_step;
                self.step_n = Some(larger(self.step_n.unwrap_or(slowest_n), slowest_n));
            }
        } else {
            // A late tile holds the part of the rest that stands for the height of the fallback,
            // and never one that pushes the hand sideways.
            let held_n = match has_tile {
                true => Vec3::ZERO,
                false => (self.rest_n).project_onto_normalized(target_n.normalize_or_zero()),
            };
            let step_n = self.step_n.unwrap_or(f32::INFINITY);
            let turning_n = self.rest_n - held_n;
            let turning = turning_n.length();
            self.rest_n = match turning > step_n {
                true => held_n + turning_n * ((turning - step_n) / turning),
                false => held_n,
            };
        }
        self.rest_n = clamp_length(self.rest_n, self.max_ratio * target_n.length());
        self.rest_n
    }
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
    /// Rest of the force of the placement before.
    turn: ForceTurn,
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
            turn: ForceTurn::default(),
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
        if let State::Closed | State::Turning | State::Closing = self.state {
            self.state = State::Opening;
            self.follows_hand = false;
        }
        self.follows_hand |= self.input || self.host == ClutchMode::WithHand;
    }

    /// Waits for a change of placement under the pressing hand. A clutch that is held, or closes,
    /// goes on.
    pub(crate) fn wait_for_change(&mut self) {
        if self.is_closed() {
            self.state = State::Turning;
        }
    }

    /// Returns true if a placement may change under the hand: the clutch is not held, and the force
    /// has turned to that of the current one.
    pub(crate) fn may_change_in_contact(&self) -> bool {
        matches!(self.state, State::Turning) && self.turn.is_over()
    }

    /// Continues with the force that the motors have, N, and turns it to that of the new placement:
    /// by `step_n` in a tick, or as slowly as the clutch closes.
    pub(crate) fn turn_from(&mut self, force_n: Vec3, step_n: Option<f32>) {
        self.state = State::Turning;
        self.turn = ForceTurn {
            from_n: Some(force_n),
            begins: SETTLING_TICKS,
            rest_n: Vec3::ZERO,
            max_n: 0.0,
            max_ratio: 1.0,
            step_n,
        };
    }

    /// Returns the force of a tick after a change of placement under the hand.
    #[cold]
    #[inline(never)]
    pub(crate) fn turned(&mut self, target_n: Vec3, has_tile: bool) -> Vec3 {
        let rest_n = self.turn.advance(target_n, self.ramp_step, has_tile);
        if self.turn.is_over() && matches!(self.state, State::Turning) {
            self.limits = Limits::empty();
        }
        if rest_n == Vec3::ZERO || !target_n.is_finite() {
            return target_n;
        }
        let max_n = larger(self.turn.max_n, target_n.length());
        clamp_length(target_n + rest_n, max_n)
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
        if !drives {
            self.turn = ForceTurn::default();
        }
        let from_home_mm = |scene: &Scene| scene.home.to(&tip) * scene.cell_mm;
        let mut hip = tip;
        match &mut self.state {
            State::Turning if self.turn.is_over() => self.state = State::Closed,
            State::Closed | State::Turning => {}
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
            State::Opening | State::Closing | State::Turning => by.union(Limits::CLUTCH_MOVES),
        }
    }
}

/// Moves the point that is at the tip in the home pose, by `shift` cells.
fn move_home(scene: &mut Scene, shift: Vec3) {
    scene.home = GridPoint::new(scene.home.cell(), scene.home.frac() + shift);
}
