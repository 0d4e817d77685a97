//! The tick rate, and constants that depend on it.

/// Maximum change of the force, newtons a second. A hand at 2 m/s against 0.5 N/mm makes 1 N/ms; no
/// hand is faster.
pub const MAX_SLEW_N_PER_S: f32 = 1_000.0;

/// Ticks a second: a build option, 1 kHz by default. A higher rate permits a higher stiffness.
///
/// Whole kilohertz, so that a millisecond is a whole number of ticks: durations in milliseconds are
/// exact at every rate.
///
/// ```
/// use hapterra_core::rate::TickRate;
///
/// let fast = TickRate::new(4_000).expect("in range");
/// assert_eq!(fast.ticks(250), 1_000); // in 250 ms
/// assert_eq!(TickRate::new(1_500), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TickRate(u32);

impl TickRate {
    /// Minimum and maximum tick rate, Hz.
    pub const RANGE_HZ: (u32, u32) = (1_000, 10_000);
    /// 1 kHz.
    pub const DEFAULT: Self = Self(1_000);

    /// Creates a rate in [`Self::RANGE_HZ`], in whole kilohertz; returns `None` for any other.
    #[must_use]
    pub const fn new(hz: u32) -> Option<Self> {
        if hz < Self::RANGE_HZ.0 || hz > Self::RANGE_HZ.1 || !hz.is_multiple_of(1_000) {
            return None;
        }
        Some(Self(hz))
    }

    /// Returns the ticks a second.
    #[must_use]
    pub const fn hz(self) -> u32 {
        self.0
    }

    /// Returns the length of a tick, s.
    #[must_use]
    pub const fn tick_s(self) -> f32 {
        1.0 / self.0 as f32
    }

    /// Returns the number of ticks in a time, at least one.
    #[must_use]
    pub const fn ticks(self, milliseconds: u32) -> u32 {
        let ticks = (self.0 / 1000).saturating_mul(milliseconds);
        if ticks == 0 { 1 } else { ticks }
    }
}

impl Default for TickRate {
    fn default() -> Self {
        Self::DEFAULT
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_supported_tick_rates_are_accepted() {
        assert_eq!(TickRate::new(999), None);
        assert_eq!(TickRate::new(10_001), None);
        assert_eq!(TickRate::new(1_500), None);
        let fast = TickRate::new(8_000).expect("in range");
        assert_eq!((fast.ticks(1), fast.ticks(2_000)), (8, 16_000));
        assert_eq!(TickRate::DEFAULT.ticks(0), 1);
        assert_eq!(TickRate::DEFAULT.tick_s(), 1e-3);
    }
}
