//! Changes of the placement during contact: commands of `demo` and `run`, their recordings, and the
//! replays.

use std::process::{Command, Stdio};

use hapterra::replay::settings::PlacementSettings;
use hapterra::replay::{Settings, Trajectory};
use hapterra_core::contact::{MAX_ATOMIC_WORK, WORK_PER_TICK};
use hapterra_tests::{UNCONTROLLED, hapterra_binary};

use super::test_folder::{Folder, output_text, rows};
use super::write_degrees;

/// Wide enough for zooming and panning.
const SIZE: u32 = 512;

/// Returns all comments together, as the page on recordings describes.
pub(super) fn comments(text: &str) -> String {
    let lines = text.lines().filter(|line| line.starts_with('#'));
    lines
        .map(|line| format!("{}\n", line.get(2..).unwrap_or("")))
        .collect()
}

const COMMANDS: &str = "# while a scripted hand slides\nat 3.8 zoom 1.5\nat 4.7 exaggerate 1.25\n\
    spin 3\nat 5.5 pan 2 1\nat 6.5 stiffness 0.8\nat 7.5 clutch on\nat 8 clutch off\n\
    at 8.7 tip 3mm\n";

/// Returns the recording of a demo with these commands, or the messages of its failure.
fn demo(folder: &Folder) -> String {
    folder.write("commands", COMMANDS);
    let [terrain, out, commands] = ["hills.tif", "demo", "commands"].map(|n| folder.text(n));
    let arguments = [
        "demo",
        &terrain,
        "--out",
        &out,
        "--duration",
        "9.5s",
        "--surface",
        UNCONTROLLED,
    ];
    let run = folder.run(&[&arguments[..], &["--commands", &commands]].concat());
    assert!(run.status.success(), "{}", output_text(&run));
    output_text(&run)
}

#[test]
fn recording_has_each_change_of_placement_and_is_replayed() {
    let folder = Folder::of(SIZE);
    let reported = demo(&folder);
    assert!(
        reported.contains("line 4 of the commands: `spin 3` is no command"),
        "{reported}"
    );
    let text = folder.read("demo/hills.csv");
    let settings = Settings::from_toml(&comments(&text))
        .expect("read")
        .expect("settings");
    let numbers: Vec<_> = settings.views.iter().map(|view| view.number).collect();
    assert_eq!(numbers, [1, 2, 3, 4, 5]);
    let [zoomed, higher, panned, softer, sharper] = settings.views[..] else {
        panic!("{:?}", settings.views);
    };
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9;
    assert!(near(zoomed.cell_mm, 1.5 * settings.rendered.cell_mm));
    assert!(near(
        higher.height_mm_per_unit,
        1.25 * zoomed.height_mm_per_unit
    ));
    assert_eq!(
        (panned.cell_mm, panned.level),
        (zoomed.cell_mm, zoomed.level)
    );
    assert_eq!(softer.stiffness_n_per_mm, 0.4);
    let tips = [softer, sharper].map(|view| view.tip_mm);
    assert_eq!(tips, [Some(settings.rendered.tip_mm), Some(3.0)]);
    // Rows name their placements in order, and each has some rows.
    let live = rows(&text);
    let views: Vec<u32> = live
        .iter()
        .map(|row| row["view"].parse().expect("a view"))
        .collect();
    assert!(views.is_sorted());
    for view in 0..=5 {
        let count = views.iter().filter(|of_row| **of_row == view).count();
        assert!(count > 100, "view {view}: {count} rows");
    }
    // The block about a placement is right before its first row.
    let before = text
        .lines()
        .zip(text.lines().skip(1))
        .find(|(_, row)| row.split(',').next_back() == Some("1") && !row.starts_with('#'));
    let (before, _) = before.expect("rows of view 1");
    assert!(before.starts_with("# "), "{before}");
    assert!(folder.path("demo/hills.png").exists());
    // Time continues tick by tick.
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
    assert!(replayed.status.success(), "{}", output_text(&replayed));
    let again_text = folder.read("again.csv");
    let again = rows(&again_text);
    assert_eq!(live.len(), again.len());
    let mut compared = [0; 6];
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
    // The replay's output describes itself as well.
    let of_again = Settings::from_toml(&comments(&again_text)).expect("read");
    assert_eq!(of_again.expect("settings").views, settings.views);
}

