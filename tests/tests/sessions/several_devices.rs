//! `hapterra run` with several devices on one terrain: each renders the same as alone, and the end
//! of one does not end another.
#![cfg(unix)]

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use hapterra::link::Native;
use hapterra::synth::Kind;
use hapterra_core::guard::GuardInputs;
use hapterra_core::wire::session::SessionEnd;
use hapterra_tests::socket_device::{SocketDevice, output_text, signal, terrain};
use hapterra_tests::timeouts::end_of;
use hapterra_tests::{greedy_device, hapterra_binary, terrain_file};

/// Returns the command that serves the terrain in a folder to these devices.
fn command(folder: &Path, devices: &[&str], more: &[&str]) -> Command {
    let mut command = Command::new(hapterra_binary());
    command
        .args(["run", &terrain(folder), "--scale", "1mm/cell"])
        .args(["--exaggeration", "0.1mm/unit"]);
    for device in devices {
        command.args(["--device", device]);
    }
    command
        .args(more)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

fn recorded(folder: &Path, name: &str) -> Vec<String> {
    let rendered = folder.join(name);
    vec!["--out".into(), rendered.to_str().expect("plain").to_owned()]
}

fn texts(owned: &[String]) -> Vec<&str> {
    owned.iter().map(String::as_str).collect()
}

/// Two devices behind sockets, and the names at the start of their lines.
struct Pair {
    folder: tempfile::TempDir,
    served: [SocketDevice; 2],
}

impl Pair {
    fn of(second: SocketDevice) -> Self {
        Self {
            folder: tempfile::tempdir().expect("a folder"),
            served: [SocketDevice::start(), second],
        }
    }

    fn name(&self, number: usize) -> String {
        format!("[{number} tcp:{}]", self.served[number - 1].address)
    }

    fn recording(&self, number: usize) -> PathBuf {
        self.folder.path().join(format!("felt-{number}.csv"))
    }

    /// Serves both, and waits until both sessions are open.
    fn start(&self) -> Child {
        let addresses = self.served.each_ref();
        let devices = addresses.map(|served| format!("tcp:{}", served.address));
        let record = recorded(self.folder.path(), "felt.csv");
        let devices = texts(&devices);
        let mut child = command(self.folder.path(), &devices, &texts(&record))
            .spawn()
            .expect("it runs");
        let named = [self.name(1), self.name(2)].map(|name| format!("{name} device "));
        child.stdout = Some(read_until(child.stdout.take().expect("piped"), &named));
        child
    }
}

/// Most lines that are read before an expected one.
const MAX_LINES: usize = 60;

/// Reads lines until there was one with each of these beginnings.
fn read_until<R: std::io::Read>(from: R, beginnings: &[String]) -> R {
    let mut lines = BufReader::with_capacity(1, from);
    let mut missing: Vec<&String> = beginnings.iter().collect();
    for _ in 0..MAX_LINES {
        if missing.is_empty() {
            break;
        }
        let mut line = String::new();
        let read = lines.read_line(&mut line).expect("text");
        assert!(read > 0, "it ended before {missing:?}");
        missing.retain(|beginning| !line.starts_with(beginning.as_str()));
    }
    assert!(missing.is_empty(), "no line begins with {missing:?}");
    lines.into_inner()
}

/// Returns the settings and rows of a recording, without the ticks' costs on this machine.
fn rendered(path: &Path) -> (Vec<Vec<String>>, Vec<String>) {
    let text = std::fs::read_to_string(path).expect("a recording");
    let (settings, rows): (Vec<&str>, Vec<&str>) =
        text.lines().partition(|line| line.starts_with('#'));
    let names: Vec<&str> = rows[0].split(',').collect();
    let is_compared = |column: &usize| names.get(*column) != Some(&"cost");
    let cells = |row: &&str| {
        let cells = row.split(',').enumerate();
        let compared = cells.filter(|(column, _)| is_compared(column));
        compared.map(|(_, cell)| cell.to_owned()).collect()
    };
    let settings = settings.into_iter().map(str::to_owned).collect();
    (rows.iter().map(cells).collect(), settings)
}

#[test]
fn two_native_arms_render_the_same_bits_as_each_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let commands = folder.path().join("commands");
    let alone = |name: &str, lines: &str| {
        std::fs::write(&commands, lines).expect("written");
        let mut more = recorded(folder.path(), name);
        more.extend([
            "--commands".into(),
            commands.to_str().expect("plain").into(),
        ]);
        command(folder.path(), &["native"], &texts(&more))
    };
    for (name, lines) in [("plain.csv", ""), ("zoomed.csv", "at 5 zoom 1.2\n")] {
        let output = alone(name, lines).output().expect("it runs");
        assert!(output.status.success(), "{}", output_text(&output));
        assert!(
            !output_text(&output).contains("native]"),
            "{}",
            output_text(&output)
        );
    }
    let output = alone("felt.csv", "on 2 at 5 zoom 1.2\n")
        .args(["--device", "native"])
        .output();
    let output = output.expect("it runs");
    let printed = output_text(&output);
    assert!(output.status.success(), "{printed}");
    for number in [1, 2] {
        let name = format!("[{number} native] ");
        let recording = format!("{name}recording      ");
        assert!(printed.contains(&recording), "{printed}");
    }
    // Reading at the start belongs to no device.
    let at_start = ["reading hills.tif", "planning a path over hills.tif"];
    let is_named =
        |line: &str| line.starts_with('[') || at_start.iter().any(|begin| line.starts_with(begin));
    assert!(printed.lines().all(is_named), "{printed}");
    assert!(printed.contains("[2 native] view 1: "), "{printed}");
    assert!(!printed.contains("[1 native] view 1: "), "{printed}");
    assert!(!folder.path().join("felt.csv").exists());
    for (alone, among_two) in [("plain.csv", "felt-1.csv"), ("zoomed.csv", "felt-2.csv")] {
        let (alone, among_two) = (
            rendered(&folder.path().join(alone)),
            rendered(&folder.path().join(among_two)),
        );
        let touches = alone.0[0].iter().position(|name| name == "contact");
        let touches = touches.expect("a column");
        let touched = alone.0.iter().filter(|row| row[touches] == "1").count();
        assert!(touched > 1_000, "{touched} ticks of contact");
        assert_eq!(alone.0.len(), among_two.0.len());
        assert!(alone == among_two, "they differ");
    }
}

