//! The board's clutch input, debounced.
//!
//! A bouncing switch, or a wire with a bad contact, can only open the clutch more often: the clutch
//! always opens completely before the force ramps up again, over half a second.

use hapterra_core::rate::TickRate;

/// Time for which the input has to read "held" before it counts, ms.
const PRESS_DEBOUNCE_MS: u32 = 5;
/// Time for which the input has to read "released" before it counts, ms: longer than switches
/// bounce.
const RELEASE_DEBOUNCE_MS: u32 = 20;

/// The debounced input, updated in each tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClutchInput {
    /// The debounced state.
    held: bool,
    /// Ticks in a row with the other reading.
    changed_ticks: u16,
    /// Ticks after which another reading counts: for held, for released.
    debounce_ticks: [u16; 2],
}

impl ClutchInput {
    pub(super) const fn new(rate: TickRate) -> Self {
        Self {
            held: false,
            changed_ticks: 0,
            // At most 200 ticks.
            debounce_ticks: [
                rate.ticks(PRESS_DEBOUNCE_MS) as u16,
                rate.ticks(RELEASE_DEBOUNCE_MS) as u16,
            ],
        }
    }

    /// Updates with the reading of a tick. Returns the new state if it changes.
    #[inline]
    pub(super) fn tick(&mut self, reads: bool) -> Option<bool> {
        if reads == self.held {
            self.changed_ticks = 0;
            return None;
        }
        self.count_change()
    }

    #[cold]
    fn count_change(&mut self) -> Option<bool> {
        self.changed_ticks += 1;
        let [to_hold, to_release] = self.debounce_ticks;
        let debounce_ticks = if self.held { to_release } else { to_hold };
        if self.changed_ticks < debounce_ticks {
            return None;
        }
        self.changed_ticks = 0;
        self.held = !self.held;
        Some(self.held)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the ticks in which the debounced state changes, with the new state.
    fn counts(khz: u32, reads: impl Fn(u32) -> bool) -> std::vec::Vec<(u32, bool)> {
        let rate = TickRate::new(1_000 * khz).expect("a rate");
        let mut input = ClutchInput::new(rate);
        let reported =
            (1..=1_000).filter_map(|tick| input.tick(reads(tick)).map(|held| (tick, held)));
        reported.collect()
    }

    #[test]
    fn clutch_input_changes_count_after_debounce_time() {
        let reads = |tick| (101..=200).contains(&tick);
        assert_eq!(counts(1, reads), [(105, true), (220, false)]);
        assert_eq!(counts(4, reads), [(120, true), (280, false)]);
    }

    #[test]
    fn bouncing_clutch_input_counts_once_it_is_stable() {
        // Closed for 4 ms and open for 1 ms, until it stays closed.
        let closing = |tick| tick % 5 != 0 || tick > 300;
        assert_eq!(counts(1, closing), [(305, true)]);
        // Open for 19 ms and closed for 1 ms, until it stays open.
        let opening = |tick| tick <= 100 || (tick <= 500 && tick % 20 == 0);
        assert_eq!(counts(1, opening), [(5, true), (520, false)]);
    }
}
