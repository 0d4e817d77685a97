//! A surface that yields to a fast tip, so that its force changes no faster than the guard lets
//! it.
//!
//! The guard lets a force change by [`MAX_SLEW_N_PER_S`]. A spring that is touched faster asks
//! for more: its force comes late and goes late, and the tip gets back more than it gave. No
//! damping takes that back, since a damping force is held up by the same limit. A spring that is
//! rendered as softer from the first touch on asks for no more than the guard allows, and gives
//! back what it got.

use super::Spring;
use super::depth::Depth;
use crate::rate::MAX_SLEW_N_PER_S;
use crate::scalar::smaller;

/// The spring's part of what the force may change by; the rest is for damping.
const SPRING_PART: f32 = 0.5;
/// A tip that is slower rests, mm/s. After so long, in s, the surface begins to become as stiff
/// again as its surface parameters state.
const RESTS_MM_S: f32 = 10.0;
const RESTED_S: f32 = 0.3;
/// By how much the energy of the spring grows meanwhile, mJ/s. The observer books it, and the
/// controller takes it back.
const RECOVERS_MJ_PER_S: f32 = 5.0;

/// The share of the stiffness that is rendered.
#[derive(Clone, Copy, Debug)]
pub(super) struct RateLimitSoftening {
    share: f32,
    /// Time for which the tip has rested, s.
    rested_s: f32,
}

impl RateLimitSoftening {
    /// The whole stiffness.
    pub(super) const NONE: Self = Self {
        share: 1.0,
        rested_s: 0.0,
    };

    /// Above 0, and at most 1.
    pub(super) const fn share(&self) -> f32 {
        self.share
    }

    /// Takes the depth of a tick of `tick_s` in a spring after the guard's ramp: softens where the
    /// tip moves too fast for all of its stiffness, and recovers at once in the air, slowly under
    /// a tip that rests.
    pub(super) fn observe(&mut self, spring: &Spring, depth: &Depth, tick_s: f32) {
        if depth.mm <= 0.0 {
            return *self = Self::NONE;
        }
        let speed_mm_s = depth.leaves_mm_s.abs();
        if speed_mm_s >= RESTS_MM_S {
            self.rested_s = 0.0;
        } else if self.rested_s < RESTED_S {
            self.rested_s += tick_s;
        }
        if self.share < 1.0 && self.rested_s >= RESTED_S {
            let recovered = RECOVERS_MJ_PER_S * tick_s / spring.stored_mj(depth.mm);
            self.share = smaller(self.share + recovered, 1.0);
        }
        // Without end where nothing moves.
        let most = SPRING_PART * MAX_SLEW_N_PER_S / (spring.stiffness_n_per_mm * speed_mm_s);
        self.share = smaller(most, self.share);
    }
}
