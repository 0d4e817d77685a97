//! Queue of a host's requests: one is sent at a time, repeated until it is answered or its time-out
//! ends.

use std::collections::VecDeque;
use std::time::Duration;

use hapterra_core::wire::message::ToDevice;
use hapterra_core::wire::request::Request;

use super::host_request::HostRequest;
use super::timeouts::Timeouts;

/// Pending request.
#[derive(Clone, Copy, Debug)]
struct Pending {
    request: HostRequest,
    number: u8,
    since: Duration,
    sent_at: Duration,
}

/// The pending request, the waiting ones, and the unanswered ones.
#[derive(Clone, Debug, Default)]
pub(super) struct RequestQueue {
    pending: Option<Pending>,
    waiting: VecDeque<HostRequest>,
    /// Numbers of the last request and of the last query, counted apart: a hundred queries between
    /// two requests would otherwise make the second look older than the first.
    request_number: u8,
    query_number: u8,
    unanswered: Vec<HostRequest>,
}

impl RequestQueue {
    /// Adds a request at the end of the queue. Cancels of a change give up their place to any other
    /// request: heartbeats and tile requests report their result.
    pub(super) fn enqueue(&mut self, request: HostRequest) {
        if !is_cancel(&request) {
            self.drop_cancels();
        }
        self.waiting.push_back(request);
    }

    /// Removes the cancels of a change, pending or waiting. A late answer to one is ignored.
    pub(super) fn drop_cancels(&mut self) {
        self.pending.take_if(|pending| is_cancel(&pending.request));
        self.waiting.retain(|request| !is_cancel(request));
    }

    /// Begins a session: numbers start again, and the requests of the session before are given up.
    pub(super) fn begin_session(&mut self) {
        self.request_number = 0;
        self.give_up();
    }

    /// Gives up the pending request and the waiting ones.
    pub(super) fn give_up(&mut self) {
        let under_way = self.pending.take().map(|pending| pending.request);
        self.unanswered.extend(under_way);
        self.unanswered.extend(self.waiting.drain(..));
    }

    /// Returns the requests that were given up without an answer since the last call.
    pub(super) fn take_unanswered(&mut self) -> Vec<HostRequest> {
        std::mem::take(&mut self.unanswered)
    }

    /// Returns the message to send now: the pending request if it is due again, or the next one.
    pub(super) fn next_message(
        &mut self,
        now: Duration,
        timeouts: &Timeouts,
    ) -> Option<ToDevice<'static>> {
        self.give_up_overdue(now, timeouts);
        match &mut self.pending {
            Some(pending) if now.saturating_sub(pending.sent_at) < timeouts.retry => return None,
            Some(pending) => pending.sent_at = now,
            None => {
                let request = self.waiting.pop_front()?;
                self.pending = Some(self.begin(request, now));
            }
        }
        self.pending.map(
            |Pending {
                 request, number, ..
             }| match request {
                HostRequest::Request(request) => ToDevice::Request { number, request },
                HostRequest::Status => ToDevice::Status { number },
                HostRequest::Calibration => ToDevice::GetCalibration { number },
            },
        )
    }

    fn give_up_overdue(&mut self, now: Duration, timeouts: &Timeouts) {
        let is_late = |pending: &mut Pending| {
            now.saturating_sub(pending.since) >= timeouts.answer_timeout(&pending.request)
        };
        if let Some(pending) = self.pending.take_if(is_late) {
            self.unanswered.push(pending.request);
            if matches!(
                pending.request,
                HostRequest::Request(Request::Arm | Request::Jog(_))
            ) {
                // Its number makes the device ignore the first one, even if that arrives later.
                self.waiting
                    .push_front(HostRequest::Request(Request::Disarm));
            }
        }
    }

    fn begin(&mut self, request: HostRequest, now: Duration) -> Pending {
        let number = match request {
            HostRequest::Request(_) => &mut self.request_number,
            HostRequest::Status | HostRequest::Calibration => &mut self.query_number,
        };
        *number = number.wrapping_add(1);
        Pending {
            request,
            number: *number,
            since: now,
            sent_at: now,
        }
    }

    /// Returns the pending request if the answer has its number.
    pub(super) fn request_answered(&mut self, number: u8) -> Option<HostRequest> {
        self.answered(number, |request| matches!(request, HostRequest::Request(_)))
    }

    /// Returns the pending query if the answer has its number.
    pub(super) fn query_answered(&mut self, query: HostRequest, number: u8) -> Option<HostRequest> {
        self.answered(number, |request| *request == query)
    }

    /// Removes and returns the pending request if the answer is to it.
    fn answered(
        &mut self,
        number: u8,
        is_match: impl Fn(&HostRequest) -> bool,
    ) -> Option<HostRequest> {
        let is_match =
            |pending: &mut Pending| pending.number == number && is_match(&pending.request);
        self.pending
            .take_if(is_match)
            .map(|pending| pending.request)
    }
}

/// Returns true if a request cancels a change of placement.
const fn is_cancel(request: &HostRequest) -> bool {
    matches!(request, HostRequest::Request(Request::CancelChange { .. }))
}
