//! Recordings describe themselves: `replay` renders the recordings of `run`, `demo` and `replay`
//! again as they were.

mod marks;
mod test_folder;
mod views;

use std::path::Path;
use std::process::Command;

use hapterra::replay::{COLUMNS, TICK_COLUMNS};
use hapterra::synth::Kind;
use hapterra_tests::{UNCONTROLLED, hapterra_binary, terrain_file};

use test_folder::{Folder, output_text, rows};

const SETTINGS: [&str; 6] = [
    "--scale=0.7mm/cell",
    "--exaggeration=0.1mm/unit",
    "--level=1",
    "--stiffness=0.3",
    "--max-force=4",
    "--friction=0.25",
];

#[test]
fn recording_is_replayed_with_its_own_settings() {
    let folder = Folder::new();
    folder.write_trajectory("in.csv");
    let (terrain, input) = (folder.text("hills.tif"), folder.text("in.csv"));
    let replayed = folder.text("felt.csv");
    let arguments = ["replay", &terrain, &input, "-o", &replayed];
    folder.runs(&[&arguments[..], &SETTINGS].concat());
    let text = folder.read("felt.csv");
    assert!(rows(&text).iter().any(|row| row["contact"] == "1"));
    for part in [
        "# hapterra-recording = 1",
        "hills.tif",
        "fingerprint",
        "\"square\"",
        "dynamic_mu = 0.25",
    ] {
        assert!(text.contains(part), "{part} in {text}");
    }
    folder.replays("felt.csv", "again.csv", &[]);
    assert!(folder.read("again.csv") == text, "not the same again");
    // Without its settings it is rendered like any other path.
    folder.replays("felt.csv", "plain.csv", &["--ignore-settings"]);
    let plain = folder.read("plain.csv");
    assert!(
        rows(&plain)
            .iter()
            .zip(rows(&text))
            .any(|(a, b)| a["force_z_n"] != b["force_z_n"])
    );
    // An option on the command line has priority, with a note.
    let reported = folder.replays("felt.csv", "stiff.csv", &["--stiffness=0.6"]);
    assert!(
        reported.contains("--stiffness 0.6N/mm, where the recording has 0.3N/mm"),
        "{reported}"
    );
    assert!(
        folder
            .read("stiff.csv")
            .contains("# stiffness_n_per_mm = 0.6")
    );
}

#[test]
fn recording_of_another_terrain_is_refused() {
    let folder = Folder::new();
    folder.write_trajectory("in.csv");
    folder.replays("in.csv", "felt.csv", &[]);
    let other = folder.text("other.tif");
    terrain_file(other.as_ref(), Kind::Fractal, 256, 7);
    let (replayed, out) = (folder.text("felt.csv"), folder.text("out.csv"));
    let reported = folder.fails(&["replay", &other, &replayed, "-o", &out]);
    for part in [
        "other.tif",
        "hills.tif",
        "its heights differ",
        "--ignore-settings",
    ] {
        assert!(reported.contains(part), "{part} in {reported}");
    }
    assert!(!folder.path("out.csv").exists());
    folder.runs(&["replay", &other, &replayed, "-o", &out, "--ignore-settings"]);
    // The same heights under another name are the same terrain.
    std::fs::copy(folder.path("hills.tif"), folder.path("copy.tif")).expect("copied");
    folder.runs(&["replay", &folder.text("copy.tif"), &replayed, "-o", &out]);
    let later = folder
        .read("felt.csv")
        .replacen("recording = 1", "recording = 2", 1);
    std::fs::write(folder.path("later.csv"), later).expect("written");
    let reported = folder.fails(&["replay", &other, &folder.text("later.csv"), "-o", &out]);
    assert!(
        reported.contains("format 2") && reported.contains("hint: "),
        "{reported}"
    );
}

/// Columns that depend only on the terrain and the path; the path comes first.
const REPLAYED_COLUMNS: [&str; 9] = [
    "t_s",
    "x_mm",
    "y_mm",
    "z_mm",
    "contact",
    "proxy_x_mm",
    "proxy_y_mm",
    "proxy_z_mm",
    "state",
];

/// The guard reaches a force by steps in single precision: the result differs from the spring's
/// force by the rounding of one step, N.
const ROUNDING_N: f64 = 1e-6;

