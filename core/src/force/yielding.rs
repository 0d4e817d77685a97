//! A surface that yields to a fast tip, so that its force changes no faster than the guard lets
//! it.
//!
//! The guard lets a force change by [`MAX_SLEW_N_PER_S`]. A spring that is touched faster asks
//! for more: its force comes late and goes late, and the tip gets back more than it gave. No
//! damping takes that back, since a damping force is held up by the same limit. A spring that is
//! felt as softer from the first touch on asks for no more than the guard allows, and gives
//! back what it got.

use super::{ForceLaw, Moment};
use crate::guard::MAX_SLEW_N_PER_S;

/// The spring's part of what the force may change by; the rest is for damping.
const SPRING_PART: f32 = 0.5;
/// A tip that is slower rests, mm/s. After so long, in s, the surface begins to become as stiff
/// again as its law says.
const RESTS_MM_S: f32 = 10.0;
const RESTED_S: f32 = 0.3;
/// By how much the energy of the spring grows meanwhile, mJ/s. The observer books it, and the
/// controller takes it back.
const RECOVERS_MJ_PER_S: f32 = 5.0;

/// The share of the stiffness that is felt.
#[derive(Clone, Copy, Debug)]
pub(super) struct Yielding {
    share: f32,
    /// How long the tip has rested, s.
    rested_s: f32,
}

impl Yielding {
    /// The whole stiffness.
    pub(super) const NONE: Self = Self {
        share: 1.0,
        rested_s: 0.0,
    };

    /// Above 0, and at most 1.
    pub(super) const fn share(&self) -> f32 {
        self.share
    }

    /// Takes a moment of a tick of `tick_s`: yields to a motion that is too fast for the whole
    /// stiffness, and recovers in the air at once, and under a tip that
    /// rests slowly.
    pub(super) fn observe(&mut self, law: &ForceLaw, now: &Moment, tick_s: f32) {
        let depth_mm = now.displacement_mm.length();
        if depth_mm <= 0.0 {
            return *self = Self::NONE;
        }
        let speed_mm_s = now.velocity_mm_s.dot(now.displacement_mm).abs() / depth_mm;
        let changes_n_per_s = law.stiffness_n_per_mm * speed_mm_s;
        let most = SPRING_PART * MAX_SLEW_N_PER_S / changes_n_per_s;
        self.rested_s = match speed_mm_s < RESTS_MM_S {
            true => (self.rested_s + tick_s).min(RESTED_S),
            false => 0.0,
        };
        let recovered = match self.rested_s < RESTED_S {
            true => 0.0,
            false => RECOVERS_MJ_PER_S * tick_s / law.stored_mj(now.displacement_mm, now.most_n),
        };
        // No number, or one without end, where nothing moves or nothing is held.
        self.share = (self.share + recovered).min(most).min(1.0);
    }
}
