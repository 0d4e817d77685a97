//! Arming while a terrain is served: says what keeps the arm from it, and takes
//! Enter for "go on": clear the fault, zero the arm, ask to arm.

use std::io::{BufRead, IsTerminal};
use std::sync::mpsc::{Receiver, channel};
use std::time::Instant;

use hapterra_core::guard::{Blockers, Mode, Report};
use hapterra_core::wire::request::{Refusal, Request};

use crate::cli::sparing::Sparing;
use crate::link::{Ask, Event};

/// More than an arm that is armed, faulted and armed again in a second needs.
const LINES_A_SECOND: u32 = 24;

/// Leads the user from disarmed to armed.
pub(in crate::cli) struct ArmingPrompts {
    enter: Receiver<()>,
    report: Option<Report>,
    /// Enter was pressed with the arm in its zero pose: its counts are asked for.
    zeroing: bool,
    say: Vec<Ask>,
    /// Whether there is a user who arms; a virtual hand follows its script.
    leads: bool,
    /// Lines for the user, in order.
    lines: Vec<String>,
    sparing: Sparing,
}

impl ArmingPrompts {
    /// For a virtual hand: only what is wrong is told.
    pub(in crate::cli) fn for_a_script() -> Self {
        let (_, nobody) = channel();
        Self {
            leads: false,
            ..Self::listening(nobody)
        }
    }

    /// Listens to the terminal, if there is one.
    pub(in crate::cli) fn at_the_terminal() -> Self {
        let (pressed, enter) = channel();
        if std::io::stdin().is_terminal() {
            std::thread::spawn(move || {
                for line in std::io::stdin().lock().lines() {
                    if line.is_err() || pressed.send(()).is_err() {
                        return;
                    }
                }
            });
        }
        Self::listening(enter)
    }

    fn listening(enter: Receiver<()>) -> Self {
        Self {
            enter,
            report: None,
            zeroing: false,
            say: vec![],
            leads: true,
            lines: vec![],
            sparing: Sparing::new(LINES_A_SECOND),
        }
    }

    /// Takes what the device tells.
    pub(in crate::cli) fn on_event(&mut self, event: &Event<'_>) {
        match event {
            Event::Guard(report) => self.on_guard_report(report),
            Event::Answered { request, result } => match (request, result) {
                (Request::Arm, Err(Refusal::Blocked(why))) => {
                    self.lines.push("not armed:".into());
                    self.name(*why);
                    self.ask_for_enter(*why);
                }
                // It is armed already, in the pose that it has.
                (Request::Zero { .. }, Err(Refusal::NotWhileArmed)) => {}
                (request, Err(refused)) => self.lines.push(format!("{request:?}: {refused}")),
                (_, Ok(())) => {}
            },
            Event::Unanswered(ask) => {
                self.zeroing &= **ask != Ask::Status;
                self.lines
                    .push(format!("the device does not answer: {ask:?} was given up"));
            }
            Event::Status(status) if self.zeroing => {
                self.zeroing = false;
                let counts = status.health.sense.counts;
                let requests = [Request::Zero { counts }, Request::Arm];
                self.say.extend(requests.map(Ask::Request));
                let [a, b, c] = counts;
                self.lines.push(format!("zeroed at {a} {b} {c} counts"));
            }
            _ => {}
        }
    }

    /// Says how the guard stands, where that is news.
    fn on_guard_report(&mut self, report: &Report) {
        let before = self.report.replace(*report);
        let news = |r: &Report| (r.mode, r.fault, r.blockers);
        if before.as_ref().map(news) == Some(news(report)) {
            return;
        }
        let was = before.and_then(|before| before.fault);
        if let Some(fault) = report.fault.filter(|_| was != report.fault) {
            let (number, meaning) = (fault.number(), fault.meaning());
            self.lines
                .push(format!("FAULT {number} {fault:?}: {meaning}"));
            self.lines.push(format!("  {}", fault.what_to_do()));
            return self.ask_for_enter(report.blockers);
        }
        match report.mode {
            _ if !self.leads => {}
            // What is in the way besides is refused, or gone, in a moment.
            Mode::Requested if Blockers::BY_HAND.contains(report.blockers) => {
                self.lines.push("ready to arm; waits for your hand:".into());
                self.name(report.blockers);
            }
            Mode::Confirming if report.blockers.contains(Blockers::FORCE_TOO_LARGE) => {
                let what = Blockers::FORCE_TOO_LARGE.meaning();
                self.lines.push(format!("held back: {what}"));
            }
            Mode::Ramping => self.lines.push("amplifiers on; force comes in".into()),
            Mode::Armed => self.lines.push("armed".into()),
            Mode::Disarmed if before.is_some_and(|before| before.mode.drives()) => {
                self.lines.push("disarmed; amplifiers off".into());
            }
            _ => {}
        }
    }

    /// Names what is in the way of arming, with what to do, a line each.
    fn name(&mut self, blockers: Blockers) {
        let lines = blockers.meanings();
        self.lines
            .extend(lines.map(|(name, meaning)| format!("  {name}: {meaning}")));
    }

