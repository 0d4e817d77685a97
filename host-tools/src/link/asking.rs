//! A host's requests, one after the other: repeated until answered, or
//! given up.

use std::collections::VecDeque;
use std::time::Duration;

use hapterra_core::wire::message::ToDevice;
use hapterra_core::wire::request::Request;

use super::ask::Ask;
use super::timeouts::Timeouts;

/// Pending request.
#[derive(Clone, Copy, Debug)]
struct Pending {
    ask: Ask,
    number: u8,
    since: Duration,
    said: Duration,
}

/// Pending request, waiting ones, and those that were given up.
#[derive(Clone, Debug, Default)]
pub(super) struct Asking {
    pending: Option<Pending>,
    waiting: VecDeque<Ask>,
    /// The last request's number, and the last question's. A hundred questions between two
    /// requests that were numbered with them would make the second look older than the
    /// first.
    request: u8,
    question: u8,
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
        self.request = 0;
        self.give_up();
    }

    /// Gives up the pending request and the waiting ones.
    pub(super) fn give_up(&mut self) {
        let under_way = self.pending.take().map(|pending| pending.ask);
        self.unanswered.extend(under_way);
        self.unanswered.extend(self.waiting.drain(..));
    }

    /// Returns the requests that were given up without an answer since the last call.
    pub(super) fn take_unanswered(&mut self) -> Vec<Ask> {
        std::mem::take(&mut self.unanswered)
    }

    /// Returns the message to send now: the pending request if it is due again, or the next one.
    pub(super) fn due(&mut self, now: Duration, patience: &Timeouts) -> Option<ToDevice<'static>> {
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
            Ask::Status => ToDevice::Status { number },
            Ask::Calibration => ToDevice::GetCalibration { number },
        })
    }

    fn give_up_late(&mut self, now: Duration, patience: &Timeouts) {
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
        let number = match ask {
            Ask::Request(_) => &mut self.request,
            Ask::Status | Ask::Calibration => &mut self.question,
        };
        *number = number.wrapping_add(1);
        Pending {
            ask,
            number: *number,
            since: now,
            said: now,
        }
    }

    /// Takes the answer to the request of this number: which that was, if it is under way.
    pub(super) fn request_answered(&mut self, number: u8) -> Option<Ask> {
        self.answered(number, |ask| matches!(ask, Ask::Request(_)))
    }

    /// Takes the answer to the question of this number: whether that is under way.
    pub(super) fn question_answered(&mut self, asked: Ask, number: u8) -> Option<Ask> {
        self.answered(number, |ask| *ask == asked)
    }

    /// An answer to what was asked for before tells what was.
    fn answered(&mut self, number: u8, is_it: impl Fn(&Ask) -> bool) -> Option<Ask> {
        let is_it = |pending: &mut Pending| pending.number == number && is_it(&pending.ask);
        self.pending.take_if(is_it).map(|pending| pending.ask)
    }
}
