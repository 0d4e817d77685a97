//! Every way in which `hapterra run` ends: the board is known to be disarmed, or the
//! user is told that it may not be; what was recorded is kept.
#![cfg(unix)]

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use hapterra::link::{Dialogue, Native, Tcp, Transport};
use hapterra_core::wire::session::SessionEnd;
use hapterra_tests::hapterra_binary;

/// A device behind a socket, one host after the other. While it is deaf nothing reaches
/// it, and what it says still comes.
struct Served {
    address: SocketAddr,
    deaf: Arc<AtomicBool>,
}

impl Served {
    fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("a port");
        let deaf = Arc::new(AtomicBool::new(false));
        let is_deaf = Arc::clone(&deaf);
        std::thread::spawn(move || {
            let mut device = Native::for_replay().restless();
            for stream in listener.incoming() {
                serve(&mut device, stream.expect("a host"), &is_deaf);
            }
        });
        Self { address, deaf }
    }

    /// How the last session ended, as the next host hears it.
    fn last_end(&self) -> SessionEnd {
        self.deaf.store(false, Ordering::Relaxed);
        let link = Tcp::connect(&self.address.to_string()).expect("there");
        let dialogue = Dialogue::open(Box::new(link), Duration::from_secs(20)).expect("answers");
        dialogue.device().last.end
    }
}

/// Until the host is gone.
fn serve(device: &mut Native, mut stream: TcpStream, deaf: &AtomicBool) {
    let wait = Some(Duration::from_millis(1));
    stream.set_read_timeout(wait).expect("set");
    let mut chunk = [0; 4096];
    loop {
        match stream.read(&mut chunk) {
            Ok(0) => return,
            Ok(n) if !deaf.load(Ordering::Relaxed) => device.send(&chunk[..n]).expect("in memory"),
            Ok(_) => {}
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {}
            Err(_) => return,
        }
        // A few milliseconds of its time go by.
        device.pass(2);
        let said = device
            .receive(&mut chunk, Duration::ZERO)
            .expect("in memory");
        if stream.write_all(&chunk[..said]).is_err() {
            return;
        }
    }
}

fn terrain(folder: &Path) -> String {
    let file = folder.join("hills.tif");
    let path = file.to_str().expect("a plain path").to_owned();
    let made = Command::new(hapterra_binary())
        .args(["synth", "fractal", "-o", &path, "--size", "64"])
        .output()
        .expect("it runs");
    assert!(made.status.success());
    path
}

/// Starts serving, and waits until samples have come.
fn start(served: &Served, folder: &Path, more: &[&str]) -> Child {
    let mut child = Command::new(hapterra_binary())
        .args(["run", &terrain(folder), "--cell-mm", "1"])
        .args(["--height-mm-per-unit", "0.1"])
        .args(["--device", &format!("tcp:{}", served.address)])
        .arg("--record")
        .arg(folder.join("felt.csv"))
        .args(more)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it runs");
    let mut begun = [0; 16];
    // It names the terrain when the session is open.
    let stdout = child.stdout.as_mut().expect("piped");
    stdout.read_exact(&mut begun).expect("a session");
    child
}

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill")
        .args([format!("-{name}"), child.id().to_string()])
        .status();
    assert!(sent.expect("kill runs").success());
}

fn told(output: &Output) -> String {
    let both = [output.stdout.as_slice(), output.stderr.as_slice()].concat();
    String::from_utf8_lossy(&both).into_owned()
}

#[test]
fn a_signal_ends_it_with_a_goodbye_that_the_board_confirms() {
    for name in ["INT", "TERM", "HUP"] {
        let folder = tempfile::tempdir().expect("a folder");
        let served = Served::start();
        let child = start(&served, folder.path(), &[]);
        signal(&child, name);
        let output = child.wait_with_output().expect("it ends");
        let told = told(&output);
        assert!(output.status.success(), "{name}: {told}");
        assert!(!told.contains("did not confirm"), "{name}: {told}");
        assert!(folder.path().join("felt.csv").exists(), "{name}: {told}");
        assert_eq!(served.last_end(), SessionEnd::Goodbye, "{name}");
    }
}

#[test]
fn the_end_of_the_time_is_a_goodbye_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = Served::start();
    let child = start(&served, folder.path(), &["--seconds", "0.5"]);
    let output = child.wait_with_output().expect("it ends");
    assert!(output.status.success(), "{}", told(&output));
    // Who looks does not hide it from who looks next.
    for _ in 0..2 {
        assert_eq!(served.last_end(), SessionEnd::Goodbye);
    }
}

#[test]
fn where_the_board_does_not_confirm_the_user_is_told_and_it_fails() {
    for name in ["INT", "TERM", "HUP"] {
        let folder = tempfile::tempdir().expect("a folder");
        let served = Served::start();
        let child = start(&served, folder.path(), &[]);
        // Telemetry goes on coming, and nothing gets to the board any more.
        served.deaf.store(true, Ordering::Relaxed);
        signal(&child, name);
        let output = child.wait_with_output().expect("it ends");
        let told = told(&output);
        assert_eq!(output.status.code(), Some(1), "{name}: {told}");
        let says = "did not confirm that it is disarmed: switch the amplifiers off";
        assert!(told.contains(says), "{name}: {told}");
        assert!(folder.path().join("felt.csv").exists(), "{name}: {told}");
        assert_eq!(served.last_end(), SessionEnd::Replaced, "{name}");
    }
}

#[test]
fn the_second_signal_ends_it_at_once_with_the_same_word() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = Served::start();
    let child = start(&served, folder.path(), &[]);
    served.deaf.store(true, Ordering::Relaxed);
    signal(&child, "INT");
    std::thread::sleep(Duration::from_millis(300));
    signal(&child, "INT");
    let output = child.wait_with_output().expect("it ends");
    let told = told(&output);
    assert_eq!(output.status.code(), Some(130), "{told}");
    assert!(told.contains("switch the amplifiers off"), "{told}");
}

#[test]
fn a_silence_that_no_device_keeps_to_is_refused() {
    for seconds in ["4", "3601", "soon"] {
        let output = Command::new(hapterra_binary())
            .args(["run", "x.tif", "--silence-s", seconds])
            .output()
            .expect("it runs");
        assert_eq!(output.status.code(), Some(2), "{}", told(&output));
    }
}
