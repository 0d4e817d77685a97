//! `hapterra bringup` with a virtual arm: without faults, and with common mistakes in wires, plugs
//! and numbers. Each is named, and no joint moves faster than stated.

use std::cell::RefCell;

use hapterra::bringup::{
    Attendant, BenchMistakes, BringupError, Finding, Identity, Log, Question, Reading, SequenceEnd,
    Step, Stopped, Task, VirtualBench, VirtualUser, run_sequence,
};
use hapterra::link::{ControlSession, Native};
use hapterra::phantom::{PhantomModel, Wiring};
use hapterra_core::guard::{Blockers, Jog, MAX_JOG_SPEED_RAD_S};
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::request::{Refusal, Request};
use hapterra_firmware::native::StoppedClock;
use hapterra_tests::newest_log;
use hapterra_tests::timeouts::HANG;

const RECORD: Calibration = Calibration::PREMIUM_1_5;
/// Excess over the guard's limit due to its delay and error: two counts in a millisecond, and the
/// motion from a motor's torque until its current is off.
const LATE_RAD_S: f64 = 0.3;

thread_local! {
    /// Messages, one a line.
    static PRINTED: RefCell<String> = const { RefCell::new(String::new()) };
}

fn print_line(line: &str) {
    println!("{line}");
    PRINTED.with_borrow_mut(|text| *text += &format!("{line}\n"));
}

/// Runs the walk with a user, and checks the speeds of the joints.
fn run_bringup(
    user: &mut VirtualUser,
    record: Calibration,
    log: &mut Log,
) -> Result<(), BringupError> {
    let result = run_unchecked(user, record, log);
    let fastest = user.bench().borrow().max_rate_rad_s();
    println!("fastest {fastest:?} rad/s");
    let limit = f64::from(MAX_JOG_SPEED_RAD_S) + LATE_RAD_S;
    assert!(fastest.iter().all(|speed| *speed < limit), "{fastest:?}");
    result
}

/// Runs the walk with a user from the end of a log; the board is power-cycled where the steps
/// require it.
fn run_unchecked(
    user: &mut VirtualUser,
    record: Calibration,
    log: &mut Log,
) -> Result<(), BringupError> {
    PRINTED.take();
    loop {
        let device = user.device(record);
        match run_once(user, device, log) {
            Ok(SequenceEnd::BoardPoweredOff) => {}
            Ok(SequenceEnd::Complete) => return Ok(()),
            Err(error) => return Err(error),
        }
    }
}

fn run_once(
    user: &mut dyn Attendant,
    device: Native<StoppedClock>,
    log: &mut Log,
) -> Result<SequenceEnd, BringupError> {
    let opened = ControlSession::open(Box::new(device), HANG);
    run_sequence(&mut opened.expect("it answers"), user, log, &mut |_| Ok(()))
}

/// Returns the transcript for a user without mistakes.
fn transcript() -> String {
    std::fs::read_to_string(newest_log("bring-up-transcript.txt")).expect("a transcript")
}

/// Returns the step and the finding at which a walk with this bench and record ends.
fn found(bench: VirtualBench, record: Calibration) -> (Step, Finding) {
    found_from(Step::Board, bench, record)
}

/// Same as `found`, with all steps before this one passed earlier.
fn found_from(from: Step, bench: VirtualBench, record: Calibration) -> (Step, Finding) {
    let mut user = VirtualUser::at(bench);
    user.print = print_line;
    let mut log = Log::default();
    let opened = ControlSession::open(Box::new(user.device(record)), HANG);
    let opened = opened.expect("it answers");
    _ = log.update_identity(Identity::of(opened.device(), Some(&record)));
    for step in Step::ALL.into_iter().filter(|step| *step < from) {
        log.add(step, true, String::new());
    }
    let result = run_bringup(&mut user, record, &mut log);
    let Err(BringupError::Found { step, finding }) = result else {
        panic!("{result:?}");
    };
    // The log records it, and the next start is at this step.
    assert_eq!(log.next(), Some(step));
    let last = log.entries.last().expect("an entry");
    assert_eq!((last.step, last.passed), (step, false));
    assert_eq!(last.result, finding.to_string());
    assert!(!finding.remedy().is_empty());
    (step, finding)
}