#[test]
fn unreplayable_recording_is_refused_with_its_cause() {
    let folder = Folder::of(SIZE);
    demo(&folder);
    let refused = |from: &str, more: &[&str]| {
        let run = folder.replay(from, "again.csv", more);
        assert_eq!(run.status.code(), Some(1), "{}", output_text(&run));
        assert!(!folder.path("again.csv").exists());
        output_text(&run)
    };
    let reported = refused("demo/hills.csv", &["--scale", "3mm/cell"]);
    assert!(
        reported.contains("6 placements") && reported.contains("--ignore-settings"),
        "{reported}"
    );
    // One of the placements is not described.
    let text = folder.read("demo/hills.csv");
    folder.write("less.csv", &text.replace("# number = 2", "# number = 7"));
    let reported = refused("less.csv", &[]);
    assert!(reported.contains("does not describe view 2"), "{reported}");
    assert!(reported.contains("line "), "{reported}");
    let row = text.lines().last().expect("rows");
    let wrong = format!("{row}x");
    folder.write("wrong.csv", &text.replace(row, &wrong));
    let reported = refused("wrong.csv", &[]);
    assert!(
        reported.contains("column view") && reported.contains("5x"),
        "{reported}"
    );
    // Only the path is used.
    let run = folder.replay("demo/hills.csv", "again.csv", &["--ignore-settings"]);
    assert!(run.status.success(), "{}", output_text(&run));
}

#[test]
fn parquet_recording_of_placements_is_replayed() {
    let folder = Folder::of(SIZE);
    folder.write("commands", "at 3.5 zoom 2\nat 4.5 reset\n");
    let names = ["hills.tif", "replayed.parquet", "commands"].map(|name| folder.text(name));
    let [terrain, record, commands] = &names;
    let arguments = ["run", terrain, "--device", "native", "--out", record];
    let more = ["--commands", commands, "--duration", "6s"];
    let run = folder.run(&[&arguments[..], &more].concat());
    assert!(run.status.success(), "{}", output_text(&run));
    assert!(
        output_text(&run).contains("view 2: "),
        "{}",
        output_text(&run)
    );
    let trajectory = Trajectory::open(&folder.path("replayed.parquet")).expect("opened");
    let settings = trajectory.settings().expect("settings");
    assert_eq!(settings.views.len(), 2);
    assert_eq!(settings.views[1].cell_mm, settings.rendered.cell_mm);
    let run = folder.replay("replayed.parquet", "again.csv", &[]);
    assert!(run.status.success(), "{}", output_text(&run));
    let again = folder.read("again.csv");
    assert_eq!(rows(&again).last().expect("rows")["view"], "2");
}

#[test]
fn commands_are_read_from_stdin_and_missing_file_is_an_error() {
    use std::io::Write;
    let folder = Folder::of(SIZE);
    let [terrain, record] = ["hills.tif", "replayed.csv"].map(|name| folder.text(name));
    let arguments = ["run", &terrain, "--device", "native", "--out", &record];
    let more = ["--duration", "4.5s", "--commands"];
    let mut command = Command::new(hapterra_binary());
    let command = command.args(arguments).args(more).arg("-");
    let child = command
        .stdin(Stdio::piped())
        .stderr(Stdio::piped())
        .stdout(Stdio::null());
    let mut child = child.spawn().expect("started");
    let mut stdin = child.stdin.take().expect("piped");
    stdin
        .write_all(b"zoom 2\nnonsense\nzoom 1e9\n")
        .expect("written");
    // It continues after the writer has ended.
    drop(stdin);
    let run = child.wait_with_output().expect("it ends");
    assert!(run.status.success(), "{}", output_text(&run));
    for part in [
        "line 2 of the commands: `nonsense`",
        "no more detail",
        "view 1: ",
    ] {
        assert!(
            output_text(&run).contains(part),
            "{part} in {}",
            output_text(&run)
        );
    }
    let text = folder.read("replayed.csv");
    assert_eq!(rows(&text).last().expect("rows")["view"], "1");
    let none = folder.text("none");
    let run = folder.run(&[&arguments[..], &more, &[&none]].concat());
    assert_eq!(run.status.code(), Some(1));
    assert!(
        output_text(&run).contains("none") && output_text(&run).contains("--commands"),
        "{}",
        output_text(&run)
    );
}