/// Replays a recording and compares: every tick with all its terrain has the same bits, and without
/// a limit of the guard the force is the same to within rounding.
fn is_reproduced(folder: &Folder, terrain: &str, recording: &str) {
    let [terrain, from, to] = [terrain, recording, "again.csv"].map(|name| folder.text(name));
    folder.runs(&["replay", &terrain, &from, "-o", &to]);
    let (live, again) = (folder.read(recording), folder.read("again.csv"));
    let header = live.lines().find(|line| !line.starts_with('#'));
    let columns: Vec<_> = header.expect("a header").split(',').collect();
    let mut documented: Vec<_> = COLUMNS
        .iter()
        .flat_map(|(names, _)| *names)
        .copied()
        .collect();
    if !columns.contains(&"tick") {
        // A `demo` has no board.
        documented.retain(|name| !TICK_COLUMNS.contains(name));
    }
    assert_eq!(columns, documented, "columns of the reference");
    let (live, again) = (rows(&live), rows(&again));
    assert_eq!(live.len(), again.len());
    let mut compared = 0;
    for (live, again) in live.iter().zip(&again) {
        let (path, replayed) = REPLAYED_COLUMNS.split_at(4);
        let replayed = match live["limits"].contains("TERRAIN_MISSING") {
            true => &[][..],
            false => replayed,
        };
        for column in path.iter().chain(replayed).copied() {
            assert_eq!(live[column], again[column], "{column} at {} s", live["t_s"]);
        }
        if live["mode"] == "armed" && live["limits"].is_empty() && live["contact"] == "1" {
            compared += 1;
            for column in ["force_x_n", "force_y_n", "force_z_n"] {
                let [live, again] = [live, again].map(|row| row[column]);
                let number = |text: &str| text.parse::<f64>().expect("a number");
                let off = (number(live) - number(again)).abs();
                assert!(off < ROUNDING_N, "{column}: {live} and {again}");
            }
        }
    }
    assert!(compared > 300, "only {compared} forces to compare");
}

#[test]
fn run_recording_replays_bit_by_bit() {
    let folder = Folder::new();
    let (terrain, record) = (folder.text("hills.tif"), folder.text("run.csv"));
    let arguments = [
        "run", &terrain, "--tip", "0", "--device", "native", "--out", &record,
    ];
    folder.runs(
        &[
            &arguments[..],
            &[
                "--duration",
                "6s",
                "--scale",
                "0.9mm/cell",
                "--surface",
                UNCONTROLLED,
            ],
        ]
        .concat(),
    );
    is_reproduced(&folder, "hills.tif", "run.csv");
}

#[test]
fn demo_recording_replays_bit_by_bit() {
    let folder = Folder::new();
    let (terrain, out) = (folder.text("hills.tif"), folder.text("demo"));
    // Without an image or a device it runs in the program itself, and prints this.
    let reported = folder.runs(&[
        "demo",
        &terrain,
        "--out",
        &out,
        "--duration",
        "6s",
        "--surface",
        UNCONTROLLED,
    ]);
    assert!(reported.contains("--device native"), "{reported}");
    is_reproduced(&folder, "hills.tif", "demo/hills.csv");
}

/// Writes a terrain of ten degrees from south to north, hills.asc, whose cells differ in size.
fn write_degrees(folder: &Folder, height: impl Fn(u32, u32) -> u32) {
    let mut text = "ncols 60\nnrows 101\nxllcenter 10\nyllcenter 55\ncellsize 0.1\n".to_owned();
    for row in 0..101 {
        let heights = (0..60).map(|column| height(column, row).to_string());
        text += &(heights.collect::<Vec<_>>().join(" ") + "\n");
    }
    std::fs::write(folder.path("hills.asc"), text).expect("written");
    let degrees = r#"GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]"#;
    std::fs::write(folder.path("hills.prj"), degrees).expect("written");
}

