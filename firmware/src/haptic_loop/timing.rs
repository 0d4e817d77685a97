//! Cost and lateness of a tick, by the board's own timers.
//!
//! A tick that begins late is counted. A gap of more than one and a half periods is a fault: the
//! timer's own count covers only one period, so it cannot show that whole periods are missing, and
//! the last force persisted meanwhile.

use hapterra_core::scene::TickRecord;

use crate::board::TickClock;

/// Part of the period by which a tick begins late. Nothing is above the haptic interrupt, so only
/// masked interrupts could have delayed it.
const LATE_PART: u32 = 100;

/// The beginning of a tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct TickStart {
    /// Time by the free-running clock.
    at: u32,
    /// True if more than one and a half periods have passed since the previous tick.
    pub(super) after_gap: bool,
}

/// Cost and lateness of the ticks up to now; costs in counts of the board's clock.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timing {
    latest_begin: u32,
    max_gap: u32,
    cost: u32,
    worst_cost: u32,
    late: u32,
}

impl Timing {
    pub(super) const fn new<C: TickClock>() -> Self {
        Self {
            latest_begin: C::PERIOD / LATE_PART,
            max_gap: C::PERIOD + C::PERIOD / 2,
            cost: 0,
            worst_cost: 0,
            late: 0,
        }
    }

    /// Acknowledges the timer, counts a late tick and detects missing ticks.
    pub(super) fn begin<C: TickClock>(&mut self, clock: &mut C) -> TickStart {
        let began = TickStart {
            at: clock.now(),
            after_gap: clock.since_last_tick() > self.max_gap,
        };
        if clock.since_due() > self.latest_begin {
            self.late = self.late.saturating_add(1);
        }
        clock.begin_tick();
        began
    }

    /// Measures the cost. Returns true if the next tick is already due: an overrun.
    pub(super) fn end<C: TickClock>(&mut self, clock: &C, began: TickStart) -> bool {
        self.cost = clock.now().wrapping_sub(began.at);
        self.worst_cost = self.worst_cost.max(self.cost);
        let overrun = clock.next_is_due();
        if overrun {
            self.late = self.late.saturating_add(1);
        }
        overrun
    }

    /// Writes the figures into a sample. The sample's own tick has not ended, so the cost is the
    /// previous tick's.
    pub(super) const fn fill(&self, sample: &mut TickRecord) {
        sample.cost = self.cost;
        sample.worst_cost = self.worst_cost;
        sample.late = self.late;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Fake {
        now: u32,
        since_due: u32,
        since_last_tick: u32,
        next_is_due: bool,
    }

    impl TickClock for Fake {
        const HZ: u32 = 1_000_000;
        const PERIOD: u32 = 1000;

        fn now(&self) -> u32 {
            self.now
        }

        fn since_due(&self) -> u32 {
            self.since_due
        }

        fn since_last_tick(&mut self) -> u32 {
            self.since_last_tick
        }

        fn begin_tick(&mut self) {
            self.next_is_due = false;
        }

        fn next_is_due(&self) -> bool {
            self.next_is_due
        }
    }

    #[test]
    fn cost_is_measured_across_counter_wrap_and_maximum_is_kept() {
        let mut timing = Timing::new::<Fake>();
        let mut clock = Fake {
            now: u32::MAX - 4,
            since_due: 10,
            since_last_tick: 1000,
            next_is_due: true,
        };
        let began = timing.begin(&mut clock);
        clock.now = 20;
        assert!(
            !timing.end(&clock, began),
            "this tick's own event was consumed"
        );
        let began = timing.begin(&mut clock);
        clock.now = 21;
        assert!(!timing.end(&clock, began));
        assert_eq!((timing.cost, timing.worst_cost, timing.late), (1, 25, 0));
    }

    #[test]
    fn late_start_and_late_end_are_both_counted() {
        let mut timing = Timing::new::<Fake>();
        let mut clock = Fake {
            now: 0,
            since_due: 11,
            since_last_tick: 1000,
            next_is_due: false,
        };
        let began = timing.begin(&mut clock);
        clock.next_is_due = true;
        assert!(timing.end(&clock, began));
        assert_eq!(timing.late, 2);
    }

    /// Safety: 42.
    #[test]
    fn gap_is_detected_above_one_and_a_half_periods() {
        let mut timing = Timing::new::<Fake>();
        let mut after = |since_last_tick| {
            let mut clock = Fake {
                now: 0,
                since_due: 0,
                since_last_tick,
                next_is_due: false,
            };
            timing.begin(&mut clock).after_gap
        };
        assert!(!after(1000) && !after(1500));
        assert!(after(1501) && after(2000) && after(44_000));
    }
}
