//! The runs of a stretch: a host opens a session, arms, serves, and leaves or is killed,
//! and somewhere in between something goes wrong.

use super::fault::{Fault, Kind};
use super::host::{End, SILENCE_S, Told};
use super::not_a_device;
use super::run_outcomes::{LinkStats, Outcome};
use super::segment::Segment;
use crate::campaign::arm::Mood;
use hapterra_core::guard::Mode;

/// Time that a session may take to open or to fail, ms.
const OPENS: u64 = 8_500;
/// Time that the answer to arming, or the word that there is none, may take, ms.
const ANSWERS: u64 = 6_000;
/// Time that leaving may take, ms.
const LEAVES: u64 = 3_500;
/// Time that the arm takes from the press of the switch until all force is in, ms.
const ARMS: u64 = 2_600;
/// Time that the user's hand takes to the switch, ms.
const REACTION: u64 = 150;
/// For how long a host may be silent, as hosts here tell the device, ms.
const SILENCE: u64 = 1_000 * SILENCE_S as u64;
/// Time that after that the force may take to be out, ms.
const LETS_GO: u64 = 300;
/// Time for which before a host vanished the device may have heard it last, ms: a sign of life
/// comes twice a second, and a line that was harmed may have lost some.
const AGO: u64 = 700;
/// Requests for a tile that a device may repeat early in a session: those that were under
/// way when it began.
const IN_FLIGHT: u32 = 4;

/// The steps of a run in which something may begin to go wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    Open,
    Arm,
    Feel,
    Leave,
}

/// Injected faults of a run, with their steps.
struct Plan {
    kind: Kind,
    step: Step,
    /// Milliseconds after the step begins.
    after: u64,
    done: bool,
}

/// Plays a run in which a fault of this kind happens.
///
/// # Errors
/// The broken invariant.
pub fn run(segment: &mut Segment<'_>, kind: Kind, tally: &mut LinkStats) -> Result<(), String> {
    if kind == Kind::HostileDevice {
        let outcome = not_a_device::meet(segment)?;
        tally.count(kind, outcome);
        return Ok(());
    }
    // A run that ended before anything went wrong in it, as one whose host left a device
    // that was disarmed, is not counted.
    loop {
        if let Some(outcome) = try_run(segment, kind)? {
            tally.count(kind, outcome);
            return Ok(());
        }
    }
}

/// Plays a run; how it ended, if what was planned for it happened.
fn try_run(segment: &mut Segment<'_>, kind: Kind) -> Result<Option<Outcome>, String> {
    let steps = [Step::Open, Step::Arm, Step::Feel, Step::Leave];
    let step = steps[segment.random.below(4)];
    // A host that leaves is gone when the force is out, in a tenth of a second.
    let within = if step == Step::Leave { 90 } else { 400 };
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
    run.afterwards()?;
    Ok(run.plan.done.then_some(outcome))
}

struct Run<'s, 't> {
    segment: &'s mut Segment<'t>,
    plan: Plan,
    /// True if one host has talked to one device all the time, so that counts can be
    /// exact.
    is_whole: bool,
}

impl Run<'_, '_> {
    fn play(&mut self) -> Result<Outcome, String> {
        let mut outcome = self.steps()?;
        // A host that was killed has one after it, which goes all the way.
        while outcome == Outcome::Killed && self.plan.kind == Kind::HostKilled {
            let other_scene = self.segment.random.below(2) == 0;
            self.segment.start_host(other_scene);
            self.is_whole = true;
            outcome = self.steps()?;
        }
        Ok(outcome)
    }

    /// All steps, as far as they go.
    fn steps(&mut self) -> Result<Outcome, String> {
        for step in [Step::Open, Step::Arm, Step::Feel, Step::Leave] {
            if let Some(outcome) = self.take(step)? {
                return Ok(outcome);
            }
        }
        Err("a host that left did not end".into())
    }

