//! The runs of a segment: a host opens a session, arms, serves, and leaves or is killed, and a
//! fault begins in one of the steps.

use super::fault::{Fault, Kind};
use super::host::{End, Reported, SILENCE_S};
use super::not_a_device;
use super::run_outcomes::{LinkStats, Outcome};
use super::segment::Segment;
use crate::campaign::arm::HandMotion;
use hapterra_core::guard::Mode;

/// Time that a session may take to open or to fail, ms.
const OPENS: u64 = 8_500;
/// Time that an answer to arming may take, or the report that there is none, ms.
const ANSWERS: u64 = 6_000;
/// Time that closing may take, ms.
const LEAVES: u64 = 3_500;
/// Time from the press of the switch to the full force, ms.
const ARMS: u64 = 2_600;
/// Reaction time of the user at the switch, ms.
const REACTION: u64 = 150;
/// Time that a host may be silent, as configured by these hosts, ms.
const SILENCE: u64 = 1_000 * SILENCE_S as u64;
/// Time that the force may then take to fade, ms.
const RELEASE_TICKS: u64 = 300;
/// Largest time from the last message at the device to the loss of its host, ms: heartbeats are
/// sent twice a second, and a faulty line may lose some.
const MAX_AGE: u64 = 700;
/// Tile requests that a device may repeat early in a session: those in transit when it began.
const IN_FLIGHT: u32 = 4;

/// The steps of a run in which a fault may begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Open,
    Arm,
    Touch,
    Close,
}

/// Injected faults of a run, with their steps.
struct Plan {
    kind: Kind,
    step: Step,
    /// Milliseconds from the start of the step to the fault.
    after: u64,
    done: bool,
}

/// Plays a run with a fault of this kind.
///
/// # Errors
/// The broken invariant.
pub fn run(segment: &mut Segment<'_>, kind: Kind, stats: &mut LinkStats) -> Result<(), String> {
    if kind == Kind::HostileDevice {
        let outcome = not_a_device::run_against_other_program(segment)?;
        stats.count(kind, outcome);
        return Ok(());
    }
    // A run that ended before its fault is not counted, for example because its host left a
    // disarmed device.
    loop {
        if let Some(outcome) = try_run(segment, kind)? {
            stats.count(kind, outcome);
            return Ok(());
        }
    }
}

/// Plays a run. Returns its outcome, if the planned fault happened.
fn try_run(segment: &mut Segment<'_>, kind: Kind) -> Result<Option<Outcome>, String> {
    let steps = [Step::Open, Step::Arm, Step::Touch, Step::Close];
    let step = steps[segment.random.below(4)];
    // A session closes when the force has faded, within a tenth of a second.
    let within = if step == Step::Close { 90 } else { 400 };
    let plan = Plan {
        kind,
        step,
        after: segment.random.below(within) as u64,
        done: false,
    };
    let other_scene = segment.random.below(2) == 0;
    segment.start_host(other_scene);
    let mut run = Run {
        segment,
        plan,
        is_whole: true,
    };
    let outcome = run.play()?;
    run.release_switch()?;
    Ok(run.plan.done.then_some(outcome))
}

struct Run<'s, 't> {
    segment: &'s mut Segment<'t>,
    plan: Plan,
    /// True if one host was connected to one device all the time, so that counts must be exact.
    is_whole: bool,
}

impl Run<'_, '_> {
    fn play(&mut self) -> Result<Outcome, String> {
        let mut outcome = self.steps()?;
        // After a killed host another one completes the run.
        while outcome == Outcome::Killed && self.plan.kind == Kind::HostKilled {
            let other_scene = self.segment.random.below(2) == 0;
            self.segment.start_host(other_scene);
            self.is_whole = true;
            outcome = self.steps()?;
        }
        Ok(outcome)
    }

    /// Runs all steps, or up to the end of the run.
    fn steps(&mut self) -> Result<Outcome, String> {
        for step in [Step::Open, Step::Arm, Step::Touch, Step::Close] {
            if let Some(outcome) = self.take(step)? {
                return Ok(outcome);
            }
        }
        Err("a host that left did not end".into())
    }

    /// Runs one step. Returns the outcome if the run ended.
    fn take(&mut self, step: Step) -> Result<Option<Outcome>, String> {
        let began = self.segment.now;
        let feels = 1_000 + self.segment.random.below(5_000) as u64;
        let mut pressed = None;
        match step {
            Step::Arm => self.segment.with_host(|host, _, _| host.arm()),
            Step::Close => self
                .segment
                .with_host(|host, now, out| host.leave(now, out)),
            Step::Open | Step::Touch => {}
        }
        loop {
            let at = self.segment.now - began;
            if let Some(outcome) = self.inject_fault(step, at)? {
                return Ok(Some(outcome));
            }
            self.segment.step()?;
            let Some(host) = &self.segment.host else {
                return Ok(Some(Outcome::Killed));
            };
            if host.end.is_some() {
                return self.check_end().map(Some);
            }
            let (is_done, max_ms) = match step {
                Step::Open => (host.opened, OPENS),
                Step::Arm => (self.is_armed(&mut pressed), ANSWERS + ARMS),
                Step::Touch => (at >= feels, u64::MAX),
                Step::Close => (false, LEAVES),
            };
            if is_done && self.can_continue(step) {
                return Ok(None);
            }
            if at >= max_ms && !is_done {
                return Err(format!("{step:?} hangs: nothing for {at} ms"));
            }
        }
    }

