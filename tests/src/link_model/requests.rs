//! Requests of a host besides arming and disarming, one after the other: another placement
//! while it feels, and afterwards the calibration, held outputs, storing, and a jog.

use std::collections::VecDeque;

use hapterra::link::{Event, HostRequest};
use hapterra_core::clutch::ClutchHold;
use hapterra_core::guard::Jog;
use hapterra_core::wire::request::Request;

/// Ticks from the clutch's answer in which it opens, and from a jog's in which it drives.
const CLUTCH_TICKS: u64 = 300;
const JOG_TICKS: u64 = 900;
/// Ticks in which the force goes out.
const FADE_TICKS: u64 = 300;

/// A thing to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum RequestStep {
    /// To ask, and to wait for the answer.
    HostRequest(HostRequest),
    /// To put this view in, and to wait for what becomes of it.
    View(u8),
    /// To let so many ticks pass.
    Wait(u64),
}

/// Rest of a list, and the results of the others.
#[derive(Default)]
pub(super) struct RequestSequence {
    left: VecDeque<RequestStep>,
    under_way: Option<(RequestStep, u64)>,
    /// Things that were done, refused, and given up.
    pub(super) came_of: [u32; 3],
}

impl RequestSequence {
    /// While the arm is armed.
    pub(super) fn armed() -> Self {
        let clutch =
            |hold| RequestStep::HostRequest(HostRequest::Request(Request::Clutch { hold }));
        Self::of([
            clutch(ClutchHold::InPlace),
            RequestStep::Wait(CLUTCH_TICKS),
            RequestStep::View(1),
            RequestStep::HostRequest(HostRequest::Calibration),
            clutch(ClutchHold::LetGo),
            RequestStep::Wait(CLUTCH_TICKS),
        ])
    }

    /// While it is disarmed; the last that drives is disarmed again.
    pub(super) fn disarmed() -> Self {
        let jog = Jog {
            axis: 1,
            current_a: 0.1,
            hold_ms: 100,
        };
        let ask = |request| RequestStep::HostRequest(HostRequest::Request(request));
        Self::of([
            RequestStep::HostRequest(HostRequest::Calibration),
            ask(Request::HoldOutputs(Some([0.5, 0.0, -0.5]))),
            ask(Request::HoldOutputs(None)),
            ask(Request::StoreCalibration),
            ask(Request::Jog(jog)),
            RequestStep::Wait(JOG_TICKS),
            ask(Request::Disarm),
            RequestStep::Wait(FADE_TICKS),
        ])
    }

    fn of(list: impl IntoIterator<Item = RequestStep>) -> Self {
        Self {
            left: list.into_iter().collect(),
            ..Self::default()
        }
    }

    pub(super) fn are_done(&self) -> bool {
        self.left.is_empty() && self.under_way.is_none()
    }

    /// The next thing to do, where the one before is over.
    pub(super) fn next(&mut self, now: u64) -> Option<RequestStep> {
        if let Some((RequestStep::Wait(ticks), since)) = self.under_way
            && now >= since + ticks
        {
            self.under_way = None;
        }
        if self.under_way.is_some() {
            return None;
        }
        let next = self.left.pop_front()?;
        self.under_way = Some((next, now));
        Some(next)
    }

    /// Takes what may be the answer.
    pub(super) fn take(&mut self, event: &Event<'_>) {
        let Some((errand, _)) = self.under_way else {
            return;
        };
        let came = match (event, errand) {
            (
                Event::Answered { request, result },
                RequestStep::HostRequest(HostRequest::Request(asked)),
            ) if **request == asked => usize::from(result.is_err()),
            (Event::Calibration(_), RequestStep::HostRequest(HostRequest::Calibration)) => 0,
            (Event::Viewed { view, taken }, RequestStep::View(number)) if view.number == number => {
                usize::from(!*taken)
            }
            (Event::Unanswered(given_up), RequestStep::HostRequest(asked))
                if **given_up == asked =>
            {
                2
            }
            _ => return,
        };
        self.came_of[came] += 1;
        self.under_way = None;
    }
}