/// With each placement, cells have the size at the rendered place; the recording states where that
/// is, and a replay computes the same cells.
#[test]
fn cells_measured_again_after_a_far_pan_replay_bit_by_bit() {
    let folder = Folder::new();
    // Hills without edges: a proxy's resting place does not depend on its path.
    write_degrees(&folder, |column, row| {
        let (x, y) = (f64::from(column), f64::from(row));
        (3000.0 + 900.0 * (x / 7.0).sin() + 700.0 * (y / 9.0).cos()) as u32
    });
    let pans = "at 3.6 pan 0m 300km\nat 4.6 stiffness 0.9\nat 5.4 pan 0m -200km\n";
    folder.write("commands", pans);
    let names = ["hills.asc", "demo", "commands", "demo/hills.csv"].map(|name| folder.text(name));
    let [terrain, out, commands, recording] = &names;
    let arguments = [
        "demo",
        terrain,
        "--out",
        out,
        "--duration",
        "6.5s",
        "--surface",
        UNCONTROLLED,
        "--commands",
        commands,
    ];
    folder.runs(&[&arguments[..], &["--at", "13,56", "--exaggeration", "9"]].concat());
    let text = folder.read("demo/hills.csv");
    let settings = Settings::from_toml(&comments(&text))
        .expect("read")
        .expect("settings");
    let [north, softer, south] = settings.views[..] else {
        panic!("{:?}", settings.views);
    };
    let first_m = settings.rendered.cell_m.expect("known");
    let latitude = |view: PlacementSettings| view.measured_at.expect("a place")[1];
    let [up, down] = [latitude(north) - 56.0, latitude(softer) - latitude(south)];
    // Meanwhile the hand continues.
    assert!(
        (2.0..6.0).contains(&up) && (0.5..3.0).contains(&down),
        "{up} {down}"
    );
    for view in [north, softer, south] {
        let measured = latitude(view);
        // Of longitude, and as large in the hand as before.
        let narrower = view.cell_m.expect("known") / first_m;
        let expected = measured.to_radians().cos() / 56.0_f64.to_radians().cos();
        assert!(
            (narrower / expected - 1.0).abs() < 1e-3,
            "{narrower} {expected}"
        );
        assert!((view.cell_mm / settings.rendered.cell_mm / narrower - 1.0).abs() < 1e-9);
        assert_eq!(view.exaggeration, settings.rendered.exaggeration);
    }
    let replay = |from: &str, to: &str| {
        folder.runs(&["replay", terrain, from, "-o", &folder.text(to)]);
        folder.read(to)
    };
    let again_text = replay(recording, "again.csv");
    let (live, again) = (rows(&text), rows(&again_text));
    let mut compared = [0; 4];
    for (live, again) in live.iter().zip(&again) {
        if live["mode"] != "armed" || !live["limits"].is_empty() || live["contact"] == "0" {
            continue;
        }
        compared[live["view"].parse::<usize>().expect("a view")] += 1;
        for column in ["x_mm", "y_mm", "z_mm", "contact", "view", "state"] {
            assert_eq!(live[column], again[column], "{column} at {} s", live["t_s"]);
        }
        for axis in ["x", "y", "z"] {
            let column = format!("force_{axis}_n");
            let [live_n, again_n] =
                [live, again].map(|row| row[column.as_str()].parse::<f64>().expect("N"));
            let off = (live_n - again_n).abs();
            assert!(
                off < 1e-4,
                "{column} at {} s is off by {off} N",
                live["t_s"]
            );
        }
    }
    eprintln!("forces compared in each view: {compared:?}");
    assert!(compared.iter().all(|count| *count > 50), "{compared:?}");
    // A replay of the replay is the same file.
    assert!(replay(&folder.text("again.csv"), "same.csv") == again_text);
    // Without these places another terrain is rendered.
    let lines = again_text.split_inclusive('\n');
    let (head, views): (Vec<_>, Vec<_>) = lines.partition(|line| line.contains("measured_at"));
    assert_eq!(head.len(), 4);
    folder.write(
        "blind.csv",
        &views
            .concat()
            .replacen("# level", &(head[0].to_owned() + "# level"), 1),
    );
    let blind = replay(&folder.text("blind.csv"), "replayed.csv");
    assert!(
        rows(&blind)
            .iter()
            .zip(&again)
            .any(|(a, b)| a["force_x_n"] != b["force_x_n"])
    );
}

