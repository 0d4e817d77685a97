//! Events on a local socket: those of a native run, and the examples that read them.

use std::io::{BufRead, BufReader, Write};
use std::iter::from_fn;
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread::{JoinHandle, spawn};

use hapterra::replay::Trajectory;
use hapterra::synth::Kind;
use hapterra_core::wire::session::SessionEnd;
use hapterra_tests::socket_device::SocketDevice;
use hapterra_tests::timeouts::next;
use hapterra_tests::{hapterra_binary, repository, terrain_file};
use serde_json::Value;

fn hapterra(arguments: &[&str]) -> Command {
    let mut command = Command::new(hapterra_binary());
    command.args(arguments).env_remove("HAPTERRA_MPS2_ELF");
    command
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

/// An example that prints, and the stream from which it reads events.
struct Example {
    child: Child,
    line: TcpStream,
}

/// Starts an example with text as its output; `None`, with a message, without Python.
fn example(name: &str) -> Option<Example> {
    let script = repository().join("docs/examples").join(name);
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = listener.local_addr().expect("an address").port();
    let child = Command::new("python3")
        .args([text(&script), &port.to_string(), "--text"])
        .stdout(Stdio::piped())
        .spawn();
    match child {
        Ok(child) => {
            let (line, _) = listener.accept().expect("it connects");
            Some(Example { child, line })
        }
        Err(why) => {
            eprintln!("skipped: {name}: python3 does not start: {why}");
            None
        }
    }
}

/// Returns the lines that an example prints for these events.
fn printed_lines(mut example: Example, events: &[Value]) -> Vec<String> {
    for event in events {
        writeln!(example.line, "{event}").expect("taken");
    }
    drop(example.line);
    let output = example.child.wait_with_output().expect("ended");
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).expect("text");
    text.lines().map(str::to_owned).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().expect("a list").iter();
    list.map(|number| number.as_f64().expect("a number"))
        .collect()
}

/// Returns true if numbers agree except in the last digit, which the JSON reader here rounds.
fn near(reported: &[f64], recorded: &[f64]) -> bool {
    let is_near = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-12 * b.abs();
    reported.len() == recorded.len() && reported.iter().zip(recorded).all(is_near)
}

/// Writes hills to a folder.
fn hills_in(folder: &Path, size: u32) -> PathBuf {
    let hills = folder.join("hills.tif");
    terrain_file(&hills, Kind::Fractal, size, 1);
    hills
}

/// A command that sends events, and its events.
struct EventRun {
    child: Child,
    stdin: Option<ChildStdin>,
    events: JoinHandle<Vec<Value>>,
    /// Each event as it arrives.
    arrived: Receiver<Value>,
    /// Connections that are never read.
    stuck: TcpStream,
    stderr: JoinHandle<Vec<String>>,
}

impl EventRun {
    /// Starts the command with this value of `--events`.
    fn start(arguments: &[&str], events: &str) -> Self {
        let mut child = hapterra(&[arguments, &["--events", events]].concat())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("started");
        let mut reported = BufReader::new(child.stderr.take().expect("piped"));
        let mut address = None;
        while address.is_none() {
            let mut line = String::new();
            assert!(
                reported.read_line(&mut line).expect("a line") > 0,
                "no address"
            );
            let rest = line.strip_prefix("events         ");
            address = rest.map(|rest| rest.trim().to_owned());
        }
        let address = address.expect("where it listens");
        let connect = || TcpStream::connect(&address).expect("connected");
        let (stream, stuck) = (connect(), connect());
        let (sender, arrived) = channel();
        let events = spawn(move || {
            let lines = BufReader::new(stream).lines().map_while(Result::ok);
            let parsed = lines.map(|line| serde_json::from_str(&line).expect("JSON"));
            parsed
                .inspect(|event: &Value| drop(sender.send(event.clone())))
                .collect::<Vec<Value>>()
        });
        Self {
            stdin: child.stdin.take(),
            child,
            events,
            arrived,
            stuck,
            stderr: spawn(move || reported.lines().map_while(Result::ok).collect()),
        }
    }

    /// Returns the next event of a kind.
    fn wait_for(&self, kind: &str) -> Value {
        let found = from_fn(|| next(&self.arrived)).find(|event| event["event"] == *kind);
        found.unwrap_or_else(|| panic!("no {kind}"))
    }