#[test]
fn location_far_from_the_middle_replays_with_its_own_cells() {
    let folder = Folder::new();
    write_degrees(&folder, |column, row| 500 + 300 * ((column + row) % 9));
    let [terrain, out] = ["hills.asc", "demo"].map(|name| folder.text(name));
    let arguments = [
        "demo",
        &terrain,
        "--out",
        &out,
        "--duration",
        "4s",
        "--surface",
        UNCONTROLLED,
    ];
    folder.runs(&[&arguments[..], &["--at", "13,56", "--exaggeration", "9"]].concat());
    let text = folder.read("demo/hills.csv");
    assert!(text.contains("# measured_at = [13.0, 56.0]"), "{text}");
    is_reproduced(&folder, "hills.asc", "demo/hills.csv");
    // An earlier version measured a map's cells to 1e-7; other sizes are other cells.
    let (_, cell_m) = text.split_once("# cell_m = ").expect("known");
    let cell_m = cell_m.lines().next().expect("a number");
    let with = |share: f64| {
        let other = cell_m.parse::<f64>().expect("metres") * (1.0 + share);
        folder.write("other.csv", &text.replace(cell_m, &other.to_string()));
        let arguments = ["hills.asc", "other.csv", "again.csv"].map(|name| folder.text(name));
        folder.run(&["replay", &arguments[0], &arguments[1], "-o", &arguments[2]])
    };
    assert!(with(1e-7).status.success(), "{}", output_text(&with(1e-7)));
    let reported = output_text(&with(1e-5));
    assert!(reported.contains("cells of another size"), "{reported}");
}

/// Returns a Python that reads Parquet, and its code for that.
fn python() -> Option<(String, &'static str)> {
    let program = std::env::var("HAPTERRA_PYTHON").unwrap_or("python3".into());
    let imports = ["polars", "pandas, pyarrow"];
    let works = |import: &&str| {
        let run = Command::new(&program)
            .args(["-c", &format!("import {import}")])
            .output();
        run.is_ok_and(|run| run.status.success())
    };
    let found = imports.into_iter().find(works);
    if found.is_none() {
        eprintln!("skipped: {program} has neither polars nor pandas with pyarrow");
    }
    found.map(|import| (program, import))
}

#[test]
fn parquet_recording_is_opened_by_polars_or_pandas() {
    let folder = Folder::new();
    folder.write_trajectory("in.csv");
    folder.replays("in.csv", "felt.csv", &[]);
    folder.replays("in.csv", "felt.parquet", &[]);
    assert!(
        rows(&folder.read("felt.csv"))
            .iter()
            .any(|row| row["contact"] == "1")
    );
    // It is also a trajectory with settings.
    folder.replays("felt.parquet", "again.csv", &[]);
    assert!(folder.read("again.csv") == folder.read("felt.csv"));
    let Some((program, import)) = python() else {
        return;
    };
    let script = match import {
        "polars" => {
            "import polars as p, sys\n\
             a = p.read_csv(sys.argv[1], comment_prefix='#')\n\
             b = p.read_parquet(sys.argv[2])\n\
             assert a.columns == b.columns, (a.columns, b.columns)\n\
             assert a.equals(b.cast({'contact': p.Int64})), (a, b)\n\
             print(len(b))"
        }
        _ => {
            "import pandas as p, sys\n\
             a = p.read_csv(sys.argv[1], comment='#', float_precision='round_trip')\n\
             b = p.read_parquet(sys.argv[2])\n\
             assert list(a.columns) == list(b.columns)\n\
             assert (a == b).all().all()\n\
             print(len(b))"
        }
    };
    let run = Command::new(program)
        .args(["-c", script])
        .args([folder.path("replayed.csv"), folder.path("replayed.parquet")])
        .output()
        .expect("started");
    assert!(run.status.success(), "{}", output_text(&run));
    assert_eq!(String::from_utf8_lossy(&run.stdout).trim(), "400");
}

fn assert_unchanged(path: &Path, bytes: &[u8]) {
    assert!(
        std::fs::read(path).expect("there") == bytes,
        "{}",
        path.display()
    );
}

