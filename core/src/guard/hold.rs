//! Outputs held at given values with the amplifiers off, so that a user can measure a board's
//! outputs before anything can move.

use glam::Vec3;

use super::{Guard, Mode};
use crate::rate::TickRate;

/// Maximum time for which outputs are held, s.
pub const MAX_HOLD_S: u32 = 60;

/// Held outputs.
#[derive(Clone, Copy, Debug)]
pub(super) struct OutputHold {
    ticks_a_second: u32,
    /// Shares of full scale, -1 to 1.
    shares: Vec3,
    /// Ticks that are left.
    left: u32,
}

impl OutputHold {
    pub(super) const fn new(rate: TickRate) -> Self {
        Self {
            ticks_a_second: rate.hz(),
            shares: Vec3::ZERO,
            left: 0,
        }
    }

    /// Ends the hold.
    pub(super) const fn end(&mut self) {
        self.shares = Vec3::ZERO;
        self.left = 0;
    }

    /// Counts a tick.
    pub(super) fn count_tick(&mut self) {
        self.left = self.left.saturating_sub(1);
        if self.left == 0 {
            self.end();
        }
    }
}

impl Guard {
    /// Holds the outputs at shares of full scale, each clamped to -1..=1, or ends the hold. Works
    /// only while disarmed and without a fault: the enable line stays low, so no current flows. The
    /// hold ends after [`MAX_HOLD_S`], and when the guard arms, disarms, faults or changes its
    /// settings. A share that is not a number holds zero.
    pub fn hold(&mut self, shares: Option<[f32; 3]>) {
        self.hold.end();
        let Some(shares) = shares.map(Vec3::from).filter(|shares| !shares.is_nan()) else {
            return;
        };
        if self.mode() == Mode::Disarmed && self.fault.is_none() {
            self.hold.shares = shares.clamp(Vec3::NEG_ONE, Vec3::ONE);
            self.hold.left = MAX_HOLD_S * self.hold.ticks_a_second;
        }
    }

    /// Returns the shares of full scale at which the outputs are held, or zero.
    #[must_use]
    pub const fn held_shares(&self) -> Vec3 {
        self.hold.shares
    }
}