    /// Returns all events after a successful end.
    fn end(mut self) -> Vec<Value> {
        let stderr = self.stderr.join().expect("read to the end");
        assert!(self.child.wait().expect("ended").success(), "{stderr:?}");
        drop(self.stuck);
        self.events.join().expect("read to the end")
    }
}

/// All events of a run of five seconds over hills, its recording, and the output of the examples.
#[test]
fn run_sends_events_that_the_examples_speak_and_sound() {
    let folder = tempfile::tempdir().expect("a folder");
    let hills = hills_in(folder.path(), 256);
    let [record, commands] = ["felt.csv", "commands"].map(|name| folder.path().join(name));
    std::fs::write(&commands, "at 4 mark a \"b\"\nat 4.1 zoom 1.5\n").expect("written");
    let arguments = [
        "run",
        text(&hills),
        "--device",
        "native",
        "--duration",
        "6s",
    ];
    let more = ["--out", text(&record), "--commands", text(&commands)];
    let events = EventRun::start(&[&arguments[..], &more].concat(), "0,10").end();
    check_events(&events, &record);
    if let Some(example) = example("speak_heights.py") {
        let heights = printed_lines(example, &events);
        let of = |kind: &'static str| events.iter().filter(move |event| event["event"] == *kind);
        let reported: Vec<_> = of("contact")
            .filter(|event| event["touching"] == true)
            .chain(of("place"))
            .map(|event| format!("{:.0} metres", event["height_m"].as_f64().expect("m")))
            .collect();
        assert!(!heights.is_empty());
        assert!(
            heights.iter().all(|height| reported.contains(height)),
            "{heights:?}"
        );
    }
    if let Some(example) = example("sound_impacts.py") {
        let knocks = printed_lines(example, &events);
        let contacts = events.iter().filter(|event| event["speed_mm_s"].is_f64());
        assert_eq!(knocks.len(), contacts.count(), "{knocks:?}");
        assert!(knocks.iter().all(|knock| knock.starts_with("knock at ")));
    }
}

