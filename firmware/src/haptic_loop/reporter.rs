//! What of the loop is told to the link, and how often.
//!
//! Samples a thousand times a second whatever the tick rate: a link that is
//! full of samples has no room for tiles. Where the loop stands, ten times a
//! second, and at once when it changes.

use hapterra_core::guard::{Fault, Report, TickRate};
use hapterra_core::wire::message::Sample;

/// Between two tellings of where the loop stands, ms.
const TELL_MS: u32 = 100;

/// Decides what is told.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reporter {
    /// Ticks between two samples, and since the last.
    record_every: u32,
    ticks: u32,
    tell_every: u32,
    untold: u32,
    told: u64,
}

impl Reporter {
    pub(super) fn new(rate: TickRate) -> Self {
        Self {
            record_every: rate.ticks(1),
            ticks: 0,
            tell_every: rate.ticks(TELL_MS),
            untold: 0,
            // No report has this: modes are few.
            told: u64::MAX,
        }
    }

    /// Whether this tick's sample is sent.
    pub(super) fn records_this(&mut self, sample: &Sample) -> bool {
        // The first of a scene is always one.
        self.ticks = if sample.tick == 1 { 0 } else { self.ticks + 1 };
        if self.ticks >= self.record_every {
            self.ticks = 0;
        }
        self.ticks == 0
    }

    /// Whether it is to be told now that the guard stands here.
    pub(super) fn reports_this(&mut self, report: &Report) -> bool {
        self.untold = self.untold.saturating_add(1);
        self.untold >= self.tell_every || self.told != without_limits(report)
    }

    /// It was told.
    pub(super) fn reported(&mut self, report: &Report) {
        self.untold = 0;
        self.told = without_limits(report);
    }
}

/// The report in a number. Limits come and go with every touch, and each
/// sample has them.
fn without_limits(report: &Report) -> u64 {
    let fault = report.fault.map_or(0, Fault::number);
    u64::from(report.blockers.bits())
        | u64::from(report.decision.refused.bits()) << 16
        | u64::from(report.decision.count) << 32
        | u64::from(fault) << 40
        | (report.mode as u64) << 48
}

#[cfg(test)]
mod tests {
    use super::*;
    use hapterra_core::guard::{Limits, Mode};

    #[test]
    fn samples_come_a_thousand_times_a_second() {
        for khz in [1, 4, 10] {
            let mut reporter = Reporter::new(TickRate::new(khz * 1000).expect("in range"));
            let sample = |tick| Sample {
                tick,
                ..Sample::default()
            };
            let sent: Vec<u32> = (1..=5 * khz)
                .filter(|tick| reporter.records_this(&sample(*tick)))
                .collect();
            assert_eq!(sent, Vec::from_iter((0..5).map(|ms| 1 + ms * khz)));
        }
    }

    #[test]
    fn a_change_is_told_at_once_and_the_rest_now_and_then() {
        let mut reporter = Reporter::new(TickRate::DEFAULT);
        let mut report = Report::default();
        let mut told = 0;
        for tick in 0..1000 {
            if tick == 250 {
                report.mode = Mode::Requested;
            }
            report.limits.toggle(Limits::FORCE_CLAMPED);
            if reporter.reports_this(&report) {
                reporter.reported(&report);
                told += 1;
            }
        }
        assert_eq!(told, 1 + 2 + 1 + 7, "at 0, 100, 200, 250, then 350 … 950");
    }
}
