//! A worker ends abruptly while the arm is armed: its guardian disarms the board, restores the
//! terminal and names the recording. The run is in a terminal, armed by Enter and a dead-man press;
//! the device reports the state of the amplifiers.

use std::fs::File;
use std::io::{Read, Write};
use std::net::SocketAddr;
use std::path::Path;
use std::process::{Child, Command, ExitStatus};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use hapterra::link::Native;
use hapterra_core::guard::{GuardInputs, GuardOutputs};
use hapterra_core::wire::session::SessionEnd;
use hapterra_tests::gdal_stand_in;
use hapterra_tests::socket_device::{SocketDevice, command, command_over, signal};
use hapterra_tests::timeouts::{end_of, pass, wait_for, wait_until};
use rustix::termios::LocalModes;

use super::terminal::{modes, shows, start_command_in, terminal};

/// The line of the message to the user.
const SWITCH_OFF: &str = "switch the amplifiers off";

/// An arm that a user at a terminal has armed, and the processes of the command.
struct Armed {
    folder: tempfile::TempDir,
    served: SocketDevice,
    amplifiers: Arc<AtomicBool>,
    window: File,
    end: File,
    before: LocalModes,
    guardian: Child,
}

/// End of a run.
struct Ended {
    status: ExitStatus,
    shown: String,
}

impl Armed {
    fn new() -> Self {
        Self::by(command)
    }

    /// Starts a device, and the command made from its address and a folder.
    fn by(command: impl FnOnce(SocketAddr, &Path) -> Command) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let (amplifiers, pressed) = (Arc::default(), Arc::default());
        let (is_on, is_pressed) = (Arc::clone(&amplifiers), Arc::clone(&pressed));
        let served = SocketDevice::with(move || (device(is_on, is_pressed), || {}));
        let (mut window, end) = terminal();
        let before = modes(&end);
        let command = command(served.address, folder.path());
        let guardian = start_command_in(&end, command);
        shows(&mut window, "hold it there and press");
        window.write_all(b"\r").expect("typed");
        shows(&mut window, "waits for your hand");
        pressed.store(true, Ordering::Relaxed);
        shows(&mut window, "amplifiers on; force ramps up");
        assert!(amplifiers.load(Ordering::Relaxed), "armed");
        assert_ne!(modes(&end), before, "keys come one by one");
        Self {
            folder,
            served,
            amplifiers,
            window,
            end,
            before,
            guardian,
        }
    }

    /// Returns the process ID of the worker.
    fn worker(&self) -> String {
        let id = self.guardian.id().to_string();
        let found = Command::new("pgrep").args(["-P", &id]).output();
        let found = String::from_utf8(found.expect("pgrep runs").stdout);
        found.expect("a number").trim().to_owned()
    }

    fn kill_worker(&self, name: &str) {
        let worker = self.worker();
        let sent = Command::new("kill")
            .args([format!("-{name}"), worker])
            .status();
        assert!(sent.expect("kill runs").success());
    }

    fn signal(&self, name: &str) {
        signal(&self.guardian, name);
    }

    /// Waits for the end, then checks that the terminal is restored.
    fn end(self) -> (Ended, Rest) {
        let Self {
            folder,
            served,
            amplifiers,
            mut window,
            end,
            before,
            guardian,
        } = self;
        let reader = std::thread::spawn(move || {
            let (mut shown, mut chunk) = (vec![], [0; 4096]);
            // On some systems a terminal whose other end is closed gives a read error.
            while let Ok(n @ 1..) = window.read(&mut chunk) {
                shown.extend_from_slice(&chunk[..n]);
            }
            String::from_utf8_lossy(&shown).into_owned()
        });
        let status = end_of(guardian).status;
        wait_until("the terminal to be put back", || modes(&end) == before);
        drop(end);
        let shown = reader.join().expect("read");
        let rest = Rest {
            folder,
            served,
            amplifiers,
        };
        (Ended { status, shown }, rest)
    }
}

/// State after the end.
struct Rest {
    folder: tempfile::TempDir,
    served: SocketDevice,
    amplifiers: Arc<AtomicBool>,
}

impl Rest {
    /// Checks that the amplifiers are off, and that the session was closed.
    fn is_disarmed(&self, how: &str) {
        assert_eq!(self.served.last_end(), SessionEnd::Goodbye, "{how}");
        assert!(!self.amplifiers.load(Ordering::Relaxed), "{how}");
    }
}

/// Returns an arm at rest over the terrain, whose user holds the dead-man switch on request.
fn device(is_on: Arc<AtomicBool>, is_pressed: Arc<AtomicBool>) -> Native {
    let hand = move |_, sense: &mut GuardInputs, drive: &GuardOutputs| {
        is_on.store(drive.enabled, Ordering::Relaxed);
        sense.dead_man = is_pressed.load(Ordering::Relaxed);
    };
    Native::for_replay()
        .free_running()
        .with_fault_injector(Box::new(hand))
}

/// Returns the truncated recording.
pub(super) fn partial(folder: &Path) -> Option<String> {
    let names = std::fs::read_dir(folder).expect("listed");
    let names = names.map(|entry| entry.expect("entry").file_name());
    let mut names = names.filter_map(|name| name.into_string().ok());
    names.find(|name| name.ends_with(".partial"))
}

