//! `hapterra replay` by time: a path is rendered the same at any density of rows, and a recording
//! at its own tick rate.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hapterra_tests::emulation::emulated_board;
use hapterra_tests::{hapterra_binary, shared};

const STIFFNESS: f64 = 0.5;
/// A surface with a damping of 5 N·s/m.
const DAMPED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/surfaces/damped.toml");

const PARAMS: [&str; 2] = ["--scale=1mm/cell", "--stiffness=0.5"];

/// A row of a replay.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Row {
    t_s: f64,
    hip_mm: [f64; 3],
    contact: bool,
    proxy_mm: [f64; 3],
    force_n: [f64; 3],
}

fn rows(text: &str) -> Vec<Row> {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let row = |line: &str| {
        let numbers = line
            .split(',')
            .take(11)
            .map(|x| x.parse().expect("a number"));
        let numbers: Vec<f64> = numbers.collect();
        let three = |at: usize| [numbers[at], numbers[at + 1], numbers[at + 2]];
        Row {
            t_s: numbers[0],
            hip_mm: three(1),
            contact: numbers[4] == 1.0,
            proxy_mm: three(5),
            force_n: three(8),
        }
    };
    lines.skip(1).map(row).collect()
}

/// A folder with a flat terrain of 80 by 40 cells.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().expect("a folder"));
        let row = vec!["0"; 81].join(" ");
        let grid = "ncols 81\nnrows 41\nxllcorner 0\nyllcorner 0\ncellsize 10\n";
        folder.write("flat.asc", &format!("{grid}{}\n", vec![row; 41].join("\n")));
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("written");
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).expect("there")
    }

    fn replay(&self, from: &str, to: &str, more: &[&str]) -> Output {
        let [terrain, from, to] = ["flat.asc", from, to].map(|name| self.path(name));
        replay(&terrain, &from, &to, more)
    }

    /// Replays `in.csv` to `out.csv`. Returns the rows and the messages.
    fn replayed(&self, path: &str, more: &[&str]) -> (Vec<Row>, String) {
        self.write("in.csv", path);
        let run = self.replay("in.csv", "out.csv", more);
        let printed = output_text(&run);
        assert!(run.status.success(), "{printed}");
        (rows(&self.read("out.csv")), printed)
    }

    /// Returns the messages of a replay of `in.csv` that fails.
    fn fails(&self, path: &str, more: &[&str]) -> String {
        self.write("in.csv", path);
        let run = self.replay("in.csv", "out.csv", more);
        let printed = output_text(&run);
        assert_eq!(run.status.code(), Some(1), "{printed}");
        assert!(printed.contains("hint: "), "{printed}");
        printed
    }

    /// Returns a recording of these rows on the flat terrain at a tick rate.
    fn recording(&self, tick_hz: u32, rows: &str, more: &[&str]) -> String {
        self.write("one.csv", "t_s,x_mm,y_mm,z_mm\n0,40,20,1\n");
        let run = self.replay("one.csv", "one_felt.csv", more);
        assert!(run.status.success(), "{}", output_text(&run));
        let text = self.read("one_felt.csv");
        let settings: Vec<_> = text.lines().filter(|line| line.starts_with('#')).collect();
        let settings = settings.join("\n");
        assert!(settings.contains("# tick_hz = 1000"), "{settings}");
        let settings = settings.replace("tick_hz = 1000", &format!("tick_hz = {tick_hz}"));
        format!("{settings}\nt_s,x_mm,y_mm,z_mm\n{rows}")
    }
}

fn replay(terrain: &Path, from: &Path, to: &Path, more: &[&str]) -> Output {
    let mut command = Command::new(hapterra_binary());
    let command = command
        .arg("replay")
        .args([terrain, from])
        .arg("-o")
        .arg(to);
    command.args(more).output().expect("started")
}

