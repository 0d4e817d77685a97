//! A timer's two encoder inputs: the digital filter of each channel, and the count of the filtered
//! edges (RM0440, 29.4; RM0433, 43.3).

/// The digital filter of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Filter {
    /// Clocks of the timer from one sample to the next.
    clocks: u64,
    /// Consecutive samples after which a level is valid.
    samples: u32,
}

impl Filter {
    /// Returns the filter selected by ICxF and CKD.
    #[must_use]
    pub fn of(icf: u32, ckd: u32) -> Self {
        let divided = 1 << ckd.min(2);
        let (clocks, samples) = match icf {
            0 => (divided, 1),
            1 => (1, 2),
            2 => (1, 4),
            3 => (1, 8),
            4..10 => (divided << (icf / 2 - 1), [6, 8][icf as usize % 2]),
            10..13 => (16 * divided, [5, 6, 8][icf as usize - 10]),
            _ => (32 * divided, [5, 6, 8][(icf as usize - 13).min(2)]),
        };
        Self { clocks, samples }
    }
}

/// One channel after its filter.
struct Channel {
    filter: Filter,
    level: bool,
    /// Consecutive samples that differ from the level.
    others: u32,
}

impl Channel {
    /// Takes a sample if one is due. Returns true if the level has changed.
    fn sample(&mut self, clock: u64, level: bool) -> bool {
        if !clock.is_multiple_of(self.filter.clocks) {
            return false;
        }
        self.others = if level == self.level {
            0
        } else {
            self.others + 1
        };
        let changes = self.others >= self.filter.samples;
        if changes {
            (self.level, self.others) = (level, 0);
        }
        changes
    }
}

/// Counts every edge of both channels for this time with a clock of `hz`. `levels` returns channels
/// A and B at a time in ns. A before B counts up.
pub fn count(
    filters: [Filter; 2],
    hz: u64,
    ms: u64,
    mut levels: impl FnMut(f64) -> [bool; 2],
) -> i32 {
    let at_first = levels(0.0);
    let [mut a, mut b] = [0, 1].map(|i| Channel {
        filter: filters[i],
        level: at_first[i],
        others: 0,
    });
    let step = filters[0].clocks.min(filters[1].clocks);
    let mut counted = 0;
    for clock in (0..hz * ms / 1000).step_by(step as usize) {
        let [now_a, now_b] = levels(clock as f64 * 1e9 / hz as f64);
        if a.sample(clock, now_a) {
            counted += if a.level != b.level { 1 } else { -1 };
        }
        if b.sample(clock, now_b) {
            counted += if a.level == b.level { 1 } else { -1 };
        }
    }
    counted
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a forward motion of 250 ns a count.
    fn forwards(ns: f64) -> [bool; 2] {
        let count = (ns / 250.0) as u64 % 4;
        [matches!(count, 1 | 2), matches!(count, 2 | 3)]
    }

    #[test]
    fn edges_count_up_or_down_by_their_order() {
        let raw = [Filter::of(0, 0); 2];
        assert_eq!(count(raw, 100_000_000, 1, forwards), 3_999);
        let back = |ns| {
            let [a, b] = forwards(ns);
            [b, a]
        };
        assert_eq!(count(raw, 100_000_000, 1, back), -3_999);
    }

    #[test]
    fn filter_passes_only_pulses_longer_than_its_samples() {
        // Eight samples, one in 64 clocks of 10 ns: 5.12 µs.
        let filter = Filter::of(15, 1);
        let expected = Filter {
            clocks: 64,
            samples: 8,
        };
        assert_eq!(filter, expected);
        let pulse = |long_ns: f64| move |ns: f64| [ns % 20_000.0 < long_ns, false];
        let changes = |long_ns| {
            let mut channel = Channel {
                filter,
                level: false,
                others: 0,
            };
            let level = pulse(long_ns);
            (1..100_000)
                .filter(|clock| channel.sample(*clock, level(*clock as f64 * 10.0)[0]))
                .count()
        };
        assert_eq!(changes(7.0 * 640.0 - 1.0), 0);
        assert!(changes(8.0 * 640.0 + 10.0) >= 98);
    }

    #[test]
    fn pulse_across_other_channels_edge_drifts_without_filter() {
        // Channel A is low, and channel B changes once, in the middle of a pulse on A.
        let disturbed = |ns: f64| [(500e3 - 400.0..500e3 + 400.0).contains(&ns), ns > 500e3];
        let counted = |icf| count([Filter::of(icf, 0); 2], 100_000_000, 1, disturbed);
        assert_eq!(counted(0), 3);
        assert_eq!(counted(12), -1);
    }
}
