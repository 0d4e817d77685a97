//! A host that queries the status without a pause, and the statuses that it accepts as answers.

use hapterra::link::{Event, HostRequest};

use super::oracle::Violation;

/// The query in progress, and the answers up to now.
#[derive(Default)]
pub(super) struct StatusQueries {
    /// The device's tick at the query.
    asked: Option<u32>,
    /// Number of answers.
    pub(super) answers: u32,
    /// The tick of the first status that is older than its query, and the query's tick.
    outdated: Option<(u32, u32)>,
}

impl StatusQueries {
    /// Makes a query at this tick of the device, unless one is in progress.
    pub(super) fn query(&mut self, tick: u32) -> Option<HostRequest> {
        match self.asked {
            Some(_) => None,
            None => {
                self.asked = Some(tick);
                Some(HostRequest::Status)
            }
        }
    }

    /// Drops the query of a killed host.
    pub(super) const fn reset(&mut self) {
        self.asked = None;
    }

    /// Drops the query if the device restarts, as its ticks count from zero again.
    pub(super) fn device_restarted(&mut self) {
        self.asked = self.asked.and(Some(0));
    }

    pub(super) fn take(&mut self, event: &Event<'_>) {
        match event {
            Event::Status(status) => {
                self.answers += 1;
                let reported = status.ticks.run;
                let asked = self.asked.take().filter(|asked| reported < *asked);
                self.outdated = self.outdated.or(asked.map(|asked| (reported, asked)));
            }
            Event::Unanswered(HostRequest::Status) => self.asked = None,
            _ => {}
        }
    }

    pub(super) fn check(&self) -> Result<(), Violation> {
        match self.outdated {
            None => Ok(()),
            Some((reported, asked)) => Err(Violation::Outdated(reported, asked)),
        }
    }
}
