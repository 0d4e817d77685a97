//! The tick's check that the watchdog is being fed.
//!
//! The watchdog resets a board whose tasks hang. The tick detects earlier that the watchdog is not
//! being fed, and switches off first.

use hapterra_core::rate::TickRate;

/// Maximum time between two feedings, ms: less than 42 ms, the minimum time after which a board's
/// watchdog resets it.
pub(super) const STALL_MS: u32 = 40;

/// The count of feedings, checked in each tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct Liveness {
    limit: u32,
    fed: u32,
    /// Ticks since the last increase of the count; `None` before the first.
    since: Option<u32>,
}

impl Liveness {
    pub(super) fn new(rate: TickRate) -> Self {
        Self {
            limit: rate.ticks(STALL_MS),
            fed: 0,
            since: None,
        }
    }

    /// Updates with the count of feedings in this tick and returns true if the watchdog is being
    /// fed.
    pub(super) fn tick(&mut self, fed: u32) -> bool {
        if fed != self.fed {
            self.fed = fed;
            self.since = Some(0);
        } else {
            self.since = self.since.map(|since| since.saturating_add(1));
        }
        self.since.is_some_and(|since| since <= self.limit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn liveness_starts_at_first_feeding_and_ends_after_40_ms() {
        let mut liveness = Liveness::new(TickRate::DEFAULT);
        assert!((0..100).all(|_| !liveness.tick(0)), "never fed");
        assert!(liveness.tick(1));
        let lived = (0..1000).take_while(|_| liveness.tick(1)).count();
        assert_eq!(lived, 40);
        assert!(liveness.tick(2), "fed again");
    }
}
