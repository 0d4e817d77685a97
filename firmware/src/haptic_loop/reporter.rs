//! Reports of the loop to the link.
//!
//! Samples are sent a thousand times a second at any tick rate, because a link that is full of
//! samples has no room for tiles. The guard's state is sent ten times a second, and at once after a
//! change.

use hapterra_core::guard::{Fault, Report};
use hapterra_core::rate::TickRate;
use hapterra_core::scene::TickRecord;

/// Time between two reports of the guard's state, ms.
const REPORT_MS: u32 = 100;

/// Decides which samples and reports are sent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reporter {
    /// Ticks between two samples.
    sample_every: u32,
    ticks_since_sample: u32,
    /// Ticks between two reports if nothing changes.
    report_every: u32,
    ticks_since_report: u32,
    last_report: u64,
}

impl Reporter {
    pub(super) fn new(rate: TickRate) -> Self {
        Self {
            sample_every: rate.ticks(1),
            ticks_since_sample: 0,
            report_every: rate.ticks(REPORT_MS),
            ticks_since_report: 0,
            // No report packs to this value, because there are only a few modes.
            last_report: u64::MAX,
        }
    }

    /// Returns true if this tick's sample is sent.
    pub(super) fn is_sample_due(&mut self, sample: &TickRecord) -> bool {
        // The first sample of a scene is always sent.
        let is_first = sample.tick == 1;
        self.ticks_since_sample = match self.ticks_since_sample + 1 {
            ticks if is_first || ticks >= self.sample_every => 0,
            ticks => ticks,
        };
        self.ticks_since_sample == 0
    }

    /// Returns true if this tick's report is sent; `mark` is the number of the latest mark that is
    /// over.
    pub(super) fn is_report_due(&mut self, report: &Report, mark: u8) -> bool {
        self.ticks_since_report = self.ticks_since_report.saturating_add(1);
        self.ticks_since_report >= self.report_every || self.last_report != packed(report, mark)
    }

    /// Records that this report was sent.
    pub(super) fn mark_reported(&mut self, report: &Report, mark: u8) {
        self.ticks_since_report = 0;
        self.last_report = packed(report, mark);
    }
}

/// Packs a report and a mark's number into a number, without the limits: these change with every
/// touch, and each sample contains them.
fn packed(report: &Report, mark: u8) -> u64 {
    let fault = report.fault.map_or(0, Fault::number);
    u64::from(report.blockers.bits())
        | u64::from(report.decision.refused.bits()) << 16
        | u64::from(report.decision.count) << 32
        | u64::from(fault) << 40
        | (report.mode as u64) << 48
        | u64::from(mark) << 56
}

#[cfg(test)]
mod tests {
    use super::*;
    use hapterra_core::guard::{Limits, Mode};

    #[test]
    fn samples_are_sent_at_one_kilohertz_for_any_tick_rate() {
        for khz in [1, 4, 10] {
            let mut reporter = Reporter::new(TickRate::new(khz * 1000).expect("in range"));
            let sample = |tick| TickRecord {
                tick,
                ..TickRecord::default()
            };
            let sent: Vec<u32> = (1..=5 * khz)
                .filter(|tick| reporter.is_sample_due(&sample(*tick)))
                .collect();
            assert_eq!(sent, Vec::from_iter((0..5).map(|ms| 1 + ms * khz)));
        }
    }

    #[test]
    fn mode_change_is_reported_at_once_and_limits_periodically() {
        let mut reporter = Reporter::new(TickRate::DEFAULT);
        let mut report = Report::default();
        let mut reported = 0;
        for tick in 0..1000 {
            if tick == 250 {
                report.mode = Mode::Requested;
            }
            report.limits.toggle(Limits::FORCE_CLAMPED);
            if reporter.is_report_due(&report, 0) {
                reporter.mark_reported(&report, 0);
                reported += 1;
            }
        }
        assert_eq!(
            reported,
            1 + 2 + 1 + 7,
            "at 0, 100, 200, 250, then 350 … 950"
        );
    }
}