fn wired(wiring: Wiring) -> VirtualBench {
    VirtualBench::new(PhantomModel::premium_1_5(), wiring)
}

#[test]
fn correct_arm_completes_every_step() {
    let mut user = VirtualUser::new(Wiring::RIGHT);
    user.print = print_line;
    let mut log = Log::default();
    run_bringup(&mut user, RECORD, &mut log).expect("to the end");
    assert_eq!(log.next(), None);
    assert_eq!(log.entries.len(), Step::ALL.len());
    assert_eq!(PRINTED.take(), transcript());
}

#[test]
fn bringup_resumes_and_repeats_steps_of_a_changed_record() {
    let mut user = VirtualUser::new(Wiring::RIGHT.with_gain(1, -1.0));
    user.print = print_line;
    let mut log = Log::default();
    run_bringup(&mut user, RECORD, &mut log).expect_err("the sign is inverted");
    assert_eq!(log.next(), Some(Step::Motor2));
    let error = PRINTED.take() + "error: " + &log.entries.last().expect("one").result + "\n";
    assert!(error.contains("step 8 of 11: motor 2"));
    // The next start is at this step, and the arm must be zeroed again.
    let result = run_bringup(&mut user, RECORD, &mut log);
    assert!(result.is_err());
    let text = PRINTED.take();
    assert!(
        text.starts_with("step 8 of 11") && text.contains("zero pose"),
        "{text}"
    );
    // With the reported sign the record changes, so it is measured again.
    let mut record = RECORD;
    record.motor_sign.y = -1.0;
    run_bringup(&mut user, record, &mut log).expect("to the end");
    let text = PRINTED.take();
    assert!(text.starts_with("the calibration has changed"), "{text}");
    assert!(text.contains("step 6 of 11") && !text.contains("step 5 of 11"));
}

/// A user who does some tasks and answers some questions differently.
struct OtherUser {
    user: VirtualUser,
    /// Response to a task.
    does: fn(Task) -> Task,
    /// Fixed answer to a question, if any.
    answers: fn(Question) -> Option<bool>,
}

impl OtherUser {
    fn new(user: VirtualUser) -> Self {
        Self {
            user,
            does: |task| task,
            answers: |_| None,
        }
    }

    /// Never holds the tip at a motor's first jog.
    fn without_hold(user: VirtualUser) -> Self {
        Self {
            does: |task| match task {
                Task::HoldLoosely => Task::ReleaseTip,
                task => task,
            },
            ..Self::new(user)
        }
    }

    /// Has amplifiers without ready lines.
    fn without_ready(user: VirtualUser) -> Self {
        Self {
            answers: |question| (question == Question::ReadyIsWired).then_some(false),
            ..Self::new(user)
        }
    }
}

impl Attendant for OtherUser {
    fn notify(&mut self, line: &str) {
        self.user.notify(line);
    }

    fn begin(&mut self, task: Task) {
        self.user.begin(task);
    }

    fn finish(&mut self, task: Task) -> Result<(), Stopped> {
        self.user.finish((self.does)(task))
    }

    fn read(&mut self, reading: Reading) -> Result<f64, Stopped> {
        self.user.read(reading)
    }

    fn confirm(&mut self, question: Question) -> Result<bool, Stopped> {
        match (self.answers)(question) {
            Some(answer) => Ok(answer),
            None => self.user.confirm(question),
        }
    }

    fn time_s(&self, board_ms: f64) -> f64 {
        self.user.time_s(board_ms)
    }
}

