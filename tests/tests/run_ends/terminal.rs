//! What becomes of the terminal, or of the pipe in its place, does not end the session.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::os::fd::OwnedFd;
use std::process::Stdio;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use hapterra_core::wire::session::SessionEnd;
use rustix::io::{FdFlags, fcntl_setfd};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

use super::served::{Served, command, ended_within, has_begun, signal, start, told};

/// Longer than it takes until a line is written to what is no terminal any more.
const A_LINE: Duration = Duration::from_millis(3_000);
/// Longer than a goodbye takes.
const AN_END: Duration = Duration::from_secs(10);

/// The two ends of a terminal: the window's, and the program's.
fn terminal() -> (File, File) {
    let window = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a terminal");
    // The program does not hold the window's end, too.
    fcntl_setfd(&window, FdFlags::CLOEXEC).expect("set");
    grantpt(&window).expect("granted");
    unlockpt(&window).expect("unlocked");
    let name = ptsname(&window, vec![]).expect("a name");
    let name = name.to_str().expect("a plain path");
    let end = OpenOptions::new().read(true).write(true).open(name);
    (window.into(), end.expect("open"))
}

#[test]
fn a_terminal_window_that_is_closed_is_a_goodbye() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = Served::start();
    let (mut window, end) = terminal();
    let end = || Stdio::from(OwnedFd::from(end.try_clone().expect("another")));
    let mut command = command(served.address, folder.path());
    let child = command.stdin(end()).stdout(end()).stderr(end()).spawn();
    let child = child.expect("it runs");
    has_begun(&mut window);
    drop(window);
    // It goes on as long as nobody asks for its end.
    std::thread::sleep(A_LINE);
    signal(&child, "HUP");
    let output = ended_within(child, AN_END).expect("it ends");
    assert!(output.status.success(), "{}", output.status);
    assert!(folder.path().join("felt.csv").exists());
    assert_eq!(served.last_end(), SessionEnd::Goodbye);
}

#[test]
fn a_reader_that_is_gone_costs_its_lines_and_nothing_else() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = Served::start();
    let mut child = start(&served, folder.path(), &[]);
    drop((child.stderr.take(), child.stdout.take()));
    std::thread::sleep(A_LINE);
    signal(&child, "INT");
    let output = ended_within(child, AN_END).expect("it ends");
    assert!(output.status.success(), "{}", output.status);
    assert!(folder.path().join("felt.csv").exists());
    assert_eq!(served.last_end(), SessionEnd::Goodbye);
}

#[test]
fn a_disk_that_is_full_costs_its_lines_and_nothing_else() {
    let full = || OpenOptions::new().write(true).open("/dev/full");
    // Not every system has one.
    let (Ok(out), Ok(err)) = (full(), full()) else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let served = Served::start();
    let mut command = command(served.address, folder.path());
    let command = command.args(["--seconds", "0.5"]).stdout(out).stderr(err);
    let child = command.spawn().expect("it runs");
    let output = ended_within(child, AN_END).expect("it ends");
    assert!(output.status.success(), "{}", output.status);
    assert!(folder.path().join("felt.csv").exists());
    assert_eq!(served.last_end(), SessionEnd::Goodbye);
}

#[test]
fn where_nobody_reads_the_first_signal_is_a_goodbye_and_the_second_ends_it_at_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = Served::start();
    let (_unread, mut pipe) = std::io::pipe().expect("a pipe");
    // As much as a pipe takes.
    pipe.write_all(&[b'.'; 1 << 16]).expect("written");
    let mut command = command(served.address, folder.path());
    let mut child = command.stderr(pipe).spawn().expect("it runs");
    has_begun(child.stdout.as_mut().expect("piped"));
    std::thread::sleep(A_LINE);
    served.deaf.store(true, Ordering::Relaxed);
    signal(&child, "INT");
    std::thread::sleep(Duration::from_millis(300));
    let began = Instant::now();
    signal(&child, "INT");
    let output = ended_within(child, AN_END).expect("it ends");
    assert!(began.elapsed() < Duration::from_secs(1));
    assert_eq!(output.status.code(), Some(130), "{}", told(&output));
}
