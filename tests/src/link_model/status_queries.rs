//! A host that asks for the status without a pause, and what it takes for the answer.

use hapterra::link::{Event, HostRequest};

use super::oracle::Wrong;

/// The question under way, and the answers so far.
#[derive(Default)]
pub(super) struct StatusQueries {
    /// The device's tick at which it was asked.
    asked: Option<u32>,
    /// Number of answers.
    pub(super) answers: u32,
    /// The tick of the first status that is older than its question, and the question's.
    outdated: Option<(u32, u32)>,
}

impl StatusQueries {
    /// Asks at this tick of the device, unless it has asked already.
    pub(super) fn ask(&mut self, tick: u32) -> Option<HostRequest> {
        match self.asked {
            Some(_) => None,
            None => {
                self.asked = Some(tick);
                Some(HostRequest::Status)
            }
        }
    }

    /// The host was killed.
    pub(super) const fn forget(&mut self) {
        self.asked = None;
    }

    /// The device counts its ticks from zero again.
    pub(super) fn device_restarted(&mut self) {
        self.asked = self.asked.and(Some(0));
    }

    pub(super) fn take(&mut self, event: &Event<'_>) {
        match event {
            Event::Status(status) => {
                self.answers += 1;
                let told = status.ticks.run;
                let asked = self.asked.take().filter(|asked| told < *asked);
                self.outdated = self.outdated.or(asked.map(|asked| (told, asked)));
            }
            Event::Unanswered(HostRequest::Status) => self.asked = None,
            _ => {}
        }
    }

    pub(super) fn judge(&self) -> Result<(), Wrong> {
        match self.outdated {
            None => Ok(()),
            Some((told, asked)) => Err(Wrong::Outdated(told, asked)),
        }
    }
}