#[test]
fn signal_closes_each_session_with_confirmation() {
    for name in ["INT", "TERM"] {
        let pair = Pair::of(SocketDevice::start());
        let child = pair.start();
        signal(&child, name);
        let output = end_of(child);
        let printed = output_text(&output);
        assert!(output.status.success(), "{name}: {printed}");
        for number in [1, 2] {
            assert!(pair.recording(number).exists(), "{name}: {printed}");
            let served = &pair.served[number - 1];
            assert_eq!(served.last_end(), SessionEnd::Goodbye, "{name}");
        }
    }
}

/// Safety: 34.
#[test]
fn unconfirmed_board_is_named_beside_a_confirmed_one() {
    let pair = Pair::of(SocketDevice::start());
    let child = pair.start();
    pair.served[1].deaf.store(true, Ordering::Relaxed);
    signal(&child, "INT");
    let output = end_of(child);
    let printed = output_text(&output);
    assert_eq!(output.status.code(), Some(1), "{printed}");
    let expected = "did not confirm that it is disarmed: switch the amplifiers off";
    let of = |number| {
        let name = pair.name(number);
        let lines = printed.lines().filter(move |line| line.starts_with(&name));
        lines.filter(|line| line.contains(expected)).count()
    };
    // When it happened, and at the end.
    assert_eq!((of(1), of(2)), (0, 2), "{printed}");
    assert!(
        printed.contains("error: 1 of 2 devices failed"),
        "{printed}"
    );
    assert!(
        pair.recording(1).exists() && pair.recording(2).exists(),
        "{printed}"
    );
    assert_eq!(pair.served[0].last_end(), SessionEnd::Goodbye);
    assert_eq!(pair.served[1].last_end(), SessionEnd::Replaced);
}

/// Safety: 34.
#[test]
fn second_signal_names_the_unconfirmed_boards() {
    let pair = Pair::of(SocketDevice::start());
    let mut child = pair.start();
    pair.served[1].deaf.store(true, Ordering::Relaxed);
    signal(&child, "INT");
    // The first has confirmed, and the second waits.
    let compared = format!("{} recording ", pair.name(1));
    child.stdout = Some(read_until(child.stdout.take().expect("piped"), &[compared]));
    pair.served[1].wait_for_ignored_bye();
    signal(&child, "INT");
    let output = end_of(child);
    let printed = output_text(&output);
    assert_eq!(output.status.code(), Some(130), "{printed}");
    let line = printed.lines().find(|line| line.contains("ended at once"));
    let line = line.expect(&printed);
    assert_eq!(pair.served[0].last_end(), SessionEnd::Goodbye);
    assert!(line.contains(&pair.name(2)), "{printed}");
    assert!(!line.contains(&pair.name(1)), "{printed}");
}