    fn ask_for_enter(&mut self, why: Blockers) {
        if !self.leads {
            return;
        }
        self.lines.push(match why.contains(Blockers::NOT_ZEROED) {
            true => "put the arm into its zero pose, hold it there and press Enter".into(),
            false => "when that is seen to, press Enter to clear it and arm".into(),
        });
    }

    /// What is to be said to the device now.
    pub(in crate::cli) fn messages(&mut self) -> Vec<Ask> {
        // Where there is no terminal nobody presses anything.
        if self.enter.try_recv().is_ok() {
            let report = self.report.unwrap_or_default();
            if report.fault.is_some() {
                let seen = report.fault;
                self.say.push(Ask::Request(Request::ClearFault { seen }));
            }
            self.zeroing = report.blockers.contains(Blockers::NOT_ZEROED);
            self.say.push(match self.zeroing {
                true => Ask::Status,
                false => Ask::Request(Request::Arm),
            });
        }
        std::mem::take(&mut self.say)
    }

    /// What is to be said to the user now: a device whose state flickers gets so many
    /// lines a second, and the others are counted.
    pub(in crate::cli) fn lines(&mut self) -> Vec<String> {
        let now = Instant::now();
        let mut said = vec![];
        for line in self.lines.drain(..) {
            match self.sparing.admit(now) {
                Some(0) => said.push(line),
                Some(left_out) => said.extend([format!("({left_out} lines left out)"), line]),
                None => {}
            }
        }
        said
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hapterra_core::guard::Fault;

    #[test]
    fn a_device_whose_state_flickers_does_not_flood_the_terminal() {
        let (_press, enter) = channel();
        let mut prompts = ArmingPrompts::listening(enter);
        let mut said = 0;
        for flicker in 0..10_000 {
            let report = Report {
                fault: (flicker % 2 == 0).then_some(Fault::EncoderJump),
                ..Report::default()
            };
            prompts.on_event(&Event::Guard(&report));
            said += prompts.lines().len();
        }
        // However long this took, it was not ten thousand seconds.
        assert!((24..5_000).contains(&said), "{said} lines");
    }

    #[test]
    fn an_arm_that_is_not_zeroed_is_told_and_enter_asks_for_its_counts() {
        let (press, enter) = channel();
        let mut prompts = ArmingPrompts::listening(enter);
        let report = Report {
            blockers: Blockers::NOT_ZEROED,
            ..Report::default()
        };
        prompts.on_event(&Event::Guard(&report));
        prompts.on_event(&Event::Answered {
            request: &Request::Arm,
            result: Err(Refusal::Blocked(Blockers::NOT_ZEROED)),
        });
        let told = prompts.lines().join("\n");
        assert!(
            told.contains("NOT_ZEROED") && told.contains("press Enter"),
            "{told}"
        );
        assert_eq!(prompts.messages(), []);
        press.send(()).expect("listening");
        assert_eq!(prompts.messages(), [Ask::Status]);
    }

    #[test]
    fn with_a_script_what_is_wrong_is_told_and_nothing_else() {
        let mut prompts = ArmingPrompts::for_a_script();
        for mode in [Mode::Disarmed, Mode::Requested, Mode::Ramping, Mode::Armed] {
            let report = Report {
                mode,
                ..Report::default()
            };
            prompts.on_event(&Event::Guard(&report));
        }
        assert!(prompts.lines().is_empty());
        // A fault that was latched before this session.
        let report = Report {
            fault: Some(Fault::EncoderJump),
            ..Report::default()
        };
        prompts.on_event(&Event::Guard(&report));
        prompts.on_event(&Event::Unanswered(&Ask::Request(Request::Arm)));
        let told = prompts.lines().join("\n");
        assert!(
            told.contains("FAULT 3 EncoderJump") && told.contains("does not answer"),
            "{told}"
        );
        assert!(!told.contains("Enter"), "{told}");
    }

    #[test]
    fn that_it_waits_for_the_hand_is_told_once() {
        let (_press, enter) = channel();
        let mut prompts = ArmingPrompts::listening(enter);
        let waits = |more| Report {
            mode: Mode::Requested,
            blockers: Blockers::DEAD_MAN_RELEASED | more,
            ..Report::default()
        };
        prompts.on_event(&Event::Guard(&waits(Blockers::WATCHDOG_NOT_LIVE)));
        assert!(prompts.lines().is_empty());
        prompts.on_event(&Event::Guard(&waits(Blockers::empty())));
        let told = prompts.lines().join("\n");
        assert!(told.contains("press it"), "{told}");
        prompts.on_event(&Event::Guard(&waits(Blockers::empty())));
        assert!(prompts.lines().is_empty());
    }

    #[test]
    fn a_fault_is_told_once_and_enter_clears_it_and_arms() {
        let (press, enter) = channel();
        let mut prompts = ArmingPrompts::listening(enter);
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
        let seen = report.fault;
        let wanted = [Request::ClearFault { seen }, Request::Arm].map(Ask::Request);
        assert_eq!(prompts.messages(), wanted);
    }
}
