//! The board's clutch input, without the bouncing of its switch.
//!
//! A switch that bounces, or a wire with a bad contact, can only open the clutch more often:
//! whatever comes through here, the clutch opens to the end before the force comes in again,
//! over half a second.

use hapterra_core::rate::TickRate;

/// The input has to read "held" for so long before it counts, ms.
const HELD_MS: u32 = 5;
/// It has to read "let go" for so long before it counts, ms: longer than switches bounce.
const LET_GO_MS: u32 = 20;

/// Follows the input, tick by tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClutchInput {
    /// As it counts.
    held: bool,
    /// Ticks in a row that read otherwise.
    otherwise: u16,
    /// Ticks after which what reads otherwise counts: to be held, to be let go.
    enough: [u16; 2],
}

impl ClutchInput {
    pub(super) const fn new(rate: TickRate) -> Self {
        Self {
            held: false,
            otherwise: 0,
            // At most 200 ticks.
            enough: [rate.ticks(HELD_MS) as u16, rate.ticks(LET_GO_MS) as u16],
        }
    }

    /// Takes what the input reads in a tick. Returns whether it is held, where that changes.
    #[inline]
    pub(super) fn tick(&mut self, reads: bool) -> Option<bool> {
        if reads == self.held {
            self.otherwise = 0;
            return None;
        }
        self.reads_otherwise()
    }

    #[cold]
    fn reads_otherwise(&mut self) -> Option<bool> {
        self.otherwise += 1;
        let [to_hold, to_let_go] = self.enough;
        let enough = if self.held { to_let_go } else { to_hold };
        if self.otherwise < enough {
            return None;
        }
        self.otherwise = 0;
        self.held = !self.held;
        Some(self.held)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// When what was read counts, by tick, at a rate.
    fn counts(khz: u32, reads: impl Fn(u32) -> bool) -> std::vec::Vec<(u32, bool)> {
        let rate = TickRate::new(1_000 * khz).expect("a rate");
        let mut input = ClutchInput::new(rate);
        let told = (1..=1_000).filter_map(|tick| input.tick(reads(tick)).map(|held| (tick, held)));
        told.collect()
    }

    #[test]
    fn held_and_let_go_count_when_they_have_lasted() {
        let reads = |tick| (101..=200).contains(&tick);
        assert_eq!(counts(1, reads), [(105, true), (220, false)]);
        assert_eq!(counts(4, reads), [(120, true), (280, false)]);
    }

    #[test]
    fn what_bounces_counts_once_it_rests() {
        // Closed for 4 ms and open for 1 ms, until it stays closed.
        let closing = |tick| tick % 5 != 0 || tick > 300;
        assert_eq!(counts(1, closing), [(305, true)]);
        // Open for 19 ms and closed for 1 ms, until it stays open.
        let opening = |tick| tick <= 100 || (tick <= 500 && tick % 20 == 0);
        assert_eq!(counts(1, opening), [(5, true), (520, false)]);
    }
}