/// Safety: 34.
#[test]
fn lost_device_is_waited_for_and_the_other_continues() {
    let gone = Arc::new(AtomicBool::new(false));
    let is_gone = Arc::clone(&gone);
    let mortal = SocketDevice::with(move || {
        let die = move || {
            if is_gone.load(Ordering::Relaxed) {
                // With its socket, and without a message.
                std::panic::resume_unwind(Box::new(()));
            }
        };
        (Native::for_replay().free_running(), die)
    });
    let pair = Pair::of(mortal);
    let mut child = pair.start();
    gone.store(true, Ordering::Relaxed);
    // The line about it is that of the second device.
    let (err, name) = (child.stderr.take().expect("piped"), pair.name(2));
    let mut lines = BufReader::with_capacity(1, err);
    let mut line = String::new();
    while !line.contains("waiting for tcp:") {
        line.clear();
        assert!(lines.read_line(&mut line).expect("text") > 0, "it ended");
    }
    assert!(line.starts_with(&name), "{line}");
    child.stderr = Some(lines.into_inner());
    signal(&child, "INT");
    let output = end_of(child);
    let printed = output_text(&output);
    assert_eq!(output.status.code(), Some(1), "{printed}");
    assert!(
        printed.contains("error: 1 of 2 devices failed"),
        "{printed}"
    );
    assert!(printed.contains(&format!("{name} error: ")), "{printed}");
    assert!(
        !printed.contains(&format!("{} error: ", pair.name(1))),
        "{printed}"
    );
    assert_eq!(pair.served[0].last_end(), SessionEnd::Goodbye);
    assert!(
        pair.recording(1).exists() && pair.recording(2).exists(),
        "{printed}"
    );
}

#[test]
fn absent_device_fails_alone_and_is_reported_at_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = SocketDevice::start();
    let there = format!("tcp:{}", served.address);
    // The listener no longer exists.
    let absent = {
        let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
        format!("tcp:{}", listener.local_addr().expect("a port"))
    };
    let record = recorded(folder.path(), "felt.csv");
    let devices = [absent.as_str(), there.as_str()];
    let mut child = command(folder.path(), &devices, &texts(&record))
        .spawn()
        .expect("it runs");
    let failed = format!("[1 {absent}] error: ");
    child.stderr = Some(read_until(child.stderr.take().expect("piped"), &[failed]));
    let serves = format!("[2 {there}] device ");
    child.stdout = Some(read_until(child.stdout.take().expect("piped"), &[serves]));
    signal(&child, "INT");
    let output = end_of(child);
    let printed = output_text(&output);
    assert_eq!(output.status.code(), Some(1), "{printed}");
    assert!(
        printed.contains("1 of 2 devices failed, the others did not"),
        "{printed}"
    );
    assert_eq!(served.last_end(), SessionEnd::Goodbye, "{printed}");
    assert!(folder.path().join("felt-2.csv").exists(), "{printed}");
    assert!(!folder.path().join("felt-1.csv").exists(), "{printed}");
}

#[test]
fn fault_is_reported_only_for_the_affected_device() {
    // A current flows without a command.
    let conducts = SocketDevice::with(|| {
        let current = Box::new(|_, sense: &mut GuardInputs, _: &_| {
            sense.measured_ma = Some([2_000, 0, 0]);
        });
        let device = Native::for_replay()
            .free_running()
            .with_fault_injector(current);
        (device, || {})
    });
    let pair = Pair::of(conducts);
    let mut child = pair.start();
    let fault = format!("{} FAULT ", pair.name(2));
    child.stderr = Some(read_until(child.stderr.take().expect("piped"), &[fault]));
    signal(&child, "INT");
    let output = end_of(child);
    let printed = output_text(&output);
    assert!(output.status.success(), "{printed}");
    assert!(
        !printed.contains(&format!("{} FAULT", pair.name(1))),
        "{printed}"
    );
    for served in &pair.served {
        assert_eq!(served.last_end(), SessionEnd::Goodbye);
    }
    let fault_of = |served: &SocketDevice| served.status().health.report.fault;
    assert_eq!(fault_of(&pair.served[0]), None);
    assert!(fault_of(&pair.served[1]).is_some());
}