/// Returns the finding of the first step if the board has these mistakes.
fn found_of_the_board(mistakes: BenchMistakes) -> (Step, Finding) {
    found(wired(Wiring::RIGHT).with_mistakes(mistakes), RECORD)
}

/// Safety: images, bring-up.
#[test]
fn wrong_tick_rate_of_the_board_is_named() {
    for clock_slow_by in [0.05, -0.05, 0.5, -1.0] {
        let slow = BenchMistakes {
            clock_slow_by,
            ..BenchMistakes::default()
        };
        let (step, finding) = found_of_the_board(slow);
        assert_eq!(step, Step::Board);
        assert!(
            matches!(finding, Finding::WrongTickRate { .. }),
            "{clock_slow_by}: {finding}"
        );
    }
    // The chips' own oscillators may be off by one per cent.
    let slow = BenchMistakes {
        clock_slow_by: 0.01,
        output_offset_v: [1.0; 3],
        ..BenchMistakes::default()
    };
    let (step, _) = found_of_the_board(slow);
    assert_eq!(step, Step::Outputs);
}

/// Safety: images, bring-up.
#[test]
fn unlocked_usb_clock_is_named() {
    let unlocked = BenchMistakes {
        usb_clock_unlocked: true,
        ..BenchMistakes::default()
    };
    let found = found_of_the_board(unlocked);
    assert_eq!(found, (Step::Board, Finding::UsbClockUnlocked));
}

/// Safety: 16, bring-up.
#[test]
fn unheld_arm_is_stopped_at_the_jog_speed_limit() {
    // On an arm without weight, the other joints keep their positions.
    let mut model = PhantomModel::premium_1_5();
    model.gravity_m_s2 = 0.0;
    for gain in [1.0, -1.0] {
        let wiring = Wiring::RIGHT.with_gain(0, gain);
        let mut user = OtherUser::without_hold(VirtualUser::at(VirtualBench::new(model, wiring)));
        user.user.print = print_line;
        PRINTED.take();
        let mut log = Log::default();
        let mut result = Ok(SequenceEnd::BoardPoweredOff);
        while let Ok(SequenceEnd::BoardPoweredOff) = result {
            let device = user.user.device(RECORD);
            result = run_once(&mut user, device, &mut log);
        }
        let text = PRINTED.take();
        assert!(text.contains("the jog ended with fault 22"), "{text}");
        let fastest = user.user.bench().borrow().max_rate_rad_s();
        println!("fastest {fastest:?} rad/s");
        let limit = f64::from(MAX_JOG_SPEED_RAD_S) + LATE_RAD_S;
        assert!(fastest[0] < limit, "{fastest:?}");
        // The direction of its motion is still reported.
        let inverted = log
            .entries
            .iter()
            .any(|entry| entry.result.contains("inverted"));
        assert_eq!(inverted, gain < 0.0, "{log:?}");
    }
}

/// Safety: bring-up.
#[test]
fn wrongly_scaled_amplifier_is_named() {
    for (gain, axis, step) in [(0.4, 0, Step::Motor1), (2.0, 1, Step::Motor2)] {
        let wiring = Wiring::RIGHT.with_gain(axis, gain);
        let (_, finding) = found_from(step, wired(wiring), RECORD);
        let Finding::WrongTorque {
            motor,
            found,
            record,
        } = finding
        else {
            panic!("{finding}");
        };
        assert_eq!(motor, axis + 1);
        let factor = found / record;
        assert!((factor / gain - 1.0).abs() < 0.3, "{gain}: {factor}");
    }
}

/// Safety: bring-up.
#[test]
fn wrong_gravity_record_is_named() {
    // It is detected before the arm is as fast as in a jog: `run_bringup` checks that.
    for gravity_2_nm in [0.03, 0.1, -0.06, -0.1] {
        let record = Calibration {
            gravity_2_nm,
            ..RECORD
        };
        let (step, finding) = found_from(Step::Gravity, wired(Wiring::RIGHT), record);
        assert_eq!(step, Step::Gravity);
        let moves = matches!(finding, Finding::MovesByItself { .. });
        assert!(moves, "{finding}");
    }
}

