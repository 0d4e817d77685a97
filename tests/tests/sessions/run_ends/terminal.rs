//! A lost terminal, or a lost pipe in its place, does not end the session.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::os::fd::OwnedFd;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::Ordering;
use std::time::Duration;

use hapterra_core::wire::session::SessionEnd;
use rustix::io::{FdFlags, fcntl_setfd};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{LocalModes, tcgetattr};

use hapterra_tests::socket_device::{SocketDevice, command, has_begun, output_text, signal, start};
use hapterra_tests::timeouts::{end_of, pass, wait_for, wait_until};

/// Longer than the time until a line is written to a lost terminal.
const A_LINE: Duration = Duration::from_millis(3_000);

/// Opens a terminal. Returns the window's end and the program's.
pub(super) fn terminal() -> (File, File) {
    let window = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a terminal");
    // The program must not inherit the window's end.
    fcntl_setfd(&window, FdFlags::CLOEXEC).expect("set");
    grantpt(&window).expect("granted");
    unlockpt(&window).expect("unlocked");
    let name = ptsname(&window, vec![]).expect("a name");
    let name = name.to_str().expect("a plain path");
    let end = OpenOptions::new().read(true).write(true).open(name);
    (window.into(), end.expect("open"))
}

/// Starts `run` with a terminal's end as input and output.
fn start_in(end: &File, served: &SocketDevice, folder: &Path) -> Child {
    start_command_in(end, command(served.address, folder))
}

/// Starts a command with a terminal's end as input and output.
pub(super) fn start_command_in(end: &File, mut command: Command) -> Child {
    let end = || Stdio::from(OwnedFd::from(end.try_clone().expect("another")));
    let command = command.stdin(end()).stdout(end()).stderr(end());
    command.spawn().expect("it runs")
}

/// Returns the modes of the terminal: lines or keys, and echo.
pub(super) fn modes(end: &File) -> LocalModes {
    tcgetattr(end).expect("a terminal").local_modes
}

/// Safety: 26.
#[test]
fn closed_terminal_window_closes_the_session() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = SocketDevice::start();
    let (mut window, end) = terminal();
    let child = start_in(&end, &served, folder.path());
    has_begun(&mut window);
    drop(window);
    // It runs until its end is requested.
    pass(A_LINE);
    signal(&child, "HUP");
    let output = end_of(child);
    assert!(output.status.success(), "{}", output.status);
    assert!(folder.path().join("felt.csv").exists());
    assert_eq!(served.last_end(), SessionEnd::Goodbye);
}

/// Safety: 26.
#[test]
fn closed_output_does_not_stop_the_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = SocketDevice::start();
    let mut child = start(&served, folder.path(), &[]);
    drop((child.stderr.take(), child.stdout.take()));
    pass(A_LINE);
    signal(&child, "INT");
    let output = end_of(child);
    assert!(output.status.success(), "{}", output.status);
    assert!(folder.path().join("felt.csv").exists());
    assert_eq!(served.last_end(), SessionEnd::Goodbye);
}

/// Safety: 26.
#[test]
fn full_disk_loses_only_output_lines() {
    let full = || OpenOptions::new().write(true).open("/dev/full");
    // Not every system has one.
    let (Ok(out), Ok(err)) = (full(), full()) else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let served = SocketDevice::start();
    let mut command = command(served.address, folder.path());
    let command = command.args(["--duration", "0.5s"]).stdout(out).stderr(err);
    let child = command.spawn().expect("it runs");
    let output = end_of(child);
    assert!(output.status.success(), "{}", output.status);
    assert!(folder.path().join("felt.csv").exists());
    assert_eq!(served.last_end(), SessionEnd::Goodbye);
}

/// Safety: 26.
#[test]
fn unread_output_does_not_stop_the_first_and_second_signal() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = SocketDevice::start();
    let (_unread, mut pipe) = std::io::pipe().expect("a pipe");
    // As much as a pipe can store.
    pipe.write_all(&[b'.'; 1 << 16]).expect("written");
    let mut command = command(served.address, folder.path());
    let mut child = command.stderr(pipe).spawn().expect("it runs");
    has_begun(child.stdout.as_mut().expect("piped"));
    pass(A_LINE);
    served.deaf.store(true, Ordering::Relaxed);
    signal(&child, "INT");
    served.wait_for_ignored_bye();
    signal(&child, "INT");
    let output = end_of(child);
    // Not after its own time-out, as when the board does not confirm in time.
    assert_eq!(output.status.code(), Some(130), "{}", output_text(&output));
}

/// Reads the output in a window until it contains a text.
pub(super) fn shows(window: &mut File, text: &str) -> String {
    shows_all(window, &[text])
}