#[test]
fn hostile_device_does_not_disturb_the_other() {
    let folder = tempfile::tempdir().expect("a folder");
    let served = SocketDevice::start();
    let (there, greedy) = (
        format!("tcp:{}", served.address),
        format!("tcp:{}", greedy_device::start()),
    );
    let mut more = recorded(folder.path(), "felt.csv");
    more.push("--unchecked".into());
    let devices = [greedy.as_str(), there.as_str()];
    let mut child = command(folder.path(), &devices, &texts(&more))
        .spawn()
        .expect("it runs");
    let begun = [
        format!("[1 {greedy}] device "),
        format!("[2 {there}] device "),
    ];
    child.stdout = Some(read_until(child.stdout.take().expect("piped"), &begun));
    // Progress lines are from the device with samples.
    let goes = format!("[2 {there}] ");
    child.stderr = Some(read_until(child.stderr.take().expect("piped"), &[goes]));
    signal(&child, "INT");
    let output = end_of(child);
    let printed = output_text(&output);
    assert_eq!(output.status.code(), Some(1), "{printed}");
    assert!(
        printed.contains(&format!("[1 {greedy}] error: ")),
        "{printed}"
    );
    assert!(
        !printed.contains(&format!("[2 {there}] error: ")),
        "{printed}"
    );
    assert_eq!(served.last_end(), SessionEnd::Goodbye, "{printed}");
}

/// Returns the bytes that a command reads from all files, counted by the system: this includes the
/// system's own files, whose numbers vary in length.
#[cfg(target_os = "linux")]
fn bytes_read(command: &Command) -> u64 {
    let output = Command::new("sh")
        .args(["-c", "\"$@\" >&2 && cat /proc/$$/io", "sh"])
        .arg(command.get_program())
        .args(command.get_args())
        .output()
        .expect("it runs");
    assert!(output.status.success(), "{}", output_text(&output));
    let counts = String::from_utf8_lossy(&output.stdout).into_owned();
    let read = counts.lines().find_map(|line| line.strip_prefix("rchar: "));
    read.and_then(|read| read.parse().ok()).expect(&counts)
}

/// Samples in a row of the terrain, which stays in its file.
#[cfg(target_os = "linux")]
const SIDE: u32 = 2048;

/// Bytes of a row, the smallest read of the file.
#[cfg(target_os = "linux")]
const ROW_BYTES: u64 = 4 * SIDE as u64;

#[cfg(target_os = "linux")]
#[test]
fn second_device_causes_no_additional_terrain_reads() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("large.tif");
    terrain_file(&path, Kind::Fractal, SIDE, 1);
    let path = path.to_str().expect("a plain path");
    let read_by = |devices: usize| {
        let mut command = Command::new(hapterra_binary());
        command.args(["run", path, "--input", "in-memory=1MB", "--duration", "8s"]);
        // Otherwise the second run would read the first run's cache of a file two seconds old.
        command.args(["--cache", "off"]);
        for _ in 0..devices {
            command.args(["--device", "native"]);
        }
        bytes_read(&command)
    };
    let (one, two) = (read_by(1), read_by(2));
    assert!(one > 1 << 20, "{one} bytes: the terrain is read");
    // Less than one row of the terrain.
    assert!(one.abs_diff(two) < ROW_BYTES / 2, "{one} and {two} bytes");
}

#[test]
fn options_for_one_device_are_refused_for_several() {
    let folder = tempfile::tempdir().expect("a folder");
    let record = recorded(folder.path(), "felt.csv");
    for (devices, more, expected) in [
        (["tcp:localhost:4", "tcp:127.0.0.1:4"], None, "are the same"),
        (
            ["tcp:h.invalid:4", "tcp:h.invalid:4"],
            None,
            "are both tcp:h.invalid:4",
        ),
        (
            ["native", "native"],
            Some("--view"),
            "--view shows one device",
        ),
    ] {
        let mut command = command(folder.path(), &devices, &texts(&record));
        let output = command.args(more).output().expect("it runs");
        let printed = output_text(&output);
        assert_eq!(output.status.code(), Some(1), "{printed}");
        assert!(printed.contains(expected), "{printed}");
        assert!(printed.contains("hint: "), "{printed}");
    }
    let there = std::fs::read_dir(folder.path()).expect("a folder");
    let names: Vec<_> = there
        .map(|file| file.expect("a file").file_name())
        .collect();
    assert_eq!(names, ["hills.tif"]);
}
