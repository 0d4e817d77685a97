//! What a host asks for, one thing after the other: said again until it is answered, or
//! given up.

use std::collections::VecDeque;
use std::time::Duration;

use hapterra_core::wire::message::ToDevice;
use hapterra_core::wire::request::Request;

use super::ask::Ask;
use super::patience::Patience;

/// What is under way.
#[derive(Clone, Copy, Debug)]
struct Pending {
    ask: Ask,
    number: u8,
    since: Duration,
    said: Duration,
}

/// What is under way, what waits for it, and what was given up.
#[derive(Clone, Debug, Default)]
pub(super) struct Asking {
    pending: Option<Pending>,
    waiting: VecDeque<Ask>,
    /// The last request's number.
    number: u8,
    unanswered: Vec<Ask>,
}

impl Asking {
    /// Asks for something, after what was asked for before.
    pub(super) fn ask(&mut self, ask: Ask) {
        self.waiting.push_back(ask);
    }

    /// A session begins: requests are numbered anew, and what was asked for in the one
    /// before is given up.
    pub(super) fn begin_session(&mut self) {
        self.number = 0;
        self.give_up();
    }

    /// What is asked for, or is to be, is not waited for any more.
    pub(super) fn give_up(&mut self) {
        let under_way = self.pending.take().map(|pending| pending.ask);
        self.unanswered.extend(under_way);
        self.unanswered.extend(self.waiting.drain(..));
    }

    /// What was given up without an answer since it was last taken.
    pub(super) fn take_unanswered(&mut self) -> Vec<Ask> {
        std::mem::take(&mut self.unanswered)
    }

    /// What is to be said now: what is under way, again where it is due, or the next where
    /// nothing is.
    pub(super) fn due(&mut self, now: Duration, patience: &Patience) -> Option<ToDevice<'static>> {
        self.give_up_late(now, patience);
        match &mut self.pending {
            Some(pending) if now.saturating_sub(pending.said) < patience.again => return None,
            Some(pending) => pending.said = now,
            None => {
                let ask = self.waiting.pop_front()?;
                self.pending = Some(self.begin(ask, now));
            }
        }
        self.pending.map(|Pending { ask, number, .. }| match ask {
            Ask::Request(request) => ToDevice::Request { number, request },
            Ask::Status => ToDevice::Status,
            Ask::Calibration => ToDevice::GetCalibration,
        })
    }

    fn give_up_late(&mut self, now: Duration, patience: &Patience) {
        let is_late = |pending: &mut Pending| {
            now.saturating_sub(pending.since) >= patience.with(&pending.ask)
        };
        if let Some(pending) = self.pending.take_if(is_late) {
            self.unanswered.push(pending.ask);
            if matches!(pending.ask, Ask::Request(Request::Arm | Request::Jog(_))) {
                // Its number makes the device ignore the first, should that still come.
                self.waiting.push_front(Ask::Request(Request::Disarm));
            }
        }
    }

    fn begin(&mut self, ask: Ask, now: Duration) -> Pending {
        // Questions have no number: a hundred of them between two requests would make the
        // second look older than the first.
        if matches!(ask, Ask::Request(_)) {
            self.number = self.number.wrapping_add(1);
        }
        Pending {
            ask,
            number: self.number,
            since: now,
            said: now,
        }
    }

    /// Takes the answer to the request of this number: which that was, if it is under way.
    pub(super) fn request_answered(&mut self, number: u8) -> Option<Ask> {
        let is_it = |pending: &mut Pending| {
            pending.number == number && matches!(pending.ask, Ask::Request(_))
        };
        self.pending.take_if(is_it).map(|pending| pending.ask)
    }

    /// Takes the answer to a question: which that was, if it is under way.
    pub(super) fn question_answered(&mut self, asked: Ask) -> Option<Ask> {
        let is_it = |pending: &mut Pending| pending.ask == asked;
        self.pending.take_if(is_it).map(|pending| pending.ask)
    }
}