#[test]
fn commands_refuse_to_overwrite_their_input() {
    let folder = Folder::new();
    folder.write_trajectory("in.csv");
    let terrain = std::fs::read(folder.path("hills.tif")).expect("there");
    let trajectory = std::fs::read(folder.path("in.csv")).expect("there");
    std::fs::hard_link(folder.path("hills.tif"), folder.path("hard.csv")).expect("linked");
    let [hills, input, hard] = ["hills.tif", "in.csv", "hard.csv"].map(|name| folder.text(name));
    let mut outputs = vec![hills.clone(), hard];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("hills.tif", folder.path("soft.csv")).expect("linked");
        outputs.push(folder.text("soft.csv"));
    }
    for output in &outputs {
        let reported = folder.fails(&["replay", &hills, &input, "-o", output]);
        assert!(
            reported.contains("it is the input") && reported.contains("hint: "),
            "{reported}"
        );
        folder.fails(&[
            "run",
            &hills,
            "--device",
            "native",
            "--duration",
            "1s",
            "--out",
            output,
        ]);
    }
    folder.fails(&["replay", &hills, &input, "-o", &input]);
    // The picture of dem.png would be dem.png.
    let (png, here) = (folder.text("dem.png"), folder.text("."));
    terrain_file(png.as_ref(), Kind::Fractal, 64, 1);
    let picture = std::fs::read(&png).expect("there");
    let reported = folder.fails(&["demo", &png, "--device", "native", "--out", &here]);
    assert!(reported.contains("--out"), "{reported}");
    let arm = folder.text("arm.toml");
    let native = [
        "calibrate",
        "--device",
        "native",
        "--measure",
        "none",
        "--no-store",
    ];
    folder.runs(&[&native[..], &["-o", &arm]].concat());
    let record = std::fs::read(&arm).expect("there");
    folder.fails(&[&native[..], &["--from", &arm, "-o", &arm]].concat());
    // The commands of a run are an input as well.
    std::fs::write(folder.path("steer.txt"), "at 1 zoom 2\n").expect("written");
    let steer = folder.text("steer.txt");
    let native = ["--device", "native", "--duration", "1s"];
    let by_file = ["--commands", &steer, "--out", &steer];
    let reported = folder.fails(&[&["run", &hills], &native[..], &by_file].concat());
    assert!(reported.contains("it is the input"), "{reported}");
    assert_unchanged(&folder.path("steer.txt"), b"at 1 zoom 2\n");
    assert_unchanged(&folder.path("hills.tif"), &terrain);
    assert_unchanged(&folder.path("in.csv"), &trajectory);
    assert_unchanged(&folder.path("dem.png"), &picture);
    assert_unchanged(&folder.path("arm.toml"), &record);
}

/// Sidecars that are read with a terrain: header, reference system, world file, mask, overviews.
#[test]
fn commands_refuse_to_overwrite_sidecars_of_their_input() {
    let folder = Folder::new();
    folder.write_trajectory("in.csv");
    let header = "ncols 4\nnrows 3\nxllcorner 0\nyllcorner 0\ncellsize 10\nbyteorder LSBFIRST\n";
    std::fs::write(folder.path("float.flt"), [0; 48]).expect("written");
    for (terrain, beside, text) in [
        ("float.flt", "float.hdr", header),
        ("float.flt", "float.prj", "GEOGCS[]"),
        ("hills.tif", "hills.tfw", "1\n0\n0\n-1\n0\n0\n"),
        ("hills.tif", "hills.TFWX", "1\n0\n0\n-1\n0\n0\n"),
        ("hills.tif", "hills.tif.msk", "a mask"),
        ("hills.tif", "hills.tif.ovr", "overviews"),
    ] {
        let [terrain, output, input] = [terrain, beside, "in.csv"].map(|name| folder.text(name));
        std::fs::write(&output, text).expect("written");
        let native = ["--device", "native", "--duration", "1s"];
        for arguments in [
            &["replay", &terrain, &input, "-o", &output][..],
            &[&["run", &terrain, "--out", &output], &native[..]].concat(),
            &["view", &input, &terrain, "-o", &output],
        ] {
            let reported = folder.fails(arguments);
            assert!(reported.contains("it is the input"), "{beside}: {reported}");
        }
        assert_unchanged(Path::new(&output), text.as_bytes());
    }
    // The recording of float.flt would be its header.
    std::fs::rename(folder.path("float.hdr"), folder.path("float.csv")).expect("renamed");
    std::fs::hard_link(folder.path("float.csv"), folder.path("float.hdr")).expect("linked");
    let (terrain, here) = (folder.text("float.flt"), folder.text("."));
    let reported = folder.fails(&["demo", &terrain, "--device", "native", "--out", &here]);
    assert!(reported.contains("it is the input"), "{reported}");
    assert_unchanged(&folder.path("float.hdr"), header.as_bytes());
}

#[test]
fn calibration_file_is_text_and_printed_by_show() {
    let folder = Folder::new();
    let arm = folder.text("arm.toml");
    let native = [
        "calibrate",
        "--device",
        "native",
        "--measure",
        "none",
        "--no-store",
    ];
    let set = ["--set", "l1=215mm", "-o", &arm];
    folder.runs(&[&native[..], &set].concat());
    let text = folder.read("arm.toml");
    assert!(text.contains("l1_mm = 215.0"), "{text}");
    let shown = folder.run(&["calibrate", "--show", &arm]);
    assert_eq!(String::from_utf8_lossy(&shown.stdout), text);
    let held = folder.run(&["calibrate", "--device", "native", "--show"]);
    let held = String::from_utf8_lossy(&held.stdout).into_owned();
    assert!(
        held.contains("l1_mm = 209.55") && held.starts_with("# Calibration"),
        "{held}"
    );
    std::fs::write(&arm, text.replace("l1_mm", "l1_inch")).expect("written");
    let reported = folder.fails(&["calibrate", "--show", &arm]);
    assert!(
        reported.contains("arm.toml") && reported.contains("l1_inch"),
        "{reported}"
    );
}

