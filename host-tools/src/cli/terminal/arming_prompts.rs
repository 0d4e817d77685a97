//! Arming while a terrain is served. Prints the blockers, and reads Enter as "continue": clear the
//! fault, zero the arm, request to arm.
//!
//! Enter answers only the last question shown. Earlier input is discarded, and a fault after the
//! question is shown first. A program that answers for its user states the question's number.
//! Numbers start at a random value, so that only a question that was asked can be answered.

use std::io::{self, IsTerminal};
use std::sync::Arc;
use std::time::Instant;

use hapterra_core::guard::{Blockers, Fault, Mode, Report};
use hapterra_core::wire::request::{Refusal, Request};

use super::keyboard::keyboard;
use super::shared_keyboard::DeviceKeys;
use crate::cli::line_limit::LineLimit;
use crate::link::{Event, HostRequest};

/// More lines than an arm needs that is armed, faulted and armed again within a second.
const LINES_A_SECOND: u32 = 24;

/// The action of Enter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Question {
    /// The fault that was shown and will be cleared.
    fault: Option<Fault>,
    /// True if the user confirms that the arm is in its zero pose.
    zeroes: bool,
}

/// A line for the user.
#[derive(Debug)]
struct Line {
    text: String,
    /// The action of Enter after this line.
    question: Option<Question>,
}

/// Source of Enter.
trait Enter {
    /// Discards earlier keys.
    fn forget(&mut self);

    /// Returns true if Enter was pressed since the last call.
    fn was_pressed(&mut self) -> bool;
}

/// A user at the terminal.
struct TerminalEnter;

impl Enter for TerminalEnter {
    fn forget(&mut self) {
        keyboard().forget_typed();
    }

    fn was_pressed(&mut self) -> bool {
        keyboard().was_pressed()
    }
}

/// A user at a terminal that several devices share.
impl Enter for Arc<DeviceKeys> {
    fn forget(&mut self) {
        DeviceKeys::forget(self);
    }

    fn was_pressed(&mut self) -> bool {
        self.enters() > 0
    }
}

/// No source of Enter.
struct NoEnter;

impl Enter for NoEnter {
    fn forget(&mut self) {}

    fn was_pressed(&mut self) -> bool {
        false
    }
}

/// Prompts the user through arming.
pub(in crate::cli) struct ArmingPrompts {
    enter: Box<dyn Enter>,
    /// The user's action to answer a question, in the imperative.
    press_enter: String,
    /// The open question.
    question: Option<Question>,
    /// Number of the last question.
    number: u32,
    report: Option<Report>,
    /// True after a reconnection, until the first report shows whether the arm is armed.
    has_reconnected: bool,
    /// True while the counts of a zero pose that the user confirmed are requested.
    zeroing: bool,
    requests: Vec<HostRequest>,
    /// True if a user arms; false for a virtual hand, which follows its script.
    is_interactive: bool,
    /// Lines for the user, in order.
    lines: Vec<Line>,
    line_limit: LineLimit,
}

impl ArmingPrompts {
    /// Creates prompts for a virtual hand: only errors are shown.
    pub(in crate::cli) fn for_script() -> Self {
        Self {
            is_interactive: false,
            ..Self::listening(NoEnter)
        }
    }

    /// Creates prompts at the terminal, if there is one.
    pub(in crate::cli) fn at_terminal() -> Self {
        match io::stdin().is_terminal() {
            true => Self::listening(TerminalEnter),
            false => Self::listening(NoEnter),
        }
    }

    /// Creates prompts with the keys for one of several devices.
    pub(in crate::cli) fn at(device_keys: &Arc<DeviceKeys>) -> Self {
        Self {
            press_enter: device_keys.press_enter(),
            ..Self::listening(Arc::clone(device_keys))
        }
    }

    fn listening(enter: impl Enter + 'static) -> Self {
        Self {
            enter: Box::new(enter),
            press_enter: "press Enter".into(),
            question: None,
            number: fastrand::u32(..1 << 30),
            report: None,
            has_reconnected: false,
            zeroing: false,
            requests: vec![],
            is_interactive: true,
            lines: vec![],
            line_limit: LineLimit::new(LINES_A_SECOND),
        }
    }

