//! The lines of blocks for `hapterra` and `hapterra-lab` are run, except those of [`ONLY_PARSED`].
//!
//! A line for a board is run with `--device native`, one with a viewer with a program that reads
//! the beginning of the stream. `run` and `demo` end after a second if the line states no duration.
//!
//! Lines of other programs are not run here:
//!
//! - `cargo` and `pip` build and install; `cargo xtask test` and `.ci/run` do the same;
//! - `python3` and `nc` of events.md: `tests/tests/sessions/events.rs` runs both examples;
//! - `cc` of use-from-c.md: `c/tests/examples.rs` compiles and runs the example.

use std::fmt::Write as _;
use std::fs::Permissions;
use std::io::Write as _;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::{Command, Stdio};

use hapterra_tests::timeouts::end_of;
use hapterra_tests::{hapterra_binary, repository};

use super::{Line, lines, pages, words};

/// Parts of lines that are only parsed, with the reasons.
const ONLY_PARSED: [(&str, &str); 6] = [
    ("://", "needs a server in the internet"),
    (".vrt", "needs GDAL"),
    ("band=2", "needs a file with two bands"),
    ("hapterra flash", "needs a board"),
    (
        "hapterra-lab stability",
        "takes minutes; bench/tests/lab/stability.rs runs it with fewer trials",
    ),
    (
        "hapterra-lab streaming",
        "takes minutes; bench/tests/lab/streaming.rs runs it with fewer cases",
    ),
];
/// Commands for a device, by default a board.
const FOR_DEVICE: [&str; 4] = ["run", "status", "bringup", "calibrate"];
/// Time of a session with commands, longer than the last command's.
const DURATION_WITH_COMMANDS: &str = "6s";

/// A line to run.
struct Runnable {
    words: Vec<String>,
    input: Option<String>,
}

/// Writes files with the names on the pages: a terrain at 7.5 to 7.9° east and 45.8 to 46.2° north,
/// and a path over it.
fn files(folder: &Path) {
    let mut terrain =
        "ncols 40\nnrows 40\nxllcorner 7.5\nyllcorner 45.8\ncellsize 0.01\n".to_owned();
    for row in 0..40 {
        for column in 0..40 {
            let (x, y) = (f64::from(column), f64::from(row));
            let height = 2000.0 + 800.0 * (x / 4.0).sin() * (y / 5.0).cos();
            let _ = write!(terrain, "{height:.1} ");
        }
        terrain.push('\n');
    }
    let place = "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],\
                 PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433],AUTHORITY[\"EPSG\",\"4326\"]]";
    // Classes of the ground, in the same grid.
    let (head, _) = terrain.split_at(terrain.find("cellsize").expect("a header"));
    let classes = "10 30 50 60 ".repeat(400);
    let classes = format!("{head}cellsize 0.01\n{classes}\n");
    std::fs::write(folder.join("worldcover.asc"), classes).expect("written");
    std::fs::write(folder.join("worldcover.prj"), place).expect("written");
    std::fs::create_dir(folder.join("docs")).expect("made");
    let table = "docs/worldcover.toml";
    std::fs::copy(repository().join(table), folder.join(table)).expect("copied");
    viewer(&folder.join("viewer"));
    std::fs::create_dir(folder.join("tiles")).expect("made");
    for name in ["file", "tiles/one"] {
        std::fs::write(folder.join(name).with_extension("asc"), &terrain).expect("written");
        std::fs::write(folder.join(name).with_extension("prj"), place).expect("written");
    }
    let path = "t_s,x_mm,y_mm,z_mm\n0,20,20,600\n0.5,22,21,600\n";
    std::fs::write(folder.join("path.csv"), path).expect("written");
    std::fs::write(folder.join("mine.toml"), "[default]\nfriction = 0.3\n").expect("written");
    std::fs::write(folder.join("scan.raw"), vec![0; 2 * 512 * 400]).expect("written");
    let rendered = [
        "hapterra",
        "replay",
        "file.asc",
        "path.csv",
        "-o",
        "forces.csv",
    ];
    let words = rendered.map(str::to_owned).into();
    run(folder, &Runnable { words, input: None }).expect("a recording");
}