/// Safety: 16, bring-up.
#[test]
fn swapped_motors_are_named() {
    let (step, finding) = found_from(Step::Motor1, wired(Wiring::RIGHT.swapped(1, 2)), RECORD);
    assert_eq!(step, Step::Motor2);
    assert_eq!(finding, Finding::SwappedMotors { motor: 2, joint: 3 });
}

/// Safety: 16, bring-up.
#[test]
fn inverted_motor_is_named() {
    for (axis, step) in [Step::Motor1, Step::Motor2, Step::Motor3]
        .into_iter()
        .enumerate()
    {
        let wiring = Wiring::RIGHT.with_gain(axis, -1.0);
        let (at, finding) = found_from(step, wired(wiring), RECORD);
        assert_eq!(at, step);
        let motor = axis + 1;
        assert_eq!(finding, Finding::InvertedMotor { motor, right: -1 });
        let hint = format!("--set motor-sign-{motor}=-1");
        assert!(finding.remedy().contains(&hint));
    }
}

/// Safety: bring-up.
#[test]
fn dead_encoder_is_named() {
    for axis in 0..3 {
        let (step, finding) = found(wired(Wiring::RIGHT.with_dead_encoder(axis)), RECORD);
        assert_eq!(step, Step::Encoders);
        let (joint, counts) = (axis + 1, 0);
        assert_eq!(finding, Finding::DeadEncoder { joint, counts });
    }
}

/// Safety: bring-up.
#[test]
fn wrong_ratio_is_named() {
    let mut model = PhantomModel::premium_1_5();
    model.drive[1].ratio *= 0.8;
    let (step, finding) = found(VirtualBench::new(model, Wiring::RIGHT), RECORD);
    assert_eq!(step, Step::Calibration);
    let Finding::WrongRatio {
        joint: 2,
        record,
        found,
    } = finding
    else {
        panic!("{finding}");
    };
    assert!((record - 11.2).abs() < 1e-4 && (found - 8.96).abs() < 0.1);
}

/// Returns the step and the finding at which a walk ends if the bench has these mistakes.
fn found_at(from: Step, mistakes: BenchMistakes) -> (Step, Finding) {
    found_from(from, wired(Wiring::RIGHT).with_mistakes(mistakes), RECORD)
}

/// Safety: bring-up.
#[test]
fn miswired_emergency_stop_is_named() {
    let normally_open = BenchMistakes {
        stop_normally_open: true,
        ..BenchMistakes::default()
    };
    let (step, finding) = found_at(Step::Board, normally_open);
    assert_eq!(step, Step::Switches);
    assert_eq!(finding, Finding::NotDetected(Task::ReleaseStop));
    let for_the_board_alone = BenchMistakes {
        stop_leaves_power: true,
        ..BenchMistakes::default()
    };
    let (step, finding) = found_at(Step::FirstTouch, for_the_board_alone);
    assert_eq!(
        (step, finding),
        (Step::FirstTouch, Finding::StopLeavesPower)
    );
}

/// Safety: bring-up.
#[test]
fn enable_line_without_pull_down_is_named() {
    let floats = BenchMistakes {
        enable_floats: true,
        ..BenchMistakes::default()
    };
    let (step, finding) = found_at(Step::Board, floats);
    assert_eq!(
        (step, finding),
        (Step::EnableLine, Finding::EnableHigh(3.3))
    );
}

/// Safety: bring-up.
#[test]
fn grounded_ready_input_is_named() {
    for axis in 0..3 {
        let mut mistakes = BenchMistakes::default();
        mistakes.ready_grounded[axis] = true;
        let (step, finding) = found_at(Step::Board, mistakes);
        assert_eq!(step, Step::EnableLine);
        assert_eq!(finding, Finding::NotDetected(Task::PullReadyWire(axis)));
        assert!(finding.remedy().contains("tied to ground"), "{finding}");
    }
}

