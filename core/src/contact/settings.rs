//! Settings of a contact, constant while it lasts.

use super::budget::{WORK_PER_TICK, work_per_tick};
use super::friction::Friction;
use crate::rate::TickRate;

/// Settings of a contact, constant while it lasts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSettings {
    /// Ticks a second: fades are bounded in time.
    pub rate: TickRate,
    /// Units of work a tick may spend: [`work_per_tick`] of the rate, or at least
    /// [`Self::LEAST_WORK`].
    pub work_per_tick: u32,
    /// Slower than this, in cells a second, a proxy that slides comes to rest:
    /// [`Self::STICKS_BELOW_MM_S`].
    pub sticks_below: f32,
    /// Friction of the surface.
    pub friction: Friction,
    /// True if the fast paths are taken: free as before, and sliding within a patch.
    /// Without them every answer has the same bits.
    pub fast_paths: bool,
}

impl ContactSettings {
    /// Fewer units of work might not be enough for one short piece of a path.
    pub const LEAST_WORK: u32 = 86;

    /// Slower than this a proxy that slides comes to rest, mm/s: less than a hand that means
    /// to move.
    pub const STICKS_BELOW_MM_S: f32 = 1.0;

    /// At 1 kHz, over cells of a millimetre.
    pub const AT_1_KHZ: Self = Self {
        rate: TickRate::DEFAULT,
        work_per_tick: WORK_PER_TICK,
        sticks_below: Self::STICKS_BELOW_MM_S,
        friction: Friction::NONE,
        fast_paths: true,
    };

    /// The same on a rough surface.
    #[must_use]
    pub const fn with_friction(self, friction: Friction) -> Self {
        Self { friction, ..self }
    }

    /// The same at another rate.
    #[must_use]
    pub const fn at_rate(self, rate: TickRate) -> Self {
        Self {
            rate,
            work_per_tick: work_per_tick(rate),
            ..self
        }
    }

    /// The same over cells of another size, device millimetres.
    #[must_use]
    pub const fn on_cells_of(self, cell_mm: f32) -> Self {
        Self {
            sticks_below: Self::STICKS_BELOW_MM_S / cell_mm,
            ..self
        }
    }
}

impl Default for ContactSettings {
    fn default() -> Self {
        Self::AT_1_KHZ
    }
}
