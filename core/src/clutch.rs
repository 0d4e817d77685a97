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
//! While it opens and closes the contact goes on as ever, and a share of its force is let
//! through: from all to nothing in 0.1 s, from nothing to all in 0.5 s. The rest of the path,
//! the guard and all its bounds, is as it always is.
//!
//! It opens to the end before it closes again, however often it is held and let go. A spring that
//! gets softer takes energy from the hand and one that gets harder gives some, so one turn gives the
//! hand at most what the spring held: ½ F² / K, 72 mJ at 8.5 N and 0.5 N/mm, and 0.5 s pass until it may
//! be given again.

use crate::contact::Contact;
use crate::grid::GridPoint;
use crate::guard::{FADE_MS, Limits};
use crate::rate::TickRate;
use crate::terrain::Window;

/// How long all of it takes to come in again, ms.
const IN_MS: u32 = 500;

#[derive(Clone, Copy, Debug)]
enum State {
    /// The terrain is where it is.
    Closed,
    /// The force goes out.
    Opening,
    /// The HIP stays at its place over the terrain, wherever the tip goes.
    Open { hip: GridPoint },
    /// The force comes in again.
    Closing,
}

/// The clutch of an arm's scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clutch {
    state: State,
    held: bool,
    /// Share of the force that is let through to a driven arm.
    share: f32,
    /// Share that was let through in the last tick.
    felt: f32,
    /// What it says of the last tick.
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
            held: false,
            share: 1.0,
            felt: 1.0,
            limits: Limits::empty(),
            out: 1.0 / rate.ticks(FADE_MS) as f32,
            back: 1.0 / rate.ticks(IN_MS) as f32,
        }
    }

    /// Whether it takes no part in a tick.
    #[inline]
    pub(crate) const fn is_closed(&self) -> bool {
        matches!(self.state, State::Closed)
    }

    /// Whether there is no force, and the HIP stays where it is over the terrain.
    pub(crate) const fn is_open(&self) -> bool {
        matches!(self.state, State::Open { .. })
    }

    /// It is held from now on, or no longer.
    pub(crate) fn hold(&mut self, held: bool) {
        self.held = held;
        if held && !self.is_open() {
            self.state = State::Opening;
        }
    }

    /// Puts the HIP of an open clutch somewhere else.
    pub(crate) fn put(&mut self, there: GridPoint) {
        if let State::Open { hip } = &mut self.state {
            *hip = there;
        }
    }

    /// How it limits the tick: not at all where it is closed.
    #[inline]
    pub(crate) const fn limits(&self) -> Limits {
        self.limits
    }

    /// Share of the force that it lets through: all where it is closed.
    #[inline]
    pub(crate) const fn share(&self) -> f32 {
        self.felt
    }

    /// One tick of a clutch that is not closed, with the tip at a place over the terrain.
    /// Returns where the HIP is. When it closes it moves `home`, so that the HIP is where
    /// it was.
    ///
    /// An arm that is not driven has all of the force in its share: nothing is armed by
    /// holding the clutch in the ground.
    #[cold]
    #[inline(never)]
    pub(crate) fn tick<const D: usize>(
        &mut self,
        tip: GridPoint,
        home: &mut GridPoint,
        (contact, window): (&mut Contact, &Window<'_, D>),
        drives: bool,
    ) -> GridPoint {
        let mut hip = tip;
        match &mut self.state {
            State::Closed => {}
            State::Opening => {
                self.share -= self.out;
                if self.share <= 0.0 {
                    self.share = 0.0;
                    self.state = State::Open { hip };
                }
            }
            State::Open { hip: there } => {
                if let Some(landed) = contact.land(window) {
                    *there = landed;
                }
                hip = *there;
                if !self.held && !contact.is_landing() {
                    *home = GridPoint::new(home.cell(), home.frac() + tip.to(&hip));
                    self.state = State::Closing;
                }
            }
            State::Closing => {
                self.share += self.back;
                if self.share >= 1.0 {
                    self.share = 1.0;
                    self.state = State::Closed;
                }
            }
        }
        self.felt = if drives { self.share } else { 1.0 };
        self.limits = match self.state {
            State::Closed => Limits::empty(),
            State::Open { .. } => Limits::CLUTCH_OPEN,
            State::Opening | State::Closing => Limits::CLUTCH_MOVES,
        };
        hip
    }
}
