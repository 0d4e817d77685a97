//! Check-ins and counters of the application's parts. They decide if the watchdog is fed; the tick
//! and the status message also read them.

use core::sync::atomic::{AtomicU8, AtomicU32, Ordering::Relaxed};

use hapterra_core::wire::status::UsbClock;

/// A part of the application that has to check in before the watchdog is fed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WatchedPart {
    /// The haptic tick.
    Tick = 0,
    /// The link's task.
    Link = 1,
    /// The USB stack's task.
    Usb = 2,
}

impl WatchedPart {
    const fn bit(self) -> u32 {
        1 << self as u32
    }
}

/// Check-ins and counters, shared by all parts: single loads and stores, no lock.
#[derive(Debug, Default)]
pub struct Monitor {
    ticks: AtomicU32,
    dropped: AtomicU32,
    checked_in: AtomicU32,
    fed: AtomicU32,
    stack_size: AtomicU32,
    stack_high_water: AtomicU32,
    usb_clock: AtomicU8,
}

impl Monitor {
    /// Creates a monitor without check-ins.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            ticks: AtomicU32::new(0),
            dropped: AtomicU32::new(0),
            checked_in: AtomicU32::new(0),
            fed: AtomicU32::new(0),
            stack_size: AtomicU32::new(0),
            stack_high_water: AtomicU32::new(0),
            usb_clock: AtomicU8::new(UsbClock::Unknown as u8),
        }
    }

    /// Records that a part runs. Each watched part calls this at least every few milliseconds, from
    /// any priority.
    pub fn check_in(&self, part: WatchedPart) {
        self.checked_in.fetch_or(part.bit(), Relaxed);
    }

    /// Returns true if the watchdog is to be fed now: all of `parts` have checked in since this
    /// last returned true. Called a few times within the watchdog's time.
    ///
    /// A part in `parts` that does not check in leads to a reset; other parts are not watched. The
    /// tick checks by the count of feedings that the watchdog is being fed.
    #[must_use]
    pub fn may_feed_watchdog(&self, parts: &[WatchedPart]) -> bool {
        let all = parts.iter().fold(0, |bits, part| bits | part.bit());
        if self.checked_in.load(Relaxed) & all != all {
            return false;
        }
        self.checked_in.fetch_and(!all, Relaxed);
        self.fed.fetch_add(1, Relaxed);
        true
    }

    pub(crate) fn count_tick(&self) {
        self.ticks.fetch_add(1, Relaxed);
    }

    /// Returns the ticks since the start, wrapping.
    #[must_use]
    pub fn ticks(&self) -> u32 {
        self.ticks.load(Relaxed)
    }

    /// Counts a sample that was dropped because the record queue was full.
    pub(crate) fn count_dropped(&self) {
        self.dropped.fetch_add(1, Relaxed);
    }

    pub(crate) fn dropped(&self) -> u32 {
        self.dropped.load(Relaxed)
    }

    /// Returns the count of the watchdog's feedings, wrapping.
    pub(crate) fn fed(&self) -> u32 {
        self.fed.load(Relaxed)
    }

    /// Sets the size and the high-water mark of the board's stack, bytes.
    pub fn measure_stack(&self, (size, high_water): (u32, u32)) {
        self.stack_size.store(size, Relaxed);
        self.stack_high_water.store(high_water, Relaxed);
    }

    /// Sets the state of USB's oscillator in the last second.
    pub fn measure_usb_clock(&self, clock: UsbClock) {
        self.usb_clock.store(clock as u8, Relaxed);
    }

    /// Returns the last measured state of USB's oscillator.
    #[must_use]
    pub fn usb_clock(&self) -> UsbClock {
        let all = [UsbClock::Unknown, UsbClock::Locked, UsbClock::Unlocked];
        let found = all.get(usize::from(self.usb_clock.load(Relaxed)));
        found.copied().unwrap_or_default()
    }

    /// Returns the size and the high-water mark of the stack, bytes.
    #[must_use]
    pub fn stack(&self) -> (u32, u32) {
        (
            self.stack_size.load(Relaxed),
            self.stack_high_water.load(Relaxed),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARTS: [WatchedPart; 3] = [WatchedPart::Tick, WatchedPart::Link, WatchedPart::Usb];

    #[test]
    fn watchdog_is_not_fed_if_one_part_is_missing() {
        for hung in PARTS {
            let monitor = Monitor::new();
            for _ in 0..3 {
                for part in PARTS.into_iter().filter(|part| *part != hung) {
                    monitor.check_in(part);
                }
                assert!(!monitor.may_feed_watchdog(&PARTS), "{hung:?}");
            }
            monitor.check_in(hung);
            assert!(monitor.may_feed_watchdog(&PARTS), "{hung:?} runs again");
            assert_eq!(monitor.fed(), 1);
            monitor.check_in(hung);
            let again = monitor.may_feed_watchdog(&PARTS);
            assert!(!again, "all have to check in again");
        }
    }

    #[test]
    fn unwatched_parts_do_not_block_the_watchdog() {
        let monitor = Monitor::new();
        let watched = &PARTS[..2];
        monitor.check_in(WatchedPart::Tick);
        monitor.check_in(WatchedPart::Usb);
        assert!(!monitor.may_feed_watchdog(watched));
        monitor.check_in(WatchedPart::Link);
        assert!(monitor.may_feed_watchdog(watched));
    }
}
