//! The mark pin's pulse: it begins at the end of the marked tick.

use hapterra_core::rate::TickRate;
use hapterra_core::scene::{MARK_GAP_MS, MARK_PULSE_MS};

use crate::queues::Marked;

/// One pulse and the gap after it. A mark in the meantime restarts the pulse; the link requests one
/// at a time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mark {
    /// Ticks of a pulse and its gap, and of the gap alone.
    whole: u32,
    gap: u32,
    /// Remaining ticks of both; 0 if nothing is marked.
    left: u32,
    under_way: Marked,
    over: Marked,
    edge: Option<bool>,
}

impl Mark {
    pub(super) fn new(rate: TickRate) -> Self {
        let gap = rate.ticks(MARK_GAP_MS);
        Self {
            whole: rate.ticks(MARK_PULSE_MS) + gap,
            gap,
            left: 0,
            under_way: Marked::default(),
            over: Marked::default(),
            edge: None,
        }
    }

    /// Marks the current tick.
    pub(super) fn begin(&mut self, number: u8) {
        self.under_way.number = number;
        self.left = self.whole;
    }

    /// Ends a tick of this number.
    pub(super) fn tick(&mut self, tick: u32) {
        if self.left == 0 {
            return;
        }
        self.edge = match self.left {
            left if left == self.whole => {
                self.under_way.tick = tick;
                Some(true)
            }
            left if left == self.gap => Some(false),
            _ => None,
        };
        self.left -= 1;
        if self.left == 0 {
            self.over = self.under_way;
        }
    }

    /// Returns the pin's new level after the latest tick; `None` if it does not change.
    pub(super) const fn edge(&self) -> Option<bool> {
        self.edge
    }

    /// Returns the latest mark whose pulse and gap are over.
    pub(super) const fn latest(&self) -> Marked {
        self.over
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pulse_lasts_ten_milliseconds_at_each_tick_rate() {
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
    fn a_mark_within_a_pulse_begins_it_anew() {
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