    /// One step: how the run ended, if it did.
    fn take(&mut self, step: Step) -> Result<Option<Outcome>, String> {
        let began = self.segment.now;
        let feels = 1_000 + self.segment.random.below(5_000) as u64;
        let mut pressed = None;
        match step {
            Step::Arm => self.segment.with_host(|host, _, _| host.arm()),
            Step::Leave => self
                .segment
                .with_host(|host, now, out| host.leave(now, out)),
            Step::Open | Step::Feel => {}
        }
        loop {
            let at = self.segment.now - began;
            if let Some(outcome) = self.go_wrong(step, at)? {
                return Ok(Some(outcome));
            }
            self.segment.step()?;
            let Some(host) = &self.segment.host else {
                return Ok(Some(Outcome::Killed));
            };
            if host.end.is_some() {
                return self.ended().map(Some);
            }
            let (is_done, most) = match step {
                Step::Open => (host.opened, OPENS),
                Step::Arm => (self.is_armed(&mut pressed), ANSWERS + ARMS),
                Step::Feel => (at >= feels, u64::MAX),
                Step::Leave => (false, LEAVES),
            };
            if is_done && self.may_go_on(step) {
                return Ok(None);
            }
            if at >= most && !is_done {
                return Err(format!("{step:?} hangs: nothing for {at} ms"));
            }
        }
    }

    /// Carries out the plan of a step.
    fn may_go_on(&self, step: Step) -> bool {
        self.plan.done || self.plan.step != step
    }

    /// Returns true if arming has come to its end: the user got a message that it does not come to
    /// that, or sees that the arm is disarmed, or the force is in. Presses the switch
    /// where the user sees that it is waited for.
    fn is_armed(&mut self, pressed: &mut Option<u64>) -> bool {
        let now = self.segment.now;
        let Some(host) = &self.segment.host else {
            return false;
        };
        if host.waits_for_the_hand() {
            let since = *pressed.get_or_insert(now);
            self.segment.board.dead_man = now >= since + REACTION;
        }
        let settled = pressed.is_some_and(|at| now >= at + ARMS);
        if settled {
            self.segment.board.mood = Mood::Wanders;
        }
        match host.told {
            Told::Nothing => false,
            Told::No => true,
            Told::Accepted => settled || (pressed.is_some() && host.sees(&[Mode::Disarmed])),
        }
    }

    /// Lets what was planned happen when its time has come.
    fn go_wrong(&mut self, step: Step, at: u64) -> Result<Option<Outcome>, String> {
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
                self.vanished()?;
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

    /// Up to so many milliseconds with no host.
    fn wait(&mut self, most: usize) -> Result<(), String> {
        let end = self.segment.now + self.segment.random.below(most) as u64;
        self.wait_until(end)
    }

    fn wait_until(&mut self, end: u64) -> Result<(), String> {
        while self.segment.now < end {
            self.segment.step()?;
        }
        Ok(())
    }

    /// No host for longer than the device waits for one: force is let out, and the arm
    /// disarmed; not before.
    fn vanished(&mut self) -> Result<(), String> {
        let was_on = self.segment.board.drive.enabled;
        // Time that stands still does not run out.
        let runs = !self.segment.board.lock_step;
        self.wait_until(self.segment.now + SILENCE - LETS_GO)?;
        let still_on = self.segment.board.drive.enabled;
        self.wait_until(self.segment.now + 2 * LETS_GO + AGO)?;
        let segment = &mut *self.segment;
        if runs && was_on && segment.board.drive.enabled {
            return Err("the arm is armed, and its host has vanished".into());
        }
        segment.let_go = runs && was_on && still_on;
        Ok(())
    }

    /// Judges the end of a host: what it says has to be so.
    fn ended(&mut self) -> Result<Outcome, String> {
        let segment = &mut *self.segment;
        if let Some(End::Told(error)) = segment.host.as_ref().and_then(|host| host.end.as_ref()) {
            return Ok(Outcome::Told(error.to_string()));
        }
        if segment.board.drive.enabled {
            return Err("an end was agreed on, and the amplifiers are on".into());
        }
        self.counts()?;
        Ok(Outcome::Agreed)
    }

    fn counts(&self) -> Result<(), String> {
        let Some(host) = &self.segment.host else {
            return Ok(());
        };
        let (tally, tap) = (host.tally(), &self.segment.tap);
        let (told, made) = (tally.samples + tally.lost + tally.dropped, tap.made());
        // What is dropped last of all, or last of a scene, no tap sees.
        let unseen = match tally.dropped {
            0 => 0,
            _ => tap.unseen(self.segment.board.ticks[0]),
        };
        if self.is_whole && !(made..=made + unseen).contains(&told) {
            return Err(format!(
                "{made} samples were made, {} received, {} lost and {} dropped: {told}",
                tally.samples, tally.lost, tally.dropped
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

    /// The user lets the arm go and waits a moment.
    fn afterwards(&mut self) -> Result<(), String> {
        self.segment.host = None;
        self.segment.board.dead_man = false;
        self.segment.board.mood = Mood::Lifted;
        self.segment.step()?;
        self.wait(1_000)
    }
}