/// The abort represents a stack overflow and exhausted memory: Rust's runtime ends both with one.
/// Neither can be caused for real. No known input overflows a stack, and a running thread already
/// has the pages of its stack. A worker whose address space is limited to its present size
/// continues to serve for minutes, because it requests no more.
///
/// Safety: 27.
#[test]
fn worker_killed_while_armed_is_disarmed_by_guardian() {
    for (name, number) in [("ABRT", 6), ("KILL", 9)] {
        let armed = Armed::new();
        armed.kill_worker(name);
        let (ended, rest) = armed.end();
        let shown = &ended.shown;
        rest.is_disarmed(name);
        assert_eq!(ended.status.code(), Some(128 + number), "{shown}");
        assert!(shown.contains(&format!("ended by SIG{name}")), "{shown}");
        let confirmed = format!("tcp:{}: the board has confirmed", rest.served.address);
        assert!(shown.contains(&confirmed), "{shown}");
        assert!(!shown.contains(SWITCH_OFF), "{shown}");
        let partial = partial(rest.folder.path()).expect("a recording");
        assert!(shown.contains(&partial), "{partial}: {shown}");
    }
}

/// A file that libgdal reads block by block, and a read that ends in SIGSEGV. Zooming out causes
/// the background thread to read new blocks.
///
/// Safety: 27.
#[test]
fn crash_of_libgdal_while_armed_is_disarmed_by_guardian() {
    let place = tempfile::tempdir().expect("a folder");
    let library = gdal_stand_in::library(place.path());
    let ground = gdal_stand_in::terrain(place.path());
    let crash = place.path().join("crash");
    let armed = Armed::by(|address, folder| {
        let ground = ground.to_str().expect("a plain path");
        let mut command = command_over(ground, address, folder);
        command.args(["--input", "in-memory=0MB"]);
        command.env("GDAL_LIBRARY", &library);
        command.env("STAND_IN_CRASH", &crash);
        command
    });
    std::fs::write(&crash, "now").expect("written");
    let mut keys = armed.window.try_clone().expect("a terminal");
    let zooming = std::thread::spawn(move || {
        // Until the terminal is closed, or the placement is as large as possible.
        for _ in 0..8 {
            let _ = keys.write_all(b"-");
            pass(Duration::from_secs(1));
        }
    });
    let (ended, rest) = armed.end();
    let shown = &ended.shown;
    rest.is_disarmed("a crash of libgdal");
    assert_eq!(ended.status.code(), Some(128 + 11), "{shown}");
    assert!(shown.contains("ended by SIGSEGV"), "{shown}");
    let confirmed = format!("tcp:{}: the board has confirmed", rest.served.address);
    assert!(shown.contains(&confirmed), "{shown}");
    assert!(partial(rest.folder.path()).is_some(), "{shown}");
    zooming.join().expect("keys");
}

/// Safety: 27.
#[test]
fn unconfirmed_guardian_disarm_prints_switch_off_request() {
    let armed = Armed::new();
    armed.served.deaf.store(true, Ordering::Relaxed);
    armed.kill_worker("KILL");
    let (ended, rest) = armed.end();
    assert!(ended.shown.contains(SWITCH_OFF), "{}", ended.shown);
    assert!(
        rest.amplifiers.load(Ordering::Relaxed),
        "nothing reached it"
    );
}

/// Safety: 27.
#[test]
fn each_signal_that_can_be_handled_is_a_clean_end() {
    for name in ["QUIT", "USR1", "USR2", "ALRM", "TERM"] {
        for is_to_worker in [false, true] {
            let armed = Armed::new();
            match is_to_worker {
                true => armed.kill_worker(name),
                false => armed.signal(name),
            }
            let (ended, rest) = armed.end();
            assert!(ended.status.success(), "{name}: {}", ended.shown);
            rest.is_disarmed(name);
            assert!(rest.folder.path().join("felt.csv").exists(), "{name}");
        }
    }
}

/// Safety: 27.
#[test]
fn worker_whose_guardian_is_killed_ends_as_after_ctrl_c() {
    for name in ["KILL", "ABRT"] {
        let armed = Armed::new();
        armed.signal(name);
        let (ended, rest) = armed.end();
        rest.is_disarmed(name);
        let recording = rest.folder.path().join("felt.csv");
        wait_for("the recording", || recording.exists().then_some(()));
        assert!(!ended.shown.contains(SWITCH_OFF), "{}", ended.shown);
    }
}

/// A stopped worker represents one that reads a file without end.
///
/// Safety: 27.
#[test]
fn worker_that_does_not_react_to_ctrl_c_is_killed() {
    let armed = Armed::new();
    armed.kill_worker("STOP");
    armed.signal("INT");
    let (ended, rest) = armed.end();
    rest.is_disarmed("INT");
    assert_eq!(ended.status.code(), Some(130), "{}", ended.shown);
    assert!(ended.shown.contains("did not react"), "{}", ended.shown);
}

/// Ctrl-C in a terminal reaches both processes, but counts as one: the worker may still close its
/// session, and is not ended at once.
///
/// Safety: 27.
#[test]
fn signal_to_both_processes_counts_once() {
    let armed = Armed::new();
    armed.served.deaf.store(true, Ordering::Relaxed);
    armed.kill_worker("INT");
    armed.signal("INT");
    let (ended, _rest) = armed.end();
    assert_eq!(ended.status.code(), Some(1), "{}", ended.shown);
    assert!(ended.shown.contains(SWITCH_OFF), "{}", ended.shown);
}