#[test]
fn closed_output_pipe_causes_no_panic() {
    let folder = Folder::new();
    folder.write_trajectory("in.csv");
    let [hills, input, out, demo] =
        ["hills.tif", "in.csv", "out.csv", "demo"].map(|name| folder.text(name));
    let commands: [&[&str]; 8] = [
        &["info", &hills],
        &["info", "--json", &hills],
        &["list"],
        &["status", "--device", "native"],
        &[
            "calibrate",
            "--device",
            "native",
            "--measure",
            "none",
            "--no-store",
        ],
        &["run", &hills, "--device", "native", "--duration", "0.3s"],
        &[
            "demo",
            &hills,
            "--device",
            "native",
            "--duration",
            "0.3s",
            "--out",
            &demo,
        ],
        &["replay", &hills, &input, "-o", &out, "-vvv"],
    ];
    for arguments in commands {
        for closed in ["stdout", "both"] {
            let (reader, writer) = std::io::pipe().expect("a pipe");
            drop(reader);
            let mut command = Command::new(hapterra_binary());
            command.args(arguments).stdin(std::process::Stdio::null());
            if closed == "both" {
                command.stderr(writer.try_clone().expect("cloned"));
            } else {
                command.stderr(std::process::Stdio::piped());
            }
            let run = command.stdout(writer).spawn().expect("started");
            let run = run.wait_with_output().expect("it ends");
            let reported = output_text(&run);
            assert!(
                !reported.contains("panicked"),
                "{arguments:?}, {closed}: {reported}"
            );
            // A crash is 101; a list without hardware is 1.
            assert!(
                matches!(run.status.code(), Some(0 | 1)),
                "{arguments:?}, {closed}: {reported}"
            );
        }
    }
}

/// A full disk causes no crash either, for messages or files.
#[test]
fn unwritable_output_causes_no_crash() {
    let folder = Folder::new();
    folder.write_trajectory("in.csv");
    let [hills, input, out, file] =
        ["hills.tif", "in.csv", "none/out", "in.csv/out"].map(|name| folder.text(name));
    let native = ["--device", "native", "--duration", "0.1s"];
    let of_files = |out: &str| -> [Vec<String>; 4] {
        let owned = |arguments: &[&str]| arguments.iter().map(|&word| word.to_owned()).collect();
        [
            owned(&["replay", &hills, &input, "-o", out]),
            owned(&[&["run", &hills, "--out", out][..], &native].concat()),
            owned(&[
                "calibrate",
                "--device",
                "native",
                "--measure",
                "none",
                "--no-store",
                "-o",
                out,
            ]),
            owned(&["replay", &hills, &input, "-o", &format!("{out}.parquet")]),
        ]
    };
    for arguments in of_files(&out).iter().chain(&of_files(&file)) {
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let reported = folder.fails(&arguments);
        assert!(
            reported.contains("cannot write") && reported.contains("hint: "),
            "{reported}"
        );
        assert!(!reported.contains("panicked"), "{reported}");
    }
    let reported = folder.fails(&[&["demo", &hills, "--out", &file][..], &native].concat());
    assert!(
        reported.contains("cannot write") && !reported.contains("panicked"),
        "{reported}"
    );
    let Ok(full) = std::fs::OpenOptions::new().write(true).open("/dev/full") else {
        eprintln!("skipped: there is no /dev/full here");
        return;
    };
    let [demo, arm] = ["demo", "arm.toml"].map(|name| folder.text(name));
    let calibrate = ["calibrate", "--device", "native"];
    folder.runs(
        &[
            &calibrate[..],
            &["--measure", "none", "--no-store", "-o", &arm],
        ]
        .concat(),
    );
    for arguments in [
        &["info", &hills][..],
        &["info", "--json", &hills],
        &["list"],
        &["status", "--device", "native"],
        &[&calibrate[..], &["--show"]].concat(),
        &["calibrate", "--show", &arm],
        &[&["run", &hills][..], &native].concat(),
        &[&["demo", &hills, "--out", &demo][..], &native].concat(),
        &["replay", &hills, &input, "-o", "-"],
    ] {
        let run = Command::new(hapterra_binary())
            .args(arguments)
            .stdout(full.try_clone().expect("cloned"))
            .output()
            .expect("it runs");
        let reported = output_text(&run);
        assert!(!reported.contains("panicked"), "{arguments:?}: {reported}");
        assert!(
            matches!(run.status.code(), Some(0 | 1)),
            "{arguments:?}: {reported}"
        );
        // A lost report is not a success.
        if ["info", "status", "calibrate"].contains(&arguments[0]) {
            assert_eq!(run.status.code(), Some(1), "{arguments:?}");
            assert!(reported.contains("cannot write the report"), "{reported}");
        }
    }
}

