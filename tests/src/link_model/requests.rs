//! Requests of a host besides arming and disarming, in sequence: another placement while it
//! renders, then the calibration, held outputs, storing, and a jog.

use std::collections::VecDeque;

use hapterra::link::{Event, HostRequest};
use hapterra_core::clutch::ClutchMode;
use hapterra_core::guard::Jog;
use hapterra_core::wire::request::Request;

/// Ticks in which the clutch opens or a jog drives, after the answer.
const CLUTCH_TICKS: u64 = 300;
const JOG_TICKS: u64 = 900;
/// Ticks in which the force fades.
const FADE_TICKS: u64 = 300;

/// One step of a sequence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum RequestStep {
    /// Sends a request and waits for the answer.
    HostRequest(HostRequest),
    /// Sends this placement and waits for the result.
    View(u8),
    /// Waits for this many ticks.
    Wait(u64),
}

/// The remaining steps, and the results of the others.
#[derive(Default)]
pub(super) struct RequestSequence {
    remaining: VecDeque<RequestStep>,
    current: Option<(RequestStep, u64)>,
    /// Counts of requests that succeeded, were refused, and were abandoned.
    pub(super) outcomes: [u32; 3],
}

impl RequestSequence {
    /// Returns the requests for an armed arm.
    pub(super) fn armed() -> Self {
        let clutch =
            |hold| RequestStep::HostRequest(HostRequest::Request(Request::Clutch { hold }));
        Self::of([
            clutch(ClutchMode::InPlace),
            RequestStep::Wait(CLUTCH_TICKS),
            RequestStep::View(1),
            RequestStep::HostRequest(HostRequest::Calibration),
            clutch(ClutchMode::Released),
            RequestStep::Wait(CLUTCH_TICKS),
        ])
    }

    /// Returns the requests for a disarmed arm; the jog at the end is disarmed again.
    pub(super) fn disarmed() -> Self {
        let jog = Jog {
            axis: 1,
            current_a: 0.1,
            hold_ms: 100,
        };
        let request = |request| RequestStep::HostRequest(HostRequest::Request(request));
        Self::of([
            RequestStep::HostRequest(HostRequest::Calibration),
            request(Request::HoldOutputs(Some([0.5, 0.0, -0.5]))),
            request(Request::HoldOutputs(None)),
            request(Request::StoreCalibration),
            request(Request::Jog(jog)),
            RequestStep::Wait(JOG_TICKS),
            request(Request::Disarm),
            RequestStep::Wait(FADE_TICKS),
        ])
    }

    fn of(list: impl IntoIterator<Item = RequestStep>) -> Self {
        Self {
            remaining: list.into_iter().collect(),
            ..Self::default()
        }
    }

    pub(super) fn are_done(&self) -> bool {
        self.remaining.is_empty() && self.current.is_none()
    }

    /// Returns the next step if the last one has ended.
    pub(super) fn next(&mut self, now: u64) -> Option<RequestStep> {
        if let Some((RequestStep::Wait(ticks), since)) = self.current
            && now >= since + ticks
        {
            self.current = None;
        }
        if self.current.is_some() {
            return None;
        }
        let next = self.remaining.pop_front()?;
        self.current = Some((next, now));
        Some(next)
    }

    /// Takes an event that may be the answer.
    pub(super) fn take(&mut self, event: &Event<'_>) {
        let Some((request, _)) = self.current else {
            return;
        };
        let outcome = match (event, request) {
            (
                Event::Answered { request, result },
                RequestStep::HostRequest(HostRequest::Request(expected)),
            ) if **request == expected => usize::from(result.is_err()),
            (Event::Calibration(_), RequestStep::HostRequest(HostRequest::Calibration)) => 0,
            (Event::SceneChangeResult { view, accepted }, RequestStep::View(number))
                if view.number == number =>
            {
                usize::from(!*accepted)
            }
            (Event::Unanswered(unanswered), RequestStep::HostRequest(expected))
                if **unanswered == expected =>
            {
                2
            }
            _ => return,
        };
        self.outcomes[outcome] += 1;
        self.current = None;
    }
}