    /// Returns true if the fault planned for this step, if any, has been injected.
    fn can_continue(&self, step: Step) -> bool {
        self.plan.done || self.plan.step != step
    }

    /// Returns true if arming has ended: the user read that the device does not arm, or sees it
    /// disarmed, or the force is ramped up. Presses the switch when the user sees the request.
    fn is_armed(&mut self, pressed: &mut Option<u64>) -> bool {
        let now = self.segment.now;
        let Some(host) = &self.segment.host else {
            return false;
        };
        if host.is_waiting_for_press() {
            let since = *pressed.get_or_insert(now);
            self.segment.board.dead_man = now >= since + REACTION;
        }
        let settled = pressed.is_some_and(|at| now >= at + ARMS);
        if settled {
            self.segment.board.hand_motion = HandMotion::Wander;
        }
        match host.reported {
            Reported::Nothing => false,
            Reported::No => true,
            Reported::Accepted => {
                settled || (pressed.is_some() && host.is_in_mode(&[Mode::Disarmed]))
            }
        }
    }

    /// Injects the planned fault when it is due.
    fn inject_fault(&mut self, step: Step, at: u64) -> Result<Option<Outcome>, String> {
        if self.plan.done || step != self.plan.step || at < self.plan.after {
            return Ok(None);
        }
        self.plan.done = true;
        let segment = &mut *self.segment;
        match self.plan.kind {
            Kind::HostKilled => {
                segment.kill_host();
                self.wait(1_500)?;
                return Ok(Some(Outcome::Killed));
            }
            Kind::HostVanishes => {
                segment.kill_host();
                self.check_vanished_host()?;
                return Ok(Some(Outcome::Killed));
            }
            Kind::HostileHost => {
                self.is_whole = false;
                let fault = Fault::of(Kind::HostileHost, segment.now, &mut segment.random);
                segment.begin(fault);
                if segment.random.below(2) == 0 {
                    segment.kill_host();
                    self.wait_until(fault.end)?;
                    return Ok(Some(Outcome::Killed));
                }
            }
            Kind::DeviceRestarted => {
                self.is_whole = false;
                segment.restart_device();
            }
            kind => {
                let fault = Fault::of(kind, segment.now, &mut segment.random);
                segment.begin(fault);
            }
        }
        Ok(None)
    }

    /// Waits up to `max_ms` milliseconds without a host.
    fn wait(&mut self, max_ms: usize) -> Result<(), String> {
        let end = self.segment.now + self.segment.random.below(max_ms) as u64;
        self.wait_until(end)
    }

    fn wait_until(&mut self, end: u64) -> Result<(), String> {
        while self.segment.now < end {
            self.segment.step()?;
        }
        Ok(())
    }

    /// Waits without a host for longer than the device's limit: it must release the force and
    /// disarm, but not earlier.
    fn check_vanished_host(&mut self) -> Result<(), String> {
        let was_on = self.segment.board.drive.enabled;
        // A stopped clock does not reach the limit.
        let runs = !self.segment.board.lock_step;
        self.wait_until(self.segment.now + SILENCE - RELEASE_TICKS)?;
        let still_on = self.segment.board.drive.enabled;
        self.wait_until(self.segment.now + 2 * RELEASE_TICKS + MAX_AGE)?;
        let segment = &mut *self.segment;
        if runs && was_on && segment.board.drive.enabled {
            return Err("the arm is armed, and its host has vanished".into());
        }
        segment.let_go = runs && was_on && still_on;
        Ok(())
    }

    /// Checks the report of a host that ended against the truth.
    fn check_end(&mut self) -> Result<Outcome, String> {
        let segment = &mut *self.segment;
        if let Some(End::Reported(error)) = segment.host.as_ref().and_then(|host| host.end.as_ref())
        {
            return Ok(Outcome::Reported(error.to_string()));
        }
        if segment.board.drive.enabled {
            return Err("an end was agreed on, and the amplifiers are on".into());
        }
        self.check_counts()?;
        Ok(Outcome::Agreed)
    }

    fn check_counts(&self) -> Result<(), String> {
        let Some(host) = &self.segment.host else {
            return Ok(());
        };
        let (stats, tap) = (host.stats(), &self.segment.tap);
        let (reported, made) = (
            stats.samples + stats.lost + stats.dropped,
            tap.samples_made(),
        );
        // The tap does not see samples that are dropped at the end of a scene or of the session.
        let unseen = match stats.dropped {
            0 => 0,
            _ => tap.max_unsent(self.segment.board.ticks[0]),
        };
        if self.is_whole && !(made..=made + unseen).contains(&reported) {
            return Err(format!(
                "{made} samples were made, {} received, {} lost and {} dropped: {reported}",
                stats.samples, stats.lost, stats.dropped
            ));
        }
        match tap.early <= IN_FLIGHT {
            true => Ok(()),
            false => Err(format!(
                "{} requests for tiles were repeated early",
                tap.early
            )),
        }
    }

    /// The user releases the switch and waits a moment.
    fn release_switch(&mut self) -> Result<(), String> {
        self.segment.host = None;
        self.segment.board.dead_man = false;
        self.segment.board.hand_motion = HandMotion::Lifted;
        self.segment.step()?;
        self.wait(1_000)
    }
}