fn output_text(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

/// Returns the rows of a motion, sampled at this rate for some seconds.
fn sampled(rate_hz: u32, seconds: f64, place: impl Fn(f64) -> [f64; 3]) -> String {
    let count = (seconds * f64::from(rate_hz)).round() as u32;
    let row = |row: u32| {
        let t_s = f64::from(row) / f64::from(rate_hz);
        let [x, y, z] = place(t_s);
        format!("{t_s},{x},{y},{z}\n")
    };
    (0..=count).map(row).collect()
}

fn path(rows: &str) -> String {
    format!("t_s,x_mm,y_mm,z_mm\n{rows}")
}

/// Checks a motion into the ground at 20 mm/s: the spring's force, and 5 N s/m times 20 mm/s,
/// limited to the spring's force, from the second tick in contact.
fn pressed(replayed: &[Row]) -> usize {
    let touching: Vec<_> = replayed.iter().filter(|row| row.contact).collect();
    for row in &touching[1..] {
        let spring = STIFFNESS * -row.hip_mm[2];
        let expected = spring + spring.min(5.0 * 20.0 * 1e-3);
        let off = (row.force_n[2] - expected).abs();
        assert!(off < 2e-3, "{row:?}, not {expected} N");
    }
    touching.len()
}

#[test]
fn damping_is_independent_of_the_row_rate() {
    let folder = Folder::new();
    let damped = [&PARAMS[..], &["--surface", DAMPED]].concat();
    for hz in [2, 10, 100, 250, 1_000, 1_600, 8_000, 100_000] {
        let rows = sampled(hz, 0.5, |t| [40.0, 20.0, 2.0 - 20.0 * t]);
        let (replayed, printed) = folder.replayed(&path(&rows), &damped);
        assert_eq!(replayed.len(), 501, "{hz} Hz: a row a tick");
        assert!(pressed(&replayed) > 390, "{hz} Hz");
        let resampled = printed.contains("1000 ticks a second by t_s, on straight lines");
        assert_eq!(resampled, hz != 1_000, "{hz} Hz: {printed}");
    }
}

/// Returns a path along x at 50 mm/s, 1 mm deep: the proxy trails by 0.3 mm due to friction, and by
/// 1 mm, the distance in 0.02 s, due to its viscous part.
fn drag(t_s: f64) -> [f64; 3] {
    let z = (1.0 - 20.0 * t_s).max(-1.0);
    [10.0 + 50.0 * t_s, 20.0, z]
}

const VISCOUS: [&str; 5] = [
    "--scale=1mm/cell",
    "--stiffness=0.5",
    "--friction=0.3",
    "--surface",
    concat!(env!("CARGO_MANIFEST_DIR"), "/data/surfaces/viscous.toml"),
];

fn assert_trails(replayed: &[Row]) {
    let last = replayed.last().expect("rows");
    let trail = last.hip_mm[0] - last.proxy_mm[0];
    assert!((trail - 1.3).abs() < 1e-3, "{trail} mm: {last:?}");
}

#[test]
fn recording_is_replayed_at_its_own_tick_rate() {
    let folder = Folder::new();
    for tick_hz in [
        1_000, 2_000, 3_000, 4_000, 5_000, 6_000, 7_000, 8_000, 9_000, 10_000,
    ] {
        let rows = sampled(tick_hz, 0.6, drag);
        let recording = folder.recording(tick_hz, &rows, &VISCOUS);
        let (replayed, printed) = folder.replayed(&recording, &[]);
        assert_eq!(replayed.len(), rows.lines().count(), "{tick_hz} Hz");
        assert!(!printed.contains("straight lines"), "{printed}");
        assert_trails(&replayed);
        // The output has the input's rows, and replays byte for byte.
        let output = folder.read("out.csv");
        assert!(
            output.contains(&format!("# tick_hz = {tick_hz}\n")),
            "{output}"
        );
        for (replayed, row) in replayed.iter().zip(rows.lines()) {
            let [x, y, z] = replayed.hip_mm;
            assert_eq!(format!("{},{x},{y},{z}", replayed.t_s), row);
        }
        folder.replayed(&output, &[]);
        assert!(
            folder.read("out.csv") == output,
            "{tick_hz} Hz: not the same again"
        );
    }
}

/// A device sends a sample every millisecond at any tick rate, and a link may lose some.
#[test]
fn ticks_between_a_recordings_rows_are_filled_in() {
    let folder = Folder::new();
    let rows = sampled(1_000, 0.6, drag);
    let (replayed, printed) = folder.replayed(&folder.recording(4_000, &rows, &VISCOUS), &[]);
    assert_eq!(replayed.len(), 2_401);
    assert!(printed.contains("4000 ticks a second by t_s"), "{printed}");
    assert_trails(&replayed);
    let kept = |(n, row): (usize, &'_ str)| (n % 7 == 0).then(|| format!("{row}\n"));
    let lossy: String = rows.lines().enumerate().filter_map(kept).collect();
    let (replayed, _) = folder.replayed(&folder.recording(1_000, &lossy, &VISCOUS), &[]);
    assert_eq!(replayed.len(), 596);
    assert_trails(&replayed);
}

#[test]
fn times_that_contradict_a_recordings_rate_are_refused() {
    let folder = Folder::new();
    let recording = folder.recording(1_000, &sampled(4_000, 0.6, drag), &VISCOUS);
    let printed = folder.fails(&recording, &[]);
    let expected =
        "0.00025 s is 0.25 ticks after the row before, but the settings state 1000 ticks";
    assert!(
        printed.contains(expected) && printed.contains("--rows-are-ticks"),
        "{printed}"
    );
    // Row by row it is rendered at the rate of its settings; its path alone, by its times.
    let (replayed, printed) = folder.replayed(&recording, &["--rows-are-ticks"]);
    assert_eq!((replayed.len(), replayed[2_400].t_s), (2_401, 2.4));
    assert!(
        printed.contains("one row of the path a tick, 1000 ticks a second"),
        "{printed}"
    );
    let (replayed, _) =
        folder.replayed(&recording, &[&["--ignore-settings"], &VISCOUS[..]].concat());
    assert_eq!(replayed.len(), 601);
    assert_trails(&replayed);
    for tick_hz in [0, 1_500, 44_100] {
        let recording = recording.replace("tick_hz = 1000", &format!("tick_hz = {tick_hz}"));
        let printed = folder.fails(&recording, &[]);
        assert!(
            printed.contains(&format!("tick_hz = {tick_hz}")),
            "{printed}"
        );
    }
}

#[test]
fn rows_without_times_are_ticks_and_this_is_reported() {
    let folder = Folder::new();
    let damped = [&PARAMS[..], &["--surface", DAMPED]].concat();
    let timed = sampled(1_000, 0.5, |t| [40.0, 20.0, 2.0 - 20.0 * t]);
    let (expected, _) = folder.replayed(&path(&timed), &damped);
    let places = timed
        .lines()
        .map(|row| row.split_once(',').expect("a time").1);
    let places: Vec<_> = places.collect();
    let untimed = format!("x_mm,y_mm,z_mm\n{}\n", places.join("\n"));
    let (replayed, printed) = folder.replayed(&untimed, &damped);
    assert!(replayed == expected);
    let line = printed.lines().last().expect("a line");
    assert!(
        line.ends_with("out.csv; one row of the path a tick, 1000 ticks a second: it has no t_s"),
        "{printed}"
    );
    let zero: String = places.iter().map(|place| format!("0,{place}\n")).collect();
    let (replayed, printed) = folder.replayed(&path(&zero), &damped);
    assert!(replayed == expected);
    assert!(printed.contains("t_s is 0 in all of them"), "{printed}");
    // If times are not used, rows are ticks.
    let slower = (0..).zip(&places);
    let slower = slower.map(|(row, place)| format!("{},{place}\n", f64::from(row) * 1e-2));
    let slower: String = slower.collect();
    let (replayed, _) = folder.replayed(&path(&slower), &damped);
    assert_eq!(replayed.len(), 5_001);
    let (replayed, _) = folder.replayed(
        &path(&slower),
        &[&damped[..], &["--rows-are-ticks"]].concat(),
    );
    assert!(replayed == expected);
}

#[test]
fn wrong_times_are_refused_and_odd_ones_reported() {
    let folder = Folder::new();
    for (rows, expected) in [
        (
            "0,40,20,1\n0.002,40,20,0\n0.001,40,20,1\n",
            "line 4, column t_s: time decreases from 0.002 s to 0.001 s",
        ),
        (
            "0,40,20,1\n0.001,40,20,0\n0.001,40,20,1\n",
            "line 4, column t_s: two places at 0.001 s",
        ),
        (
            "0,40,20,1\n0.001,40,20,1\ninf,40,20,1\n",
            "line 4, column t_s: `inf`",
        ),
        (
            "0,40,20,1\n\n10,40,20,0\n",
            "line 4, column t_s: the HIP moves during a gap of 10 s",
        ),
    ] {
        let printed = folder.fails(&path(rows), &PARAMS);
        assert!(printed.contains(expected), "{rows}: {printed}");
        assert!(!folder.path("out.csv").exists(), "{rows}");
    }
    // These may be milliseconds, or target points.
    let (replayed, printed) = folder.replayed(&path("0,40,20,1\n1,40,20,0\n2,40,20,-1\n"), &PARAMS);
    assert_eq!(replayed.len(), 2_001);
    let remark = "in.csv: 2 times the HIP moves for more than 0.05 s between two rows, 1 s at most";
    assert!(printed.contains(remark), "{printed}");
    let (replayed, printed) = folder.replayed(&path(&sampled(1_000, 0.1, drag)), &PARAMS);
    assert_eq!(
        (replayed.len(), printed.contains("note")),
        (101, false),
        "{printed}"
    );
}

#[test]
fn board_with_another_rate_than_the_recording_is_refused() {
    let Some((_, image)) = emulated_board() else {
        return;
    };
    let folder = Folder::new();
    let recording = folder.recording(4_000, &sampled(4_000, 0.1, drag), &VISCOUS);
    let device = format!("--device=emulated:{}", image.display());
    let printed = folder.fails(&recording, &[&device]);
    assert!(
        printed.contains("the recording has 4000 ticks a second, and the device has 1000"),
        "{printed}"
    );
    let (replayed, _) = folder.replayed(&recording, &[&device, "--ignore-settings"]);
    assert_eq!(replayed.len(), 101);
}

/// Paths and recordings of a review, with the values computed in it.
#[test]
fn reviewed_paths_and_recordings_are_replayed_by_time() {
    let Some(cases) = shared("cases/touch") else {
        return;
    };
    let folder = Folder::new();
    let replayed = |terrain: &str, path: &str, more: &[&str]| {
        let [terrain, path] = [terrain, path].map(|name| cases.join(name));
        let run = replay(&terrain, &path, &folder.path("out.csv"), more);
        assert!(run.status.success(), "{}", output_text(&run));
        rows(&folder.read("out.csv"))
    };
    assert_trails(&replayed(
        "case2_recording_4khz_t.tif",
        "case2_recording_4khz_rec4k.csv",
        &[],
    ));
    let damping = |replayed: &[Row], from: f64, to: f64| {
        let moving = replayed
            .iter()
            .filter(|row| row.contact && row.t_s > from && row.t_s < to);
        let adds: Vec<_> = moving
            .map(|row| row.force_n[2] + STIFFNESS * row.hip_mm[2])
            .collect();
        assert!(adds.len() > 99, "{} rows", adds.len());
        adds
    };
    let adds = damping(
        &replayed("case3_flat33.tif", "case2b_damping_recording_4khz.csv", &[]),
        0.07,
        0.0995,
    );
    assert!(adds.iter().all(|n| (n - 0.1003).abs() < 2e-4), "{adds:?}");
    let params = ["--surface", DAMPED, "--stiffness=0.5"];
    let adds = damping(
        &replayed("case3_flat33.tif", "case3_path_10ms.csv", &params),
        2.1,
        3.9,
    );
    assert!(adds.iter().all(|n| (n - 0.00251).abs() < 1e-4), "{adds:?}");
}
