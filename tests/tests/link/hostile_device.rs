//! A hostile device behind TCP: none of its texts controls the terminal, and none of its requests
//! floods it.

use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Command, Output};
use std::time::Duration;

use hapterra::link::{Native, Transport};
use hapterra_core::phantom::Calibration;
use hapterra_core::terrain::TileKey;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME};
use hapterra_core::wire::hello::DeviceHello;
use hapterra_core::wire::message::ToHost;
use hapterra_core::wire::status::{BootReport, Crash, CrashKind, ResetCause};
use hapterra_firmware::native::StoppedClock;
use hapterra_firmware::store::Stored;
use hapterra_tests::hapterra_binary;
use hapterra_tests::link_campaign::frames;

/// Requests for non-existent tiles after each message of samples.
const REQUESTS: i32 = 200;

/// Clears the screen, changes the title, rings, ends the line, and writes from right to left.
const NAME: &str = "\x1b[2J\x1b]0;owned\x07\r\n\u{202e}\u{9b}m";

fn device() -> Native<StoppedClock> {
    let crash = Crash {
        kind: CrashKind::Panic,
        pc: 0,
        lr: 0,
        status: 0,
        line: 1,
        tick: 1,
        file: "\x1b[1A\x1b[2K\r\nfault none".try_into().expect("fits"),
    };
    let boot = BootReport {
        cause: ResetCause::Watchdog,
        crash: Some(crash),
        ..BootReport::default()
    };
    Native::started(
        StoppedClock,
        None,
        Stored::Found(Calibration::PREMIUM_1_5),
        boot,
    )
    .free_running()
}

fn rename(hello: &mut DeviceHello) {
    hello.board = NAME.try_into().expect("fits");
    hello.version = NAME.try_into().expect("fits");
}

/// Returns the replacement for a frame of the device.
fn replaced_frame(frame: &[u8], epoch: &mut u32) -> Vec<u8> {
    let mut has_samples = false;
    let printed = frames::modified(frame, |message| match message {
        ToHost::Hello(hello) => rename(hello),
        ToHost::Status { status, .. } => rename(&mut status.device),
        ToHost::SceneAck {
            epoch: acknowledged,
            ..
        } => *epoch = *acknowledged,
        ToHost::Telemetry(_) => has_samples = true,
        _ => {}
    });
    let mut printed = printed.expect("the device's own");
    if has_samples {
        for column in 0..REQUESTS {
            let key = TileKey::new(9, i32::MAX - column, i32::MIN);
            let request = frames::modified(frame, |message| {
                *message = ToHost::TileRequest { epoch: *epoch, key };
            });
            printed.extend(request.expect("the device's own"));
        }
    }
    printed
}

/// Lets the device send until the host is gone.
fn serve(mut stream: TcpStream) -> std::io::Result<()> {
    stream.set_read_timeout(Some(Duration::from_millis(1)))?;
    let (mut device, mut epoch) = (device(), 0);
    let mut reader = FrameReader::<MAX_FRAME>::new();
    let (mut received, mut chunk) = ([0; 4096], [0; 512]);
    loop {
        match stream.read(&mut received) {
            Ok(0) => return Ok(()),
            Ok(n) => device.send(&received[..n])?,
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(error) => return Err(error),
        }
        let n = device.receive(&mut chunk, Duration::ZERO)?;
        let mut rest = &chunk[..n];
        while !rest.is_empty() {
            let (consumed, frame) = reader.push(rest);
            rest = &rest[consumed..];
            if let Some(Ok(frame)) = frame {
                stream.write_all(&replaced_frame(frame, &mut epoch))?;
            }
        }
    }
}

/// Starts the device. Returns its address.
fn started() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("bound");
    let address = listener.local_addr().expect("bound").to_string();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            // A host that disconnects does not stop the device.
            let _ = serve(stream.expect("accepted"));
        }
    });
    address
}

fn output_text(run: &Output) -> String {
    assert!(run.status.success(), "{run:?}");
    let printed = [&run.stdout, &run.stderr].map(|text| String::from_utf8_lossy(text));
    printed.concat()
}

/// Checks that a text has no control characters except line ends.
fn is_plain(text: &str) {
    let obeyed = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
    assert!(!text.contains(obeyed), "{text:?}");
}

fn terrain(folder: &Path) -> std::path::PathBuf {
    let path = folder.join("terrain.asc");
    let head = "ncols 40\nnrows 30\nxllcorner 0\nyllcorner 0\ncellsize 10\n";
    let rows = vec![vec!["0"; 40].join(" "); 30].join("\n");
    fs::write(&path, format!("{head}{rows}\n")).expect("written");
    path
}

/// Safety: images.
#[test]
fn device_text_cannot_control_the_terminal() {
    let device = started();
    let hapterra = |arguments: &[&str]| {
        let run = Command::new(hapterra_binary()).args(arguments).output();
        output_text(&run.expect("started"))
    };
    let status = hapterra(&["status", "--device", &format!("tcp:{device}")]);
    is_plain(&status);
    assert!(status.contains("\\u{1b}[2J\\u{1b}]0;owned"), "{status}");
    assert!(status.contains("line 1 of …\\u{1b}[1A"), "{status}");
    is_plain(&hapterra(&["list", "--tcp", &device]));
}

/// Safety: images.
#[test]
fn device_requests_cannot_flood_the_terminal() {
    let folder = tempfile::tempdir().expect("a folder");
    let device = format!("tcp:{}", started());
    let with_plant = format!("{device}+plant:127.0.0.1:1");
    let run = |device: &str, more: &[&str]| {
        Command::new(hapterra_binary())
            .arg("run")
            .arg(terrain(folder.path()))
            .args(["--device", device])
            .args(["--duration", "0.5s", "--exaggeration", "1mm/unit"])
            .args(more)
            .output()
            .expect("started")
    };
    // A board of this name has no record of a bring-up.
    let refused = run(&device, &[]);
    assert!(!refused.status.success(), "{refused:?}");
    let why = String::from_utf8_lossy(&refused.stderr);
    is_plain(&why);
    assert!(why.contains("was not brought up"), "{why}");
    // Nor does its claim to be virtual count.
    for more in [&[][..], &["--unchecked"]] {
        let refused = run(&with_plant, more);
        assert!(!refused.status.success(), "{refused:?}");
        let why = String::from_utf8_lossy(&refused.stderr);
        is_plain(&why);
        assert!(why.contains("is a real board"), "{why}");
    }
    let printed = output_text(&run(&device, &["--unchecked"]));
    is_plain(&printed);
    let lines = printed.lines().count();
    // Some lines of its own, and one a second: it does not take minutes.
    assert!(lines < 200, "{lines} lines: {printed}");
}