    /// Processes an event of the device.
    pub(in crate::cli) fn on_event(&mut self, event: &Event<'_>) {
        match event {
            Event::Guard(report) => self.on_guard_report(report),
            Event::Opened { .. } => self.has_reconnected = self.is_interactive,
            Event::Answered { request, result } => match (request, result) {
                (Request::Arm, Err(Refusal::Blocked(why))) => {
                    self.push_line("not armed:");
                    self.report_blockers(*why);
                    self.prompt_for_enter(*why);
                }
                // The arm is already armed in its present pose.
                (Request::Zero { .. }, Err(Refusal::NotWhileArmed)) => {}
                (request, Err(refused)) => self.push_line(format!("{request:?}: {refused}")),
                (_, Ok(())) => {}
            },
            Event::Unanswered(request) => {
                self.zeroing &= **request != HostRequest::Status;
                self.push_line(format!(
                    "the device does not answer: {request:?} was abandoned"
                ));
            }
            Event::Status(status) if self.zeroing => {
                self.zeroing = false;
                let counts = status.health.sense.counts;
                let requests = [Request::Zero { counts }, Request::Arm];
                self.requests.extend(requests.map(HostRequest::Request));
                let [a, b, c] = counts;
                self.push_line(format!("zeroed at {a} {b} {c} counts"));
            }
            _ => {}
        }
    }

    /// Reports the state of the guard if it changed.
    fn on_guard_report(&mut self, report: &Report) {
        let before = self.report.replace(*report);
        let is_settled = report.mode == Mode::Disarmed || report.mode.is_driving();
        if self.has_reconnected && is_settled {
            self.has_reconnected = false;
            if report.mode == Mode::Disarmed && report.fault.is_none() {
                self.push_line("the arm is not armed any more");
                return self.prompt_for_enter(report.blockers);
            }
        }
        let state = |r: &Report| (r.mode, r.fault, r.blockers);
        if before.as_ref().map(state) == Some(state(report)) {
            return;
        }
        let was = before.and_then(|before| before.fault);
        if let Some(fault) = report.fault.filter(|_| was != report.fault) {
            let (number, meaning) = (fault.number(), fault.meaning());
            self.push_line(format!("FAULT {number} {fault:?}: {meaning}"));
            self.push_line(format!("  {}", fault.remedy()));
            return self.prompt_for_enter(report.blockers);
        }
        match report.mode {
            _ if !self.is_interactive => {}
            // Other blockers are refused or end in a moment.
            Mode::Requested if Blockers::BY_HAND.contains(report.blockers) => {
                self.push_line("ready to arm; waits for your hand:");
                self.report_blockers(report.blockers);
            }
            Mode::Confirming if report.blockers.contains(Blockers::FORCE_TOO_LARGE) => {
                let what = Blockers::FORCE_TOO_LARGE.meaning();
                self.push_line(format!("blocked: {what}"));
            }
            Mode::Ramping => self.push_line("amplifiers on; force ramps up"),
            Mode::Armed => self.push_line("armed"),
            Mode::Disarmed if before.is_some_and(|before| before.mode.is_driving()) => {
                self.push_line("disarmed; amplifiers off");
            }
            _ => {}
        }
    }

    fn push_line(&mut self, text: impl Into<String>) {
        let text = text.into();
        self.lines.push(Line {
            text,
            question: None,
        });
    }

    /// Prints each blocker with its remedy.
    fn report_blockers(&mut self, blockers: Blockers) {
        for (name, meaning) in blockers.meanings() {
            self.push_line(format!("  {name}: {meaning}"));
        }
    }

    fn prompt_for_enter(&mut self, why: Blockers) {
        if !self.is_interactive {
            return;
        }
        let fault = self.report.and_then(|report| report.fault);
        let zeroes = why.contains(Blockers::NOT_ZEROED);
        let press = &self.press_enter;
        let text = match (zeroes, fault.is_some()) {
            (true, _) => format!("put the arm into its zero pose, hold it there and {press}"),
            (false, true) => format!("when that is done, {press} to clear it and arm"),
            (false, false) => format!("when you are ready, {press} to arm"),
        };
        self.lines.push(Line {
            text,
            question: Some(Question { fault, zeroes }),
        });
    }

    /// Returns the present messages to the device.
    pub(in crate::cli) fn requests(&mut self) -> Vec<HostRequest> {
        if self.enter.was_pressed()
            && let Some(question) = self.question.take()
        {
            self.on_enter(question);
        }
        std::mem::take(&mut self.requests)
    }

    /// Returns the number of the open question.
    pub(in crate::cli) fn open_question(&self) -> Option<u32> {
        self.question.map(|_| self.number)
    }