#[test]
fn unusual_outputs_and_options_work_or_are_reported() {
    let folder = Folder::new();
    folder.write_trajectory("in.csv");
    let [hills, input] = ["hills.tif", "in.csv"].map(|name| folder.text(name));
    // `-` is standard output, not a file.
    folder.replays("in.csv", "replayed.csv", &[]);
    let run = folder.run(&["replay", &hills, &input, "-o", "-"]);
    assert!(run.status.success(), "{}", output_text(&run));
    assert_eq!(
        String::from_utf8_lossy(&run.stdout),
        folder.read("replayed.csv")
    );
    let reported = folder.fails(&["run", &hills, "--device", "native", "--out", "-"]);
    assert!(reported.contains("standard output"), "{reported}");
    let reported = folder.replays("in.csv", "stiff.csv", &["--stiffness=1e9"]);
    assert!(reported.contains("1000000000 N/mm"), "{reported}");
    // Commands that display a record write none.
    let run = folder.run(&[
        "calibrate",
        "--device",
        "native",
        "--show",
        "-o",
        "new.toml",
    ]);
    assert!(
        output_text(&run).contains("cannot be used with"),
        "{}",
        output_text(&run)
    );
    // A failed demo leaves no files.
    let demo = folder.text("demo");
    let arguments = ["demo", &hills, "--device", "emulated:none.elf"];
    let reported = folder.fails(&[&arguments[..], &["--out", &demo]].concat());
    assert!(
        reported.contains("none.elf") && !folder.path("demo").exists(),
        "{reported}"
    );
    // A path that begins below ground causes a note on the missing force.
    std::fs::write(
        folder.path("in.csv"),
        "t_s,x_mm,y_mm,z_mm\n0,60,60,-900\n0.001,60,60,-901\n",
    )
    .expect("written");
    let reported = folder.replays("in.csv", "replayed.csv", &[]);
    assert!(reported.contains("2 rows are below ground"), "{reported}");
    // The recording distinguishes it from a free HIP.
    let text = std::fs::read_to_string(folder.path("replayed.csv")).expect("written");
    assert_eq!(text.matches(",unseeded").count(), 2, "{text}");
    assert!(!text.contains(",free"), "{text}");
}

#[test]
fn exaggeration_is_stated_once_and_defaults_to_true_scale() {
    let folder = Folder::new();
    let hills = folder.text("hills.tif");
    for (more, expected) in [
        (&[][..], "heights true to scale"),
        (&["--exaggeration", "0.5"], "heights × 0.5"),
    ] {
        let demo = folder.text("demo");
        let commands: [&[&str]; 2] = [
            &[
                "demo",
                &hills,
                "--device",
                "native",
                "--duration",
                "0.1s",
                "--out",
                &demo,
            ],
            &["run", &hills, "--device", "native", "--duration", "0.1s"],
        ];
        for arguments in commands {
            let run = folder.run(&[arguments, more].concat());
            let reported = String::from_utf8_lossy(&run.stdout).into_owned();
            assert!(
                run.status.success() && reported.contains(expected),
                "{reported}{}",
                output_text(&run)
            );
        }
    }
    folder.write_trajectory("in.csv");
    folder.replays("in.csv", "replayed.csv", &["--exaggeration=3"]);
    assert!(folder.read("replayed.csv").contains("# exaggeration = 3.0"));
    let input = folder.text("in.csv");
    let both = ["--exaggeration=2", "--exaggeration=1mm/unit"];
    let out = folder.text("o.csv");
    let run = folder.run(&[&["replay", &hills, &input, "-o", &out][..], &both].concat());
    assert_eq!(run.status.code(), Some(2), "{}", output_text(&run));
}