/// Writes a program that reads the beginning of a viewer's stream.
fn viewer(path: &Path) {
    std::fs::write(path, "#!/bin/sh\nexec head -c 1000 > /dev/null\n").expect("written");
    std::fs::set_permissions(path, Permissions::from_mode(0o700)).expect("set");
}

/// Runs a line; the error is its standard error.
fn run(folder: &Path, line: &Runnable) -> Result<(), String> {
    let words = &line.words;
    let program = match words[0].as_str() {
        "hapterra" => hapterra_binary(),
        _ => Path::new(env!("CARGO_BIN_EXE_hapterra-lab")),
    };
    let mut command = Command::new(program);
    command.current_dir(folder).args(&words[1..]);
    command.env("HAPTERRA_CACHE_DIR", folder.join("cache"));
    command.env("HAPTERRA_VIEW", folder.join("viewer"));
    command.stdin(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.stderr(Stdio::piped()).spawn().expect("it starts");
    let mut input = child.stdin.take().expect("piped");
    let text = line.input.as_deref().unwrap_or_default();
    // A program that reads no input may have ended.
    let _ = input.write_all(text.as_bytes());
    drop(input);
    let output = end_of(child);
    let printed = String::from_utf8_lossy(&output.stderr).into_owned();
    let is_done = output.status.success() && !printed.contains("is no command");
    is_done.then_some(()).ok_or(printed)
}

/// Returns a line as it is run; `None` if it is only parsed.
fn runnable(line: &Line) -> Option<Runnable> {
    let mut words = words(&line.text);
    let text = words.join(" ");
    let is_only_parsed = ONLY_PARSED.iter().any(|(part, _)| text.contains(part));
    if !line.is_block || words[0] == "cargo" || is_only_parsed {
        return None;
    }
    let command = words[1].clone();
    for word in &mut words[2..] {
        *word = match word.as_str() {
            "FILE" | "TERRAIN" | "mountain.tif" | "dem.tif" => "file.asc".into(),
            "PATH.csv" => "path.csv".into(),
            "FORCES.csv" | "RECORDING" => "forces.csv".into(),
            "tiles/**/*.tif" => "tiles/**/*.asc".into(),
            "worldcover.tif" => "worldcover.asc".into(),
            board if board == "usb" || board.starts_with("usb:") => "native".into(),
            word => word.to_owned(),
        };
    }
    let mut add = |option: &str, value: &str| {
        if !words.iter().any(|word| word == option) {
            words.extend([option, value].map(str::to_owned));
        }
    };
    if FOR_DEVICE.contains(&command.as_str()) {
        add("--device", "native");
    }
    if command == "run" || command == "demo" {
        let duration = line.input.as_ref().map_or("1s", |_| DURATION_WITH_COMMANDS);
        add("--duration", duration);
    }
    let input = line.input.clone();
    Some(Runnable { words, input })
}

#[test]
fn command_lines_run() {
    let (mut count, mut wrong) = (0, String::new());
    for page in pages() {
        let text = std::fs::read_to_string(&page).expect("readable");
        let lines = lines(&page, &text);
        let lines: Vec<_> = lines.iter().filter_map(runnable).collect();
        if lines.is_empty() {
            continue;
        }
        let folder = tempfile::tempdir().expect("a folder");
        files(folder.path());
        for line in lines {
            let text = line.words.join(" ");
            println!("{text}");
            count += 1;
            if let Err(printed) = run(folder.path(), &line) {
                let _ = writeln!(wrong, "{}: {text}\n{printed}", page.display());
            }
        }
    }
    println!("{count} command lines were run");
    assert!(count > 45, "only {count} command lines were run");
    assert!(wrong.is_empty(), "{wrong}");
}
