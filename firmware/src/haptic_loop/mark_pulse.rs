//! The mark pin's pulse: it begins at the end of the marked tick.

use hapterra_core::rate::TickRate;
use hapterra_core::scene::{MARK_GAP_MS, MARK_PULSE_MS};

use crate::queues::Marked;

/// One pulse and the gap after it. A mark in the meantime restarts the pulse; the link requests one
/// at a time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mark {
    /// Ticks of a pulse and its gap, and of the gap alone.
    total: u32,
    gap: u32,
    /// Remaining ticks of both; 0 if nothing is marked.
    remaining: u32,
    current: Marked,
    completed: Marked,
    edge: Option<bool>,
}

impl Mark {
    pub(super) fn new(rate: TickRate) -> Self {
        let gap = rate.ticks(MARK_GAP_MS);
        Self {
            total: rate.ticks(MARK_PULSE_MS) + gap,
            gap,
            remaining: 0,
            current: Marked::default(),
            completed: Marked::default(),
            edge: None,
        }
    }

    /// Marks the current tick.
    pub(super) fn begin(&mut self, number: u8) {
        self.current.number = number;
        self.remaining = self.total;
    }

    /// Ends a tick of this number.
    pub(super) fn tick(&mut self, tick: u32) {
        if self.remaining == 0 {
            return;
        }
        self.edge = match self.remaining {
            remaining if remaining == self.total => {
                self.current.tick = tick;
                Some(true)
            }
            remaining if remaining == self.gap => Some(false),
            _ => None,
        };
        self.remaining -= 1;
        if self.remaining == 0 {
            self.completed = self.current;
        }
    }

    /// Returns the pin's new level after the latest tick; `None` if it does not change.
    pub(super) const fn edge(&self) -> Option<bool> {
        self.edge
    }

    /// Returns the latest mark whose pulse and gap are over.
    pub(super) const fn latest(&self) -> Marked {
        self.completed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pulse_lasts_ten_milliseconds_at_each_tick_rate() {
        for khz in [1, 4, 10] {
            let mut mark = Mark::new(TickRate::new(khz * 1000).expect("in range"));
            mark.tick(6);
            assert_eq!((mark.edge(), mark.latest().number), (None, 0));
            mark.begin(9);
            let edges: Vec<_> = (7..7 + 30 * khz)
                .filter_map(|tick| {
                    mark.tick(tick);
                    let is_over = mark.latest().number == 9;
                    assert_eq!(is_over, tick >= 6 + 20 * khz, "{tick}");
                    mark.edge().map(|level| (tick, level))
                })
                .collect();
            assert_eq!(edges, [(7, true), (7 + 10 * khz, false)]);
            assert_eq!(mark.latest(), Marked { number: 9, tick: 7 });
        }
    }

    #[test]
    fn mark_during_a_pulse_restarts_it() {
        let mut mark = Mark::new(TickRate::DEFAULT);
        mark.begin(1);
        mark.tick(1);
        mark.begin(2);
        let highs = (2..).take_while(|tick| {
            mark.tick(*tick);
            mark.edge() != Some(false)
        });
        assert_eq!(highs.count(), 10);
    }
}
