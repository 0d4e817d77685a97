//! Feeds the watchdog only while both halves of the application live.

use core::sync::atomic::Ordering;

use crate::board::Watchdog;
use crate::channels::Vitals;

/// Watches the signs of life on behalf of a watchdog.
pub struct Supervisor<'t, W> {
    vitals: &'t Vitals,
    watchdog: W,
    seen: (u32, u32),
}

impl<'t, W: Watchdog> Supervisor<'t, W> {
    /// Watches `vitals` for `watchdog`.
    pub const fn new(vitals: &'t Vitals, watchdog: W) -> Self {
        Self {
            vitals,
            watchdog,
            seen: (0, 0),
        }
    }

    /// Feeds the watchdog if the loop has ticked and the link has turned since
    /// it was last fed. To be called a few times in the watchdog's time.
    pub fn check(&mut self) {
        let ticks = self.vitals.ticks.load(Ordering::Relaxed);
        let turns = self.vitals.turns.load(Ordering::Relaxed);
        if ticks != self.seen.0 && turns != self.seen.1 {
            self.seen = (ticks, turns);
            self.watchdog.feed();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Default)]
    struct Fed(u32);

    impl Watchdog for Fed {
        fn feed(&mut self) {
            self.0 += 1;
        }
    }

    #[test]
    fn one_half_alone_does_not_feed_the_watchdog() {
        let vitals = Vitals::default();
        let mut supervisor = Supervisor::new(&vitals, Fed::default());
        for _ in 0..3 {
            vitals.ticks.fetch_add(1, Ordering::Relaxed);
            supervisor.check();
        }
        assert_eq!(supervisor.watchdog.0, 0);
        vitals.turns.fetch_add(1, Ordering::Relaxed);
        supervisor.check();
        assert_eq!(supervisor.watchdog.0, 1);
        vitals.turns.fetch_add(1, Ordering::Relaxed);
        supervisor.check();
        assert_eq!(supervisor.watchdog.0, 1);
    }
}
