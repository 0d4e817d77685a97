//! Feeds the watchdog only while every part of the application lives.

use crate::board::Watchdog;
use crate::vitals::{Part, Vitals};

/// Watches the signs of life on behalf of a watchdog.
pub struct Supervisor<'t, W> {
    vitals: &'t Vitals,
    watchdog: W,
    parts: &'static [Part],
}

/// No watchdog: for a device whose host watches it.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoWatchdog;

impl Watchdog for NoWatchdog {
    fn feed(&mut self) {}
}

impl<'t, W: Watchdog> Supervisor<'t, W> {
    /// Watches `parts` by their `vitals` for `watchdog`. To name a part that
    /// never checks in is to be reset; not to name one is not to watch it.
    pub const fn new(vitals: &'t Vitals, watchdog: W, parts: &'static [Part]) -> Self {
        Self {
            vitals,
            watchdog,
            parts,
        }
    }

    /// Feeds the watchdog if every part has checked in since it was last fed.
    /// To be called a few times in the watchdog's time. True if it was fed.
    pub fn check(&mut self) -> bool {
        let alive = self.vitals.all_checked_in(self.parts);
        if alive {
            self.watchdog.feed();
            self.vitals.count_feed();
        }
        alive
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

    const PARTS: [Part; 3] = [Part::Tick, Part::Link, Part::Usb];

    #[test]
    fn every_part_but_one_does_not_feed_the_watchdog() {
        for hung in PARTS {
            let vitals = Vitals::new();
            let mut supervisor = Supervisor::new(&vitals, Fed::default(), &PARTS);
            for _ in 0..3 {
                for part in PARTS.into_iter().filter(|part| *part != hung) {
                    vitals.check_in(part);
                }
                assert!(!supervisor.check(), "{hung:?}");
            }
            vitals.check_in(hung);
            assert!(supervisor.check(), "{hung:?} came back");
            assert_eq!((supervisor.watchdog.0, vitals.fed()), (1, 1));
            vitals.check_in(hung);
            assert!(!supervisor.check(), "all have to check in again");
        }
    }

    #[test]
    fn what_is_not_watched_does_not_matter() {
        let vitals = Vitals::new();
        let mut supervisor = Supervisor::new(&vitals, Fed::default(), &PARTS[..2]);
        vitals.check_in(Part::Tick);
        vitals.check_in(Part::Plant);
        assert!(!supervisor.check());
        vitals.check_in(Part::Link);
        assert!(supervisor.check());
    }
}
