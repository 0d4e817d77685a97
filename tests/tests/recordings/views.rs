//! Views that change while a terrain is touched: commands of `demo` and `run`, their
//! recordings, and the replay of these.

use std::process::{Command, Stdio};

use hapterra::replay::{Settings, Trajectory};
use hapterra_tests::hapterra_binary;

use super::folder::{Folder, rows, said};

/// Wide enough to be zoomed and panned.
const SIZE: u32 = 512;

/// All comments together, as the page on recordings reads them.
fn comments(text: &str) -> String {
    let lines = text.lines().filter(|line| line.starts_with('#'));
    lines
        .map(|line| format!("{}\n", line.get(2..).unwrap_or("")))
        .collect()
}

const COMMANDS: &str = "# while a scripted hand slides\nat 3.8 zoom 1.5\nat 4.7 exaggerate 1.25\n\
    spin 3\nat 5.5 pan 2 1\nat 6.5 stiffness 0.8\nat 7.5 clutch on\nat 8 clutch off\n";

/// What a demo with these commands wrote; what it said.
fn demo(folder: &Folder) -> String {
    folder.write("commands", COMMANDS);
    let [terrain, out, commands] = ["hills.tif", "demo", "commands"].map(|n| folder.text(n));
    let words = ["demo", &terrain, "--out", &out, "--seconds", "9.5"];
    let run = folder.run(&[&words[..], &["--commands", &commands]].concat());
    assert!(run.status.success(), "{}", said(&run));
    said(&run)
}

#[test]
fn a_recording_says_when_and_how_the_view_changed_and_is_felt_again() {
    let folder = Folder::of(SIZE);
    let told = demo(&folder);
    assert!(
        told.contains("line 4 of the commands: `spin 3` is no command"),
        "{told}"
    );
    let text = folder.read("demo/hills.csv");
    let settings = Settings::from_toml(&comments(&text))
        .expect("read")
        .expect("settings");
    let numbers: Vec<_> = settings.views.iter().map(|view| view.number).collect();
    assert_eq!(numbers, [1, 2, 3, 4]);
    let [zoomed, higher, panned, softer] = settings.views[..] else {
        panic!("{:?}", settings.views);
    };
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9;
    assert!(near(zoomed.cell_mm, 1.5 * settings.felt.cell_mm));
    assert!(near(
        higher.height_mm_per_unit,
        1.25 * zoomed.height_mm_per_unit
    ));
    assert_eq!(
        (panned.cell_mm, panned.level),
        (zoomed.cell_mm, zoomed.level)
    );
    assert_eq!(softer.stiffness_n_per_mm, 0.4);
    // Rows name their views, in their order, and there are some of each.
    let live = rows(&text);
    let views: Vec<u32> = live
        .iter()
        .map(|row| row["view"].parse().expect("a view"))
        .collect();
    assert!(views.is_sorted());
    for view in 0..=4 {
        let count = views.iter().filter(|of_row| **of_row == view).count();
        assert!(count > 100, "view {view}: {count} rows");
    }
    // The block that tells of a view stands right before its first row.
    let before = text
        .lines()
        .zip(text.lines().skip(1))
        .find(|(_, row)| row.split(',').next_back() == Some("1") && !row.starts_with('#'));
    assert!(
        before
            .expect("rows of view 1")
            .0
            .starts_with("# max_force_n")
    );
    assert!(folder.path("demo/hills.png").exists());
    // Time goes on, tick by tick.
    let times: Vec<f64> = live
        .iter()
        .map(|row| row["t_s"].parse().expect("s"))
        .collect();
    assert!(
        times
            .windows(2)
            .all(|pair| (pair[1] - pair[0] - 1e-3).abs() < 1e-9)
    );

    let replayed = folder.replay("demo/hills.csv", "again.csv", &[]);
    assert!(replayed.status.success(), "{}", said(&replayed));
    let again_text = folder.read("again.csv");
    let again = rows(&again_text);
    assert_eq!(live.len(), again.len());
    let mut compared = [0; 5];
    for (live, again) in live.iter().zip(&again) {
        for column in ["t_s", "x_mm", "y_mm", "z_mm", "view"] {
            assert_eq!(live[column], again[column]);
        }
        if live["mode"] != "armed" || !live["limits"].is_empty() || live["contact"] == "0" {
            continue;
        }
        compared[live["view"].parse::<usize>().expect("a view")] += 1;
        assert_eq!(again["contact"], "1", "at {} s", live["t_s"]);
        for column in ["force_x_n", "force_y_n", "force_z_n"] {
            let [live_n, again_n] = [live, again].map(|row| row[column].parse::<f64>());
            let off = (live_n.expect("N") - again_n.expect("N")).abs();
            assert!(
                off < 1e-4,
                "{column} at {} s is off by {off} N",
                live["t_s"]
            );
        }
    }
    eprintln!("forces compared in each view: {compared:?}");
    assert!(
        compared.iter().skip(1).all(|count| *count > 50),
        "{compared:?}"
    );
    // What was replayed describes itself, too.
    let of_again = Settings::from_toml(&comments(&again_text)).expect("read");
    assert_eq!(of_again.expect("settings").views, settings.views);
}