/// Compares events with the recording of the same run.
fn check_events(events: &[Value], record: &Path) {
    let recorded = std::fs::read_to_string(record).expect("there");
    let mut lines = recorded.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<_> = lines.next().expect("a header").split(',').collect();
    let rows: Vec<Vec<_>> = lines.map(|line| line.split(',').collect()).collect();
    let column = |name: &str| header.iter().position(|it| *it == name).expect("a column");
    let row_of = |event: &Value| {
        let tick = event["tick"].to_string();
        let row = rows.iter().find(|row| row[column("tick")] == tick);
        row.unwrap_or_else(|| panic!("no row of {event}"))
    };
    let trajectory = Trajectory::open(record).expect("a recording");
    let settings = trajectory.settings().expect("settings");
    assert_eq!(events[0]["event"], "hello");
    assert_eq!(events[0]["format"], 1);
    let kind = |kind: &str| -> Vec<_> { events.iter().filter(|it| it["event"] == *kind).collect() };
    let mut first = None;
    for event in &events[1..] {
        let number = |name: &str| {
            row_of(event)[column(name)]
                .parse::<f64>()
                .expect("a number")
        };
        assert_eq!(event["device"], 1, "{event}");
        let t_s = event["t_s"].as_f64().expect("s");
        assert!(near(&[t_s], &[number("t_s")]), "{event}");
        if let Some(touching) = event["touching"].as_bool() {
            assert_eq!(f64::from(u8::from(touching)), number("contact"), "{event}");
            let force = ["force_x_n", "force_y_n", "force_z_n"].map(number);
            assert!(
                near(&numbers(&event["force_n"]), &force),
                "{event}: {force:?}"
            );
        }
        if event["event"] == "sample" {
            let hip = ["x_mm", "y_mm", "z_mm"].map(number);
            assert!(near(&numbers(&event["hip_mm"]), &hip), "{event}: {hip:?}");
            let force = ["force_x_n", "force_y_n", "force_z_n"].map(number);
            assert!(near(&numbers(&event["force_n"]), &force), "{event}");
            for name in ["state", "mode"] {
                assert_eq!(event[name], row_of(event)[column(name)], "{event}");
            }
            assert_eq!(event["view"].as_f64(), Some(number("view")), "{event}");
        }
        if event["ground"].is_array() {
            let proxy = ["proxy_x_mm", "proxy_y_mm", "proxy_z_mm"].map(number);
            assert!(
                near(&numbers(&event["proxy_mm"]), &proxy),
                "{event}: {proxy:?}"
            );
            let view = settings
                .views
                .iter()
                .find(|of| f64::from(of.number) == number("view"));
            let (cell_mm, height_mm) = view.map_or(
                (
                    settings.rendered.cell_mm,
                    settings.rendered.height_mm_per_unit,
                ),
                |view| (view.cell_mm, view.height_mm_per_unit),
            );
            let height = event["height_m"].as_f64().expect("m");
            assert!((height * height_mm - proxy[2]).abs() < 1e-6, "{event}");
            // The position moves as far on the ground as the proxy does in the hand.
            let (place, cell_m) = (numbers(&event["ground"]), settings.rendered.cell_m);
            let at = [place[0], place[1], proxy[0] / cell_mm, proxy[1] / cell_mm];
            let from = *first.get_or_insert(at);
            let cell_m = cell_m.expect("metres");
            for axis in 0..2 {
                let on_map = at[axis] - from[axis];
                let in_hand = cell_m * (at[axis + 2] - from[axis + 2]);
                // A map differs in size from its ground by less than this.
                let near = 1e-3 * in_hand.abs() + 1e-6;
                assert!(
                    (on_map - in_hand).abs() <= near,
                    "{event}: {on_map} {in_hand}"
                );
            }
            let lonlat = numbers(&event["lonlat"]);
            assert!(
                (lonlat[0] - 3.0).abs() < 0.1 && lonlat[1].abs() < 0.1,
                "{event}"
            );
        }
    }
    let ticks = kind("sample").into_iter();
    let ticks: Vec<_> = ticks.filter_map(|it| it["tick"].as_u64()).collect();
    let first_tick = ticks.first().expect("samples");
    let expected: Vec<_> = (0..ticks.len() as u64)
        .map(|n| first_tick + 10 * n)
        .collect();
    assert_eq!(ticks, expected, "every tenth, and none is missing");
    let last_row = rows.last().expect("rows")[column("tick")].parse::<u64>();
    let since_sample = last_row.expect("a tick") - ticks.last().expect("samples");
    assert!(
        since_sample < 10,
        "{since_sample} ticks after the last sample"
    );
    let last = events.last().expect("events");
    assert_eq!(
        (&last["event"], &last["disarmed"]),
        (&"end".into(), &true.into())
    );
    let contacts = kind("contact");
    assert!(
        contacts
            .windows(2)
            .all(|pair| pair[0]["touching"] != pair[1]["touching"])
    );
    let began = contacts.iter().find(|event| event["touching"] == true);
    let speed = began.expect("a contact")["speed_mm_s"]
        .as_f64()
        .expect("a speed");
    assert!((1.0..1_000.0).contains(&speed), "{speed} mm/s");
    assert!(kind("place").len() > 5);
    let views: Vec<_> = kind("view")
        .iter()
        .map(|event| event["view"].as_u64())
        .collect();
    assert_eq!(views, [Some(0), Some(1)]);
    let limits = kind("limits");
    for event in &limits {
        let names: Vec<_> = event["limits"].as_array().expect("a list").iter().collect();
        let names: Vec<_> = names.iter().filter_map(|name| name.as_str()).collect();
        assert_eq!(names.join(" "), row_of(event)[column("limits")], "{event}");
    }
    assert!(limits.iter().any(|event| event["mode"] == "armed"));
    let [mark] = kind("mark")[..] else {
        panic!("one mark");
    };
    let [recorded] = &settings.marks[..] else {
        panic!("one mark");
    };
    assert_eq!(mark["text"], recorded.text.as_str());
    assert_eq!(mark["marked_tick"].as_u64(), recorded.tick.map(u64::from));
    let times = ["marked_t_s", "host_unix_s"].map(|name| mark[name].as_f64().expect("s"));
    assert!(
        near(&times, &[recorded.t_s, recorded.host_unix_s]),
        "{mark}"
    );
}

