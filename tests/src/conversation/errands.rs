//! Requests of a host besides arming and disarming, one after the other: another placement
//! while it feels, and afterwards the calibration, held outputs, storing, and a jog.

use std::collections::VecDeque;

use hapterra::link::{Ask, Event};
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
pub(super) enum Errand {
    /// To ask, and to wait for the answer.
    Ask(Ask),
    /// To put this view in, and to wait for what becomes of it.
    View(u8),
    /// To let so many ticks pass.
    Wait(u64),
}

/// Rest of a list, and the results of the others.
#[derive(Default)]
pub(super) struct Errands {
    left: VecDeque<Errand>,
    under_way: Option<(Errand, u64)>,
    /// Things that were done, refused, and given up.
    pub(super) came_of: [u32; 3],
}

impl Errands {
    /// While the arm is armed.
    pub(super) fn armed() -> Self {
        let clutch = |hold| Errand::Ask(Ask::Request(Request::Clutch { hold }));
        Self::of([
            clutch(ClutchHold::InPlace),
            Errand::Wait(CLUTCH_TICKS),
            Errand::View(1),
            Errand::Ask(Ask::Calibration),
            clutch(ClutchHold::LetGo),
            Errand::Wait(CLUTCH_TICKS),
        ])
    }

    /// While it is disarmed; the last that drives is disarmed again.
    pub(super) fn disarmed() -> Self {
        let jog = Jog {
            axis: 1,
            current_a: 0.1,
            hold_ms: 100,
        };
        let ask = |request| Errand::Ask(Ask::Request(request));
        Self::of([
            Errand::Ask(Ask::Calibration),
            ask(Request::HoldOutputs(Some([0.5, 0.0, -0.5]))),
            ask(Request::HoldOutputs(None)),
            ask(Request::StoreCalibration),
            ask(Request::Jog(jog)),
            Errand::Wait(JOG_TICKS),
            ask(Request::Disarm),
            Errand::Wait(FADE_TICKS),
        ])
    }

    fn of(list: impl IntoIterator<Item = Errand>) -> Self {
        Self {
            left: list.into_iter().collect(),
            ..Self::default()
        }
    }

    pub(super) fn are_done(&self) -> bool {
        self.left.is_empty() && self.under_way.is_none()
    }

    /// The next thing to do, where the one before is over.
    pub(super) fn next(&mut self, now: u64) -> Option<Errand> {
        if let Some((Errand::Wait(ticks), since)) = self.under_way
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
            (Event::Answered { request, result }, Errand::Ask(Ask::Request(asked)))
                if **request == asked =>
            {
                usize::from(result.is_err())
            }
            (Event::Calibration(_), Errand::Ask(Ask::Calibration)) => 0,
            (Event::Viewed { view, taken }, Errand::View(number)) if view.number == number => {
                usize::from(!*taken)
            }
            (Event::Unanswered(given_up), Errand::Ask(asked)) if **given_up == asked => 2,
            _ => return,
        };
        self.came_of[came] += 1;
        self.under_way = None;
    }
}