#[test]
fn what_cannot_be_replayed_is_refused_and_named() {
    let folder = Folder::of(SIZE);
    demo(&folder);
    let refused = |from: &str, more: &[&str]| {
        let run = folder.replay(from, "again.csv", more);
        assert_eq!(run.status.code(), Some(1), "{}", said(&run));
        assert!(!folder.path("again.csv").exists());
        said(&run)
    };
    let told = refused("demo/hills.csv", &["--cell-mm", "3"]);
    assert!(
        told.contains("5 views") && told.contains("--ignore-settings"),
        "{told}"
    );
    // One of the views is not described.
    let text = folder.read("demo/hills.csv");
    folder.write("less.csv", &text.replace("# number = 2", "# number = 7"));
    let told = refused("less.csv", &[]);
    assert!(told.contains("does not describe view 2"), "{told}");
    assert!(told.contains("line "), "{told}");
    let row = text.lines().last().expect("rows");
    let wrong = format!("{row}x");
    folder.write("wrong.csv", &text.replace(row, &wrong));
    let told = refused("wrong.csv", &[]);
    assert!(
        told.contains("column view") && told.contains("4x"),
        "{told}"
    );
    // The path alone is what it says.
    let run = folder.replay("demo/hills.csv", "again.csv", &["--ignore-settings"]);
    assert!(run.status.success(), "{}", said(&run));
}

#[test]
fn a_parquet_recording_of_views_is_felt_again_too() {
    let folder = Folder::of(SIZE);
    folder.write("commands", "at 3.5 zoom 2\nat 4.5 reset\n");
    let names = ["hills.tif", "felt.parquet", "commands"].map(|name| folder.text(name));
    let [terrain, record, commands] = &names;
    let words = ["run", terrain, "--device", "native", "--record", record];
    let more = ["--commands", commands, "--seconds", "6"];
    let run = folder.run(&[&words[..], &more].concat());
    assert!(run.status.success(), "{}", said(&run));
    assert!(said(&run).contains("view 2: "), "{}", said(&run));
    let trajectory = Trajectory::open(&folder.path("felt.parquet")).expect("opened");
    let settings = trajectory.settings().expect("settings");
    assert_eq!(settings.views.len(), 2);
    assert_eq!(settings.views[1].cell_mm, settings.felt.cell_mm);
    let run = folder.replay("felt.parquet", "again.csv", &[]);
    assert!(run.status.success(), "{}", said(&run));
    let again = folder.read("again.csv");
    assert_eq!(rows(&again).last().expect("rows")["view"], "2");
}

#[test]
fn commands_come_by_standard_input_and_a_file_that_is_not_there_is_told() {
    use std::io::Write;
    let folder = Folder::of(SIZE);
    let [terrain, record] = ["hills.tif", "felt.csv"].map(|name| folder.text(name));
    let words = ["run", &terrain, "--device", "native", "--record", &record];
    let more = ["--seconds", "4.5", "--commands"];
    let mut command = Command::new(hapterra_binary());
    let command = command.args(words).args(more).arg("-");
    let child = command
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .stdout(Stdio::null());
    let mut child = child.spawn().expect("started");
    let mut stdin = child.stdin.take().expect("piped");
    stdin
        .write_all(b"zoom 2\nnonsense\nzoom 1e9\n")
        .expect("written");
    // It goes on when nobody writes any more.
    drop(stdin);
    let run = child.wait_with_output().expect("it ends");
    assert!(run.status.success(), "{}", said(&run));
    for part in [
        "line 2 of the commands: `nonsense`",
        "no more detail",
        "view 1: ",
    ] {
        assert!(said(&run).contains(part), "{part} in {}", said(&run));
    }
    let text = folder.read("felt.csv");
    assert_eq!(rows(&text).last().expect("rows")["view"], "1");
    let none = folder.text("none");
    let run = folder.run(&[&words[..], &more, &[&none]].concat());
    assert_eq!(run.status.code(), Some(1));
    assert!(
        said(&run).contains("none") && said(&run).contains("--commands"),
        "{}",
        said(&run)
    );
}
