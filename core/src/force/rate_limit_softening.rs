//! Rate-limit softening: less stiffness for a fast tip, to keep the force within the guard's rate
//! limit.
//!
//! The guard limits the change of a force to [`MAX_SLEW_N_PER_S`]. A spring that is touched faster
//! would exceed it: its force rises late and falls late, and the tip receives more energy than it
//! supplied. Damping cannot dissipate that, since the same limit delays the damping force. A spring
//! that is softer from contact onset on stays within the limit, and returns no more energy than it
//! received.

use super::Spring;
use super::depth::Depth;
use crate::rate::MAX_SLEW_N_PER_S;
use crate::scalar::smaller;

/// The spring's share of the rate limit; the rest is for damping.
const SPRING_PART: f32 = 0.5;
/// Speed below which a tip rests, mm/s. After the time `REST_TIME_S`, in s, the surface starts to
/// return to its full stiffness.
const REST_SPEED_MM_S: f32 = 10.0;
const REST_TIME_S: f32 = 0.3;
/// Energy that the spring gains per second during that, mJ/s. The observer records it, and the
/// controller dissipates it.
const RECOVERY_MJ_PER_S: f32 = 5.0;

/// The rendered share of the stiffness.
#[derive(Clone, Copy, Debug)]
pub(super) struct RateLimitSoftening {
    share: f32,
    /// Time since the tip came to rest, s.
    rest_s: f32,
}

impl RateLimitSoftening {
    /// Full stiffness.
    pub(super) const NONE: Self = Self {
        share: 1.0,
        rest_s: 0.0,
    };

    /// Returns the share, above 0 and at most 1.
    pub(super) const fn share(&self) -> f32 {
        self.share
    }

    /// Updates the share with the depth of a tick of `tick_s` in a spring after the guard's ramp:
    /// softens if the tip is too fast for the full stiffness, and recovers at once in the air,
    /// slowly under a resting tip.
    pub(super) fn observe(&mut self, spring: &Spring, depth: &Depth, tick_s: f32) {
        if depth.mm <= 0.0 {
            return *self = Self::NONE;
        }
        let speed_mm_s = depth.exit_speed_mm_s.abs();
        if speed_mm_s >= REST_SPEED_MM_S {
            self.rest_s = 0.0;
        } else if self.rest_s < REST_TIME_S {
            self.rest_s += tick_s;
        }
        if self.share < 1.0 && self.rest_s >= REST_TIME_S {
            let recovered = RECOVERY_MJ_PER_S * tick_s / spring.stored_mj(depth.mm);
            self.share = smaller(self.share + recovered, 1.0);
        }
        // Infinite at rest.
        let max_share = SPRING_PART * MAX_SLEW_N_PER_S / (spring.stiffness_n_per_mm * speed_mm_s);
        self.share = smaller(max_share, self.share);
    }
}
