//! `hapterra bringup`, interrupted while the arm is driven.

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Sender, channel};

use hapterra::bringup::{Attendant, Identity, Log, Step, Task, VirtualUser};
use hapterra::link::{ControlSession, Tcp};
use hapterra::phantom::Wiring;
use hapterra_core::guard::Mode;
use hapterra_core::phantom::Calibration;
use hapterra_tests::hapterra_binary;

use hapterra_tests::socket_device::{SocketDevice, output_text, signal};
use hapterra_tests::timeouts::{HANG, end_of};

const RECORD: Calibration = Calibration::PREMIUM_1_5;
/// Tasks after which Enter is pressed.
const CONFIRMED: [Task; 2] = [Task::ZeroPose, Task::HoldLoosely];
const DETECTED: [Task; 1] = [Task::PressDeadMan];

/// Starts a device at a virtual bench, whose user does the tasks that are sent.
fn start_at_bench() -> (SocketDevice, Sender<Task>) {
    let (send, tasks) = channel();
    let served = SocketDevice::with(move || {
        let mut user = VirtualUser::new(Wiring::RIGHT);
        let device = user.device(RECORD);
        (device, move || {
            tasks.try_iter().for_each(|task| user.begin(task));
        })
    });
    (served, send)
}

/// Writes a log in which only the last step is missing.
fn log(served: &SocketDevice, file: &Path) {
    let link = Tcp::connect(&served.address.to_string()).expect("there");
    let control = ControlSession::open(Box::new(link), HANG).expect("answers");
    let mut log = Log::default();
    _ = log.update_identity(Identity::of(control.device(), Some(&RECORD)));
    for step in Step::ALL.into_iter().filter(|s| *s != Step::FirstTouch) {
        log.add(step, true, String::new());
    }
    log.write(file).expect("written");
}

/// Runs the bring-up until the arm is armed over the soft plane.
fn armed(served: &SocketDevice, bench: &Sender<Task>, folder: &Path) -> Child {
    let file = folder.join("log.toml");
    log(served, &file);
    let mut child = Command::new(hapterra_binary())
        .args(["bringup", "--device", &format!("tcp:{}", served.address)])
        .arg("-o")
        .arg(file)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it runs");
    let mut keys = child.stdin.take().expect("piped");
    let mut lines = BufReader::new(child.stdout.take().expect("piped"));
    while !do_next_task(&mut lines, &mut keys, served, bench) {}
    child.stdout = Some(lines.into_inner());
    child.stdin = Some(keys);
    child
}

/// Does the task of the next line. Returns true if the arm is armed and must be moved now.
fn do_next_task(
    lines: &mut impl BufRead,
    keys: &mut ChildStdin,
    served: &SocketDevice,
    bench: &Sender<Task>,
) -> bool {
    let mut line = String::new();
    assert!(lines.read_line(&mut line).expect("text") > 0, "it ended");
    for task in CONFIRMED.into_iter().chain(DETECTED) {
        if line.contains(&format!("> {task}")) {
            bench.send(task).expect("a bench");
            // The tip is moved there.
            served.pass_ms(1_000);
            if CONFIRMED.contains(&task) {
                keys.write_all(b"\n").expect("written");
            }
        }
    }
    line.contains(&format!("> {}", Task::LowerTip))
}

/// Safety: 26.
#[test]
fn single_signal_disarms_and_ends_bringup() {
    let folder = tempfile::tempdir().expect("a folder");
    let (served, bench) = start_at_bench();
    let child = armed(&served, &bench, folder.path());
    signal(&child, "INT");
    let output = end_of(child);
    let text = output_text(&output);
    assert!(text.contains("stopped"), "{text}");
    assert!(!text.contains("did not confirm"), "{text}");
    assert_eq!(served.status().health.report.mode, Mode::Disarmed, "{text}");
}

/// Safety: 26.
#[test]
fn unconfirmed_bringup_end_warns_to_switch_amplifiers_off() {
    let folder = tempfile::tempdir().expect("a folder");
    let (served, bench) = start_at_bench();
    let child = armed(&served, &bench, folder.path());
    served.deaf.store(true, Ordering::Relaxed);
    signal(&child, "INT");
    let output = end_of(child);
    let text = output_text(&output);
    assert!(text.contains("switch the amplifiers off"), "{text}");
}

#[test]
fn second_signal_ends_bringup_and_warns_of_an_armed_arm() {
    let folder = tempfile::tempdir().expect("a folder");
    let (served, bench) = start_at_bench();
    let child = armed(&served, &bench, folder.path());
    served.deaf.store(true, Ordering::Relaxed);
    signal(&child, "INT");
    served.wait_for_ignored_end();
    signal(&child, "INT");
    let output = end_of(child);
    let text = output_text(&output);
    // Not after its own time-out, as when the board does not confirm in time.
    assert_eq!(output.status.code(), Some(130), "{text}");
    assert!(text.contains("switch the amplifiers off"), "{text}");
}

#[test]
fn bringup_with_closed_output_pipe_ends_disarmed() {
    let folder = tempfile::tempdir().expect("a folder");
    let (served, bench) = start_at_bench();
    let mut child = armed(&served, &bench, folder.path());
    drop((child.stdout.take(), child.stderr.take()));
    // The next line is written when the tip is down.
    bench.send(Task::LowerTip).expect("a bench");
    served.pass_ms(8_000);
    signal(&child, "INT");
    let output = end_of(child);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(served.status().health.report.mode, Mode::Disarmed);
}
