//! Settings of a contact, constant while it lasts.

use super::budget::{WORK_PER_TICK, work_per_tick};
use super::friction::Friction;
use crate::rate::TickRate;

/// Settings of a contact, constant while it lasts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSettings {
    /// Tick rate: fades have limits per second.
    pub rate: TickRate,
    /// Work units that a tick may spend: [`work_per_tick`] of the rate, or at least
    /// [`Self::MIN_WORK`].
    pub work_per_tick: u32,
    /// Speed, in cells a second, below which a sliding proxy comes to rest:
    /// [`Self::STICK_SPEED_MM_S`].
    pub stick_speed: f32,
    /// Friction of the surface.
    pub friction: Friction,
    /// True if the fast paths are used: still free, and sliding within a patch. Without them every
    /// result has the same bits.
    pub fast_paths: bool,
}

impl ContactSettings {
    /// Minimum work units: fewer might not be enough for one short piece of a path.
    pub const MIN_WORK: u32 = 86;

    /// Speed below which a sliding proxy comes to rest, mm/s: slower than an intended motion of the
    /// hand.
    pub const STICK_SPEED_MM_S: f32 = 1.0;

    /// Settings for 1 kHz and cells of a millimetre.
    pub const AT_1_KHZ: Self = Self {
        rate: TickRate::DEFAULT,
        work_per_tick: WORK_PER_TICK,
        stick_speed: Self::STICK_SPEED_MM_S,
        friction: Friction::NONE,
        fast_paths: true,
    };

    /// Returns the same settings on a rough surface.
    #[must_use]
    pub const fn with_friction(self, friction: Friction) -> Self {
        Self { friction, ..self }
    }

    /// Returns the same settings at another rate.
    #[must_use]
    pub const fn at_rate(self, rate: TickRate) -> Self {
        Self {
            rate,
            work_per_tick: work_per_tick(rate),
            ..self
        }
    }

    /// Returns the same settings on cells of another size, device millimetres.
    #[must_use]
    pub const fn on_cells_of(self, cell_mm: f32) -> Self {
        Self {
            stick_speed: Self::STICK_SPEED_MM_S / cell_mm,
            ..self
        }
    }
}

impl Default for ContactSettings {
    fn default() -> Self {
        Self::AT_1_KHZ
    }
}