/// Safety: bring-up.
#[test]
fn output_offset_is_named_at_the_amplifier_input() {
    for axis in 0..3 {
        let off = |volts| {
            let mut mistakes = BenchMistakes::default();
            mistakes.output_offset_v[axis] = volts;
            mistakes
        };
        let (step, finding) = found_at(Step::Board, off(0.5));
        assert_eq!(step, Step::Outputs);
        let named = matches!(
            finding,
            Finding::Output { axis: found, found: volts, expected, .. }
                if found == axis + 1 && (volts, expected) == (0.5, 0.0)
        );
        assert!(named, "{finding}");
        // A stage with resistors of one per cent passes.
        let mut log = Log::default();
        let bench = wired(Wiring::RIGHT).with_mistakes(off(0.3));
        run_bringup(&mut VirtualUser::at(bench), RECORD, &mut log).expect("to the end");
    }
}

/// Safety: bring-up.
#[test]
fn missing_amplifier_is_named_before_any_motor() {
    for axis in 0..3 {
        let mut mistakes = BenchMistakes::default();
        mistakes.amplifier_missing[axis] = true;
        for (from, at) in [
            (Step::Board, Step::EnableLine),
            (Step::Motor1, Step::Motor1),
        ] {
            let (step, finding) = found_at(from, mistakes);
            assert_eq!(step, at);
            let not_ready = Blockers::AMPLIFIER_NOT_READY;
            assert_eq!(finding, Finding::NotReady(not_ready), "{finding}");
        }
    }
}

#[test]
fn amplifiers_without_ready_lines_are_noted() {
    let mistakes = BenchMistakes {
        ready_grounded: [true; 3],
        ..BenchMistakes::default()
    };
    let bench = wired(Wiring::RIGHT).with_mistakes(mistakes);
    let mut user = OtherUser::without_ready(VirtualUser::at(bench));
    let mut log = Log::default();
    let device = user.user.device(RECORD);
    let result = run_once(&mut user, device, &mut log).expect("to the enable line");
    assert_eq!(result, SequenceEnd::BoardPoweredOff);
    let last = log.entries.last().expect("an entry");
    assert_eq!(last.step, Step::EnableLine);
    assert!(
        last.result.starts_with("no ready line is wired"),
        "{last:?}"
    );
}

/// Safety: bring-up.
#[test]
fn motor_without_push_is_named() {
    for (axis, step) in [Step::Motor1, Step::Motor2, Step::Motor3]
        .into_iter()
        .enumerate()
    {
        let wiring = Wiring::RIGHT.with_gain(axis, 0.0);
        let (at, finding) = found_from(step, wired(wiring), RECORD);
        assert_eq!(at, step);
        let named = matches!(finding, Finding::NoPush { motor, .. } if motor == axis + 1);
        assert!(named, "{finding}");
    }
}

#[test]
fn jog_beyond_its_bounds_is_refused() {
    let user = VirtualUser::new(Wiring::RIGHT);
    let opened = ControlSession::open(Box::new(user.device(RECORD)), HANG);
    let mut control = opened.expect("it answers");
    let mut request = |request| control.request(&request).expect("it answers");
    let jog = |axis, current_a, hold_ms| {
        Request::Jog(Jog {
            axis,
            current_a,
            hold_ms,
        })
    };
    for beyond in [
        jog(0, 0.32, 500),
        jog(3, 0.1, 500),
        jog(0, 0.1, 5_001),
        jog(1, f32::NAN, 1),
    ] {
        assert_eq!(request(beyond), Err(Refusal::NoSuchJog), "{beyond:?}");
    }
    // Conditions that block arming also block a jog: this arm is not zeroed.
    let blocked = request(jog(0, 0.3, 500));
    assert_eq!(blocked, Err(Refusal::Blocked(Blockers::NOT_ZEROED)));
}
