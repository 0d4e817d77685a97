//! A host that queries the status without a pause, and the statuses that it accepts as answers.

use hapterra::link::{Event, HostRequest};

use super::oracle::Violation;

/// The query in progress, and the answers up to now.
#[derive(Default)]
pub(super) struct StatusQueries {
    /// The device's tick at the query.
    queried_at: Option<u32>,
    /// Number of answers.
    pub(super) answers: u32,
    /// The tick of the first status that is older than its query, and the query's tick.
    outdated: Option<(u32, u32)>,
}

impl StatusQueries {
    /// Makes a query at this tick of the device, unless one is in progress.
    pub(super) fn query(&mut self, tick: u32) -> Option<HostRequest> {
        match self.queried_at {
            Some(_) => None,
            None => {
                self.queried_at = Some(tick);
                Some(HostRequest::Status)
            }
        }
    }

    /// Drops the query of a killed host.
    pub(super) const fn reset(&mut self) {
        self.queried_at = None;
    }

    /// Drops the query if the device restarts, as its ticks count from zero again.
    pub(super) fn device_restarted(&mut self) {
        self.queried_at = self.queried_at.and(Some(0));
    }

    pub(super) fn take(&mut self, event: &Event<'_>) {
        match event {
            Event::Status(status) => {
                self.answers += 1;
                let reported = status.ticks.run;
                let queried_at = self
                    .queried_at
                    .take()
                    .filter(|queried_at| reported < *queried_at);
                self.outdated = self
                    .outdated
                    .or(queried_at.map(|queried_at| (reported, queried_at)));
            }
            Event::Unanswered(HostRequest::Status) => self.queried_at = None,
            _ => {}
        }
    }

    pub(super) fn check(&self) -> Result<(), Violation> {
        match self.outdated {
            None => Ok(()),
            Some((reported, queried_at)) => Err(Violation::Outdated(reported, queried_at)),
        }
    }
}
