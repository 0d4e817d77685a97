//! Outputs held at given values with the amplifiers off, so that a user with a meter
//! can see what a board puts out before anything can move.

use glam::Vec3;

use super::{Guard, Mode};
use crate::rate::TickRate;

/// Longest time for which outputs are held, s.
pub const HOLD_S: u32 = 60;

/// Held outputs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hold {
    ticks_a_second: u32,
    /// Shares of full scale, -1 to 1.
    shares: Vec3,
    /// Ticks that are left of it.
    left: u32,
}

impl Hold {
    pub(super) const fn new(rate: TickRate) -> Self {
        Self {
            ticks_a_second: rate.hz(),
            shares: Vec3::ZERO,
            left: 0,
        }
    }

    /// Nothing is held any more.
    pub(super) const fn end(&mut self) {
        self.shares = Vec3::ZERO;
        self.left = 0;
    }

    /// A tick passes.
    pub(super) fn pass(&mut self) {
        self.left = self.left.saturating_sub(1);
        if self.left == 0 {
            self.end();
        }
    }
}

impl Guard {
    /// Holds the outputs at shares of full scale, each cut to -1..=1, or no longer. Only
    /// while disarmed and without a fault: the enable line stays low, so no current flows.
    /// It ends after [`HOLD_S`] and with whatever arms, disarms, faults or changes
    /// settings. A share that is not a number holds zero.
    pub fn hold(&mut self, shares: Option<[f32; 3]>) {
        self.hold.end();
        let Some(shares) = shares.map(Vec3::from).filter(|shares| !shares.is_nan()) else {
            return;
        };
        if self.mode() == Mode::Disarmed && self.fault.is_none() {
            self.hold.shares = shares.clamp(Vec3::NEG_ONE, Vec3::ONE);
            self.hold.left = HOLD_S * self.hold.ticks_a_second;
        }
    }

    /// Shares of full scale that the outputs are held at, zero unless they are.
    #[must_use]
    pub const fn held(&self) -> Vec3 {
        self.hold.shares
    }
}