    /// Answers the question with this number. Returns false if it is not open.
    pub(in crate::cli) fn answer(&mut self, number: u32) -> bool {
        let is_open = self.open_question() == Some(number);
        if is_open && let Some(question) = self.question.take() {
            self.on_enter(question);
        }
        is_open
    }

    fn on_enter(&mut self, question: Question) {
        let fault = self.report.and_then(|report| report.fault);
        // The user has not read about a fault after the question.
        if fault.is_some() && fault != question.fault {
            let blockers = self.report.unwrap_or_default().blockers;
            return self.prompt_for_enter(blockers);
        }
        if fault.is_some() {
            self.requests
                .push(HostRequest::Request(Request::ClearFault { fault }));
        }
        self.zeroing = question.zeroes;
        self.requests.push(match question.zeroes {
            true => HostRequest::Status,
            false => HostRequest::Request(Request::Arm),
        });
    }

    /// Returns the present lines for the user. Lines a second are limited, because a device's state
    /// may flicker; omitted lines are counted. An omitted question counts as not asked.
    pub(in crate::cli) fn lines(&mut self) -> Vec<String> {
        let now = Instant::now();
        let mut shown = vec![];
        for line in self.lines.drain(..) {
            let Some(omitted) = self.line_limit.admit(now) else {
                continue;
            };
            if omitted > 0 {
                shown.push(format!("({omitted} lines left out)"));
            }
            if line.question.is_some() {
                self.question = line.question;
                self.number = self.number.wrapping_add(1);
                self.enter.forget();
            }
            shown.push(line.text);
        }
        shown
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{Receiver, Sender, channel};

    impl Enter for Receiver<()> {
        fn forget(&mut self) {
            self.was_pressed();
        }

        fn was_pressed(&mut self) -> bool {
            self.try_iter().count() > 0
        }
    }

    fn with_user() -> (Sender<()>, ArmingPrompts) {
        let (press, enter) = channel();
        (press, ArmingPrompts::listening(enter))
    }

    fn not_zeroed() -> Report {
        Report {
            blockers: Blockers::NOT_ZEROED,
            ..Report::default()
        }
    }

    const REFUSED: Event<'static> = Event::Answered {
        request: &Request::Arm,
        result: Err(Refusal::Blocked(Blockers::NOT_ZEROED)),
    };

    /// Safety: 6.
    #[test]
    fn enter_before_the_question_is_no_answer() {
        let (press, mut prompts) = with_user();
        press.send(()).expect("listening");
        prompts.on_event(&Event::Guard(&not_zeroed()));
        prompts.on_event(&REFUSED);
        assert_eq!(prompts.requests(), []);
        // An Enter before the question is on the terminal is no answer either.
        press.send(()).expect("listening");
        assert!(prompts.lines().join("\n").contains("press Enter"));
        assert_eq!(prompts.requests(), []);
        press.send(()).expect("listening");
        assert_eq!(prompts.requests(), [HostRequest::Status]);
        // A question is answered only once.
        press.send(()).expect("listening");
        assert_eq!(prompts.requests(), []);
    }

    /// Safety: 28.
    #[test]
    fn answer_counts_for_the_question_it_names() {
        let mut prompts = ArmingPrompts::listening(NoEnter);
        prompts.on_event(&Event::Guard(&not_zeroed()));
        prompts.on_event(&REFUSED);
        assert_eq!(prompts.open_question(), None, "before it is shown");
        prompts.lines();
        let first = prompts.open_question().expect("a question");
        assert!(!prompts.answer(first.wrapping_add(1)));
        prompts.on_event(&REFUSED);
        prompts.lines();
        let second = prompts.open_question().expect("another");
        assert!(!prompts.answer(first), "one that was asked before");
        assert!(prompts.answer(second) && !prompts.answer(second));
        assert_eq!(prompts.requests(), [HostRequest::Status]);
    }

    /// Safety: 6.
    #[test]
    fn enter_pressed_before_a_fault_is_shown_does_not_clear_it() {
        let (press, mut prompts) = with_user();
        prompts.on_event(&Event::Guard(&not_zeroed()));
        prompts.on_event(&REFUSED);
        prompts.lines();
        press.send(()).expect("listening");
        let report = Report {
            fault: Some(Fault::EncoderJump),
            blockers: Blockers::FAULT_LATCHED,
            ..Report::default()
        };
        prompts.on_event(&Event::Guard(&report));
        assert_eq!(prompts.requests(), []);
        assert!(prompts.lines().join("\n").contains("EncoderJump"));
        press.send(()).expect("listening");
        let fault = report.fault;
        let expected = [Request::ClearFault { fault }, Request::Arm].map(HostRequest::Request);
        assert_eq!(prompts.requests(), expected);
    }

