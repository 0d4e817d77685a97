//! Marks: made by a command during contact, recorded with tick and clock, and kept by a replay.

use hapterra::replay::{Mark, Settings, Trajectory};
use hapterra_tests::timeouts::changed_at_unix_s;

use super::test_folder::{Folder, rows};
use super::views::comments;

const COMMANDS: &str = "at 1 mark stimulus #1, \"left\"\nat 2 zoom 1.5\nmark zoomed\n\
    at 4 mark \u{1b}[31m\nat 4.5 mark 'end'\n";

const TEXTS: [&str; 3] = ["stimulus #1, \"left\"", "zoomed", "'end'"];

/// Runs the hills with the commands. Returns the output.
fn run(folder: &Folder, record: &str) -> String {
    folder.write("commands", COMMANDS);
    let [terrain, commands, record] =
        ["hills.tif", "commands", record].map(|name| folder.text(name));
    let arguments = ["run", &terrain, "--device", "native", "--duration", "5s"];
    let more = ["--commands", &commands, "--out", &record];
    folder.runs(&[&arguments[..], &more].concat())
}

fn marks_of(folder: &Folder, name: &str) -> Vec<Mark> {
    let trajectory = Trajectory::open(&folder.path(name)).expect("opened");
    trajectory.settings().expect("settings").marks.clone()
}

#[test]
fn mark_has_tick_time_and_host_clock() {
    let folder = Folder::new();
    let printed = run(&folder, "felt.csv");
    let [began, ended] = ["commands", "felt.csv"].map(|name| changed_at_unix_s(&folder.path(name)));
    assert!(
        printed.contains(r"line 4 of the commands: `at 4 mark \u{1b}[31m`"),
        "{printed}"
    );
    assert!(
        printed.contains("the text of a mark has no control characters"),
        "{printed}"
    );
    let text = folder.read("felt.csv");
    let marks = marks_of(&folder, "felt.csv");
    let texts: Vec<_> = marks.iter().map(|mark| mark.text.as_str()).collect();
    assert_eq!(texts, TEXTS);
    let rows = rows(&text);
    let mut before = began;
    for mark in &marks {
        let tick = mark.tick.expect("answered").to_string();
        let row = rows.iter().find(|row| row["tick"] == tick);
        let t_s: f64 = row.expect("a row")["t_s"].parse().expect("s");
        assert_eq!(t_s, mark.t_s, "{mark:?}");
        assert!((before..=ended).contains(&mark.host_unix_s), "{mark:?}");
        before = mark.host_unix_s;
        assert!(
            printed.contains(&format!("`{}` at tick {tick}", mark.text)),
            "{printed}"
        );
    }
    // Each mark is made at its requested time; the one without a time follows the zoom.
    for (mark, at_s) in marks.iter().zip([1.0, 2.1, 4.5]) {
        assert!((at_s..at_s + 1.5).contains(&mark.t_s), "{mark:?}");
    }
    // As documented: all comments together are one document.
    let settings = Settings::from_toml(&comments(&text)).expect("read");
    assert_eq!(settings.expect("settings").marks, marks);
}

#[test]
fn marks_survive_replays_in_both_forms() {
    let folder = Folder::new();
    run(&folder, "felt.parquet");
    let marks = marks_of(&folder, "felt.parquet");
    assert_eq!(marks.len(), TEXTS.len());
    folder.replays("felt.parquet", "again.csv", &[]);
    folder.replays("again.csv", "third.csv", &[]);
    folder.replays("third.csv", "fourth.parquet", &[]);
    for name in ["again.csv", "third.csv", "fourth.parquet"] {
        assert_eq!(marks_of(&folder, name), marks, "{name}");
    }
    assert!(folder.read("again.csv") == folder.read("third.csv"));
    folder.replays("again.csv", "path.csv", &["--ignore-settings"]);
    assert!(!folder.read("path.csv").contains("mark"));
}

#[test]
fn demo_recording_has_its_marks() {
    let folder = Folder::new();
    folder.write("commands", COMMANDS);
    let [terrain, out, commands] = ["hills.tif", "demo", "commands"].map(|n| folder.text(n));
    let arguments = ["demo", &terrain, "--out", &out, "--duration", "5s"];
    folder.runs(&[&arguments[..], &["--commands", &commands]].concat());
    let marks = marks_of(&folder, "demo/hills.csv");
    let texts: Vec<_> = marks.iter().map(|mark| mark.text.as_str()).collect();
    assert_eq!(texts, TEXTS);
    assert!(marks.iter().all(|mark| mark.tick.is_some()));
}