/// Reads the output in a window until it contains all of these texts, in any order.
fn shows_all(window: &mut File, texts: &[&str]) -> String {
    let (mut shown, mut chunk) = (String::new(), [0; 4096]);
    wait_for(&texts.join(", "), || {
        let n = window.read(&mut chunk).expect("open");
        shown += &String::from_utf8_lossy(&chunk[..n]);
        let is_there = texts.iter().all(|text| shown.contains(text));
        is_there.then(|| shown.clone())
    })
}

/// An arm in its zero pose with a hand that allows arming, behind a socket; keys are typed.
#[test]
fn keys_change_the_placement_and_ctrl_c_restores_the_terminal() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = SocketDevice::start();
    let (mut window, end) = terminal();
    let before = modes(&end);
    assert!(before.contains(LocalModes::ICANON | LocalModes::ECHO));
    let child = start_in(&end, &served, folder.path());
    shows_all(&mut window, &["arrows pan", "hold it there and press"]);
    wait_until("keys that come one by one", || {
        !modes(&end).contains(LocalModes::ICANON)
    });
    // Enter answers the prompt: the arm is zeroed, and has samples for the steering.
    window.write_all(b"\r").expect("typed");
    shows(&mut window, "zeroed at");
    window.write_all(b"+").expect("typed");
    shows(&mut window, "view 1: ");
    window.write_all(b"\x1b[C").expect("typed");
    shows(&mut window, "view 2: ");
    window.write_all(&[3]).expect("typed");
    let output = end_of(child);
    assert!(output.status.success(), "{}", output.status);
    assert_eq!(modes(&end), before, "the terminal is as it was");
    assert_eq!(served.last_end(), SessionEnd::Goodbye);
}

#[test]
fn second_ctrl_c_and_signal_restore_the_terminal() {
    for ends_by in ["interrupts", "signal"] {
        let folder = tempfile::tempdir().expect("a folder");
        let served = SocketDevice::start();
        let (mut window, end) = terminal();
        let before = modes(&end);
        let child = start_in(&end, &served, folder.path());
        shows(&mut window, "arrows pan");
        wait_until("the terminal to change", || modes(&end) != before);
        match ends_by {
            "interrupts" => {
                served.deaf.store(true, Ordering::Relaxed);
                window.write_all(&[3]).expect("typed");
                served.wait_for_ignored_bye();
                window.write_all(&[3]).expect("typed");
                let output = end_of(child);
                assert_eq!(output.status.code(), Some(130));
            }
            _ => {
                signal(&child, "TERM");
                let output = end_of(child);
                assert!(output.status.success(), "{}", output.status);
            }
        }
        assert_eq!(modes(&end), before, "{ends_by}");
    }
}

/// Enter and keys reach only the device whose number was pressed: neither user arms the other's
/// arm.
///
/// Safety: 34.
#[test]
fn enter_and_keys_affect_only_the_selected_device() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = [SocketDevice::start(), SocketDevice::start()];
    let (mut window, end) = terminal();
    let before = modes(&end);
    let of = || Stdio::from(OwnedFd::from(end.try_clone().expect("another")));
    let child = command(served[0].address, folder.path())
        .args(["--device", &format!("tcp:{}", served[1].address)])
        .stdin(of())
        .stdout(of())
        .stderr(of())
        .spawn()
        .expect("it runs");
    let name = |number: usize| format!("[{number} tcp:{}] ", served[number - 1].address);
    let prompt = |number| format!("and press {number} and then Enter");
    // Both prompt for their zero poses, in either order.
    let mut shown = shows(&mut window, "hold it there and press");
    while ![1, 2].iter().all(|number| shown.contains(&prompt(*number))) {
        shown += &shows(&mut window, "and then Enter");
    }
    // For neither of them.
    window.write_all(b"\r").expect("typed");
    shown = shows(&mut window, "Enter alone is for no device");
    window.write_all(b"2").expect("typed");
    shown += &shows(&mut window, &format!("keys are for {}", name(2).trim_end()));
    window.write_all(b"\r").expect("typed");
    shown += &shows(&mut window, &format!("{}zeroed at", name(2)));
    window.write_all(b"+").expect("typed");
    shown += &shows(&mut window, &format!("{}view 1: ", name(2)));
    assert!(!shown.contains(&format!("{}zeroed", name(1))), "{shown}");
    assert!(!shown.contains(&format!("{}view 1", name(1))), "{shown}");
    window.write_all(b"1\r").expect("typed");
    shows(&mut window, &format!("{}zeroed at", name(1)));
    window.write_all(&[3]).expect("typed");
    let output = end_of(child);
    assert!(output.status.success(), "{}", output.status);
    assert_eq!(modes(&end), before, "the terminal is as it was");
    for served in &served {
        assert_eq!(served.last_end(), SessionEnd::Goodbye);
    }
}