/// A demo sends the events of a run, refuses impossible commands, and has marks.
#[test]
fn demo_emits_samples_marks_and_refusals() {
    let folder = tempfile::tempdir().expect("a folder");
    let hills = hills_in(folder.path(), 64);
    let out = folder.path().join("out");
    let arguments = [
        "demo",
        text(&hills),
        "--device",
        "native",
        "--out",
        text(&out),
    ];
    let more = ["--duration", "2.5s", "--commands", "-"];
    let mut demo = EventRun::start(&[&arguments[..], &more].concat(), "0,100");
    demo.wait_for("sample");
    let mut stdin = demo.stdin.take().expect("piped");
    stdin
        .write_all(b"mark here\nenter 3\nnonsense\n")
        .expect("taken");
    drop(stdin);
    let events = demo.end();
    let kind = |kind: &str| -> Vec<_> { events.iter().filter(|it| it["event"] == *kind).collect() };
    let samples = kind("sample").into_iter();
    let ticks: Vec<_> = samples.filter_map(|it| it["tick"].as_u64()).collect();
    assert!(
        ticks.len() > 5 && ticks.windows(2).all(|pair| pair[1] - pair[0] == 100),
        "{ticks:?}"
    );
    assert_eq!(kind("mark")[0]["text"], "here");
    let refused: Vec<_> = kind("refused")
        .iter()
        .map(|it| it["text"].to_string())
        .collect();
    for why in ["no open question", "no such word"] {
        assert!(refused.iter().any(|text| text.contains(why)), "{refused:?}");
    }
    assert_eq!(kind("end")[0]["disarmed"], true);
}

/// The program that sends commands has ended, with more commands than the device can still execute.
///
/// Safety: 28.
#[test]
fn run_ends_disarmed_when_its_input_ends() {
    let folder = tempfile::tempdir().expect("a folder");
    let hills = hills_in(folder.path(), 64);
    let record = folder.path().join("felt.csv");
    let arguments = [
        "run",
        text(&hills),
        "--device",
        "native",
        "--out",
        text(&record),
    ];
    let mut run = EventRun::start(
        &[&arguments[..], &["--commands", "-", "--end-with-input"]].concat(),
        "0",
    );
    run.wait_for("contact");
    let mut stdin = run.stdin.take().expect("piped");
    stdin
        .write_all(&b"at 1000 zoom 2\n".repeat(2000))
        .expect("taken");
    drop(stdin);
    let events = run.end();
    let last = events.last().expect("events");
    assert_eq!(last["disarmed"], true);
    let t_s = last["t_s"].as_f64().expect("s");
    assert!(
        t_s < 9.0,
        "it ended with its tour, {t_s} s, and not with its input"
    );
    assert!(record.is_file(), "the recording is complete");
    let arguments = [
        "run",
        text(&hills),
        "--commands",
        text(&record),
        "--end-with-input",
    ];
    let refused = hapterra(&arguments).output().expect("started");
    let reported = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(reported.contains("hint: add --commands -"), "{reported}");
}

/// A real arm is zeroed only by the answer to the right question.
///
/// Safety: 28.
#[test]
fn enter_answers_the_question_of_its_number() {
    let folder = tempfile::tempdir().expect("a folder");
    let hills = hills_in(folder.path(), 64);
    let served = SocketDevice::start();
    let device = format!("tcp:{}", served.address);
    let arguments = ["run", text(&hills), "--device", &device, "--unchecked"];
    let mut run = EventRun::start(
        &[&arguments[..], &["--commands", "-", "--end-with-input"]].concat(),
        "0",
    );
    let asks = run.wait_for("arming")["asks"].as_u64().expect("a question");
    let mut stdin = run.stdin.take().expect("piped");
    writeln!(stdin, "enter {}", asks + 1).expect("taken");
    let refused = run.wait_for("refused")["text"].to_string();
    assert!(refused.contains("is not open"), "{refused}");
    writeln!(stdin, "enter {asks}").expect("taken");
    let zeroed = run.wait_for("arming")["lines"].to_string();
    assert!(zeroed.contains("zeroed at 0 0 0 counts"), "{zeroed}");
    // Without its program it closes the session.
    drop(stdin);
    assert_eq!(run.end().last().expect("events")["disarmed"], true);
    assert_eq!(served.last_end(), SessionEnd::Goodbye);
}

#[test]
fn occupied_port_is_an_error_before_arming() {
    let folder = tempfile::tempdir().expect("a folder");
    let hills = hills_in(folder.path(), 64);
    let occupied = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = occupied
        .local_addr()
        .expect("an address")
        .port()
        .to_string();
    let arguments = ["run", text(&hills), "--device", "native", "--events", &port];
    let run = hapterra(&arguments).output().expect("started");
    let reported = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(1), "{reported}");
    assert!(
        reported.contains(&format!("on port {port} of 127.0.0.1")),
        "{reported}"
    );
    assert!(reported.contains("hint: name another port"), "{reported}");
}