/// On walls a tick has the most work. At 1 kHz its work suffices, even after a change of the
/// placement: the live recording equals the replay, whose ticks converge, to within rounding.
#[test]
fn replay_of_a_steep_saw_equals_the_live_forces() {
    /// Rounding by the digits of a file, mm.
    const ROUNDING_MM: f64 = 1e-5;
    let folder = Folder::new();
    write_degrees(&folder, |column, row| 500 + 300 * ((column + row) % 9));
    let [terrain, record, commands, again] =
        ["hills.asc", "replayed.csv", "commands", "again.csv"].map(|name| folder.text(name));
    for pan in ["", "at 4.0 pan 2 1\n"] {
        folder.write("commands", pan);
        let arguments = [
            "run", &terrain, "--tip", "0", "--device", "native", "--out", &record,
        ];
        let more = ["--duration", "9s", "--at", "13,56", "--exaggeration", "9"];
        folder.runs(&[&arguments[..], &more, &["--commands", &commands]].concat());
        folder.runs(&["replay", &terrain, &record, "-o", &again]);
        let [live_text, again_text] = ["replayed.csv", "again.csv"].map(|name| folder.read(name));
        let (live, again) = (rows(&live_text), rows(&again_text));
        assert_eq!(live.len(), again.len());
        for (live, again) in live.iter().zip(&again) {
            if live["limits"].contains("CLUTCH") || live["limits"].contains("TERRAIN") {
                continue;
            }
            let apart = |column: &str| {
                let [live, again] = [live, again].map(|row| row[column].parse::<f64>());
                (live.expect("a number") - again.expect("a number")).abs()
            };
            let work: u32 = live["work"].parse().expect("units");
            assert!(work <= WORK_PER_TICK - MAX_ATOMIC_WORK, "{work} units");
            let proxy_mm = ["proxy_x_mm", "proxy_y_mm", "proxy_z_mm"].map(apart);
            let off = proxy_mm.into_iter().fold(0.0, f64::max);
            assert!(off <= ROUNDING_MM, "{off} mm off at {} s", live["t_s"]);
            assert_eq!(live["state"], again["state"], "at {} s", live["t_s"]);
        }
    }
}

/// Old recordings describe a placement without its place: cells are those of the start.
#[test]
fn recording_without_measured_places_replays_unchanged() {
    let folder = Folder::of(SIZE);
    demo(&folder);
    folder.replays("demo/hills.csv", "again.csv", &[]);
    let text = folder.read("demo/hills.csv");
    let (head, views) = text.split_once("[[view]]").expect("views");
    let old: String = views
        .split_inclusive('\n')
        .filter(|line| !line.starts_with("# cell_m =") && !line.starts_with("# measured_at"))
        .collect();
    assert_ne!(old, views);
    folder.write("old.csv", &format!("{head}[[view]]{old}"));
    folder.replays("old.csv", "of_old.csv", &[]);
    let rows_of = |name: &str| {
        let text = folder.read(name);
        let rows = text.lines().filter(|line| !line.starts_with('#'));
        rows.collect::<Vec<_>>().join("\n")
    };
    assert!(rows_of("of_old.csv") == rows_of("again.csv"));
}
