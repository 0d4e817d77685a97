//! All ends of `hapterra run` and `hapterra bringup`: the board has confirmed that it is disarmed,
//! or the user receives a warning that it may not be; the recording is kept.
#![cfg(unix)]

mod bringup;
mod guardian;
mod hostile;
mod planning;
mod terminal;

use std::process::Command;
use std::sync::atomic::Ordering;
use std::time::Duration;

use hapterra_core::wire::session::SessionEnd;
use hapterra_tests::hapterra_binary;
use hapterra_tests::socket_device::{SocketDevice, command, output_text, signal, start};
use hapterra_tests::timeouts::{end_of, pass};

/// Safety: 26.
#[test]
fn signal_closes_the_session_with_confirmation() {
    for name in ["INT", "TERM", "HUP"] {
        let folder = tempfile::tempdir().expect("a folder");
        let served = SocketDevice::start();
        let child = start(&served, folder.path(), &[]);
        signal(&child, name);
        let output = end_of(child);
        let text = output_text(&output);
        assert!(output.status.success(), "{name}: {text}");
        assert!(!text.contains("did not confirm"), "{name}: {text}");
        assert!(folder.path().join("felt.csv").exists(), "{name}: {text}");
        assert_eq!(served.last_end(), SessionEnd::Goodbye, "{name}");
    }
}

#[test]
fn end_of_duration_closes_the_session() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = SocketDevice::start();
    let child = start(&served, folder.path(), &["--duration", "0.5s"]);
    let output = end_of(child);
    assert!(output.status.success(), "{}", output_text(&output));
    // A query does not change the answer to the next one.
    for _ in 0..2 {
        assert_eq!(served.last_end(), SessionEnd::Goodbye);
    }
}

/// Safety: 26, images.
#[test]
fn unconfirmed_disarm_is_reported_and_the_run_fails() {
    for name in ["INT", "TERM", "HUP"] {
        let folder = tempfile::tempdir().expect("a folder");
        let served = SocketDevice::start();
        let child = start(&served, folder.path(), &[]);
        // Telemetry continues, but the board receives nothing any more.
        served.deaf.store(true, Ordering::Relaxed);
        signal(&child, name);
        let output = end_of(child);
        let text = output_text(&output);
        assert_eq!(output.status.code(), Some(1), "{name}: {text}");
        let warning = "did not confirm that it is disarmed: switch the amplifiers off";
        assert!(text.contains(warning), "{name}: {text}");
        assert!(folder.path().join("felt.csv").exists(), "{name}: {text}");
        assert_eq!(served.last_end(), SessionEnd::Replaced, "{name}");
    }
}

#[test]
fn second_signal_exits_at_once_with_the_same_warning() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = SocketDevice::start();
    let child = start(&served, folder.path(), &[]);
    served.deaf.store(true, Ordering::Relaxed);
    signal(&child, "INT");
    served.wait_for_ignored_bye();
    signal(&child, "INT");
    let output = end_of(child);
    let text = output_text(&output);
    assert_eq!(output.status.code(), Some(130), "{text}");
    assert!(text.contains("switch the amplifiers off"), "{text}");
}

#[test]
fn silence_time_out_of_range_is_refused() {
    for seconds in ["4", "3601", "soon"] {
        let output = Command::new(hapterra_binary())
            .args(["run", "x.tif", "--silence", seconds])
            .output()
            .expect("it runs");
        assert_eq!(output.status.code(), Some(2), "{}", output_text(&output));
    }
}

/// Safety: 31.
#[test]
fn stiffness_above_the_maximum_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = SocketDevice::start();
    let output = command(served.address, folder.path())
        .args(["--stiffness", "1e30"])
        .output()
        .expect("it runs");
    let text = output_text(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("no arm renders more than 20 N/mm"), "{text}");
}

/// The system's limit on the size of files represents a full disk.
///
/// Safety: 27.
#[test]
fn recording_that_fills_the_disk_is_kept_and_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = SocketDevice::start();
    let usual = command(served.address, folder.path());
    let output = Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 128; exec \"$0\" \"$@\""])
        .arg(usual.get_program())
        .args(usual.get_args())
        .output()
        .expect("it ends by itself");
    let text = output_text(&output);
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("cannot write"), "{text}");
    let partial = guardian::partial(folder.path()).expect("what was written");
    let bytes = folder
        .path()
        .join(&partial)
        .metadata()
        .expect("there")
        .len();
    assert!(bytes >= 1 << 15, "{bytes}");
    assert!(
        text.contains(&format!("{partial} ({bytes} bytes)")),
        "{text}"
    );
    assert_eq!(served.last_end(), SessionEnd::Goodbye, "{text}");
}

/// Safety: 26.
#[test]
fn failed_start_warns_that_the_arm_may_be_armed() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = SocketDevice::start();
    let killed = start(&served, folder.path(), &[]);
    signal(&killed, "KILL");
    end_of(killed);
    // The next run cannot disarm an arm that the last one left armed.
    served.deaf.store(true, Ordering::Relaxed);
    let next = command(served.address, folder.path()).output();
    let text = output_text(&next.expect("it ends"));
    assert!(text.contains("switch the amplifiers off"), "{text}");
}

#[test]
fn signal_during_start_ends_the_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = SocketDevice::start();
    served.deaf.store(true, Ordering::Relaxed);
    let child = command(served.address, folder.path())
        .arg("--unchecked")
        .spawn();
    let child = child.expect("it runs");
    // The device does not answer the open. When the open arrives, the session is closed.
    served.wait_for_ignored_hello();
    signal(&child, "INT");
    pass(Duration::from_millis(500));
    served.deaf.store(false, Ordering::Relaxed);
    let output = end_of(child);
    let text = output_text(&output);
    // Or it had started before it received the signal.
    assert!(
        text.contains("interrupted") || output.status.success(),
        "{text}"
    );
    assert_eq!(served.last_end(), SessionEnd::Goodbye, "{text}");
}