    /// Safety: 6.
    #[test]
    fn enter_arms_a_device_that_resumes_disarmed() {
        let (press, mut prompts) = with_user();
        let device = crate::link::hello();
        let resumed = true;
        let opened = Event::Opened {
            device: &device,
            resumed,
        };
        for (mode, asks) in [(Mode::Armed, false), (Mode::Disarmed, true)] {
            prompts.on_event(&opened);
            let report = Report {
                mode,
                ..Report::default()
            };
            prompts.on_event(&Event::Guard(&report));
            let reported = prompts.lines().join("\n");
            assert_eq!(reported.contains("press Enter to arm"), asks, "{reported}");
        }
        press.send(()).expect("listening");
        assert_eq!(prompts.requests(), [HostRequest::Request(Request::Arm)]);
    }

    #[test]
    fn flickering_state_does_not_flood_the_terminal() {
        let (_press, mut prompts) = with_user();
        let mut shown = 0;
        for flicker in 0..10_000 {
            let report = Report {
                fault: (flicker % 2 == 0).then_some(Fault::EncoderJump),
                ..Report::default()
            };
            prompts.on_event(&Event::Guard(&report));
            shown += prompts.lines().len();
        }
        // Far fewer than all lines, even if the test ran slowly.
        assert!((24..5_000).contains(&shown), "{shown} lines");
    }

    #[test]
    fn missing_zero_is_reported_and_enter_requests_status() {
        let (press, mut prompts) = with_user();
        prompts.on_event(&Event::Guard(&not_zeroed()));
        prompts.on_event(&REFUSED);
        let reported = prompts.lines().join("\n");
        assert!(
            reported.contains("NOT_ZEROED") && reported.contains("press Enter"),
            "{reported}"
        );
        assert_eq!(prompts.requests(), []);
        press.send(()).expect("listening");
        assert_eq!(prompts.requests(), [HostRequest::Status]);
    }

    #[test]
    fn scripted_run_reports_errors_without_prompts() {
        let mut prompts = ArmingPrompts::for_script();
        for mode in [Mode::Disarmed, Mode::Requested, Mode::Ramping, Mode::Armed] {
            let report = Report {
                mode,
                ..Report::default()
            };
            prompts.on_event(&Event::Guard(&report));
        }
        assert!(prompts.lines().is_empty());
        // A fault latched before this session.
        let report = Report {
            fault: Some(Fault::EncoderJump),
            ..Report::default()
        };
        prompts.on_event(&Event::Guard(&report));
        prompts.on_event(&Event::Unanswered(&HostRequest::Request(Request::Arm)));
        let reported = prompts.lines().join("\n");
        assert!(
            reported.contains("FAULT 3 EncoderJump") && reported.contains("does not answer"),
            "{reported}"
        );
        assert!(!reported.contains("Enter"), "{reported}");
    }

    #[test]
    fn dead_man_prompt_is_shown_once() {
        let (_press, mut prompts) = with_user();
        let waits = |more| Report {
            mode: Mode::Requested,
            blockers: Blockers::DEAD_MAN_RELEASED | more,
            ..Report::default()
        };
        prompts.on_event(&Event::Guard(&waits(Blockers::WATCHDOG_NOT_LIVE)));
        assert!(prompts.lines().is_empty());
        prompts.on_event(&Event::Guard(&waits(Blockers::empty())));
        let reported = prompts.lines().join("\n");
        assert!(reported.contains("press it"), "{reported}");
        prompts.on_event(&Event::Guard(&waits(Blockers::empty())));
        assert!(prompts.lines().is_empty());
    }

    #[test]
    fn fault_is_shown_once_and_enter_clears_it_and_arms() {
        let (press, mut prompts) = with_user();
        let report = Report {
            fault: Some(Fault::DeadManReleased),
            blockers: Blockers::FAULT_LATCHED,
            ..Report::default()
        };
        prompts.on_event(&Event::Guard(&report));
        assert!(
            prompts
                .lines()
                .join("\n")
                .contains("FAULT 6 DeadManReleased")
        );
        prompts.on_event(&Event::Guard(&report));
        assert!(prompts.lines().is_empty());
        press.send(()).expect("listening");
        let fault = report.fault;
        let expected = [Request::ClearFault { fault }, Request::Arm].map(HostRequest::Request);
        assert_eq!(prompts.requests(), expected);
    }
}
