//! Lines that need neither a board, a viewer nor a server are run.

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use hapterra_tests::hapterra_binary;
use hapterra_tests::timeouts::end_of;

use super::{Line, lines, pages, words};

/// Words of lines that a test cannot run.
const PATHS_OUTSIDE: [&str; 8] = [
    "usb",
    "tcp:",
    "://",
    "--view",
    ".vrt",
    "SERIAL",
    "band=2",
    "worldcover",
];
/// Commands that are run: the others need a board or a viewer, or take minutes.
const RUN: [&str; 10] = [
    "info",
    "run",
    "demo",
    "replay",
    "list",
    "status",
    "synth",
    "completions",
    "man",
    "help",
];

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
    run(folder, &rendered.map(str::to_owned)).expect("a recording");
}

/// Runs the words of a line; the error is its standard error.
fn run(folder: &Path, words: &[String]) -> Result<(), String> {
    let program = match words[0].as_str() {
        "hapterra" => hapterra_binary(),
        _ => Path::new(env!("CARGO_BIN_EXE_hapterra-lab")),
    };
    let mut command = Command::new(program);
    command.current_dir(folder).args(&words[1..]);
    command.env("HAPTERRA_CACHE_DIR", folder.join("cache"));
    command.stdin(Stdio::null()).stdout(Stdio::piped());
    let child = command.stderr(Stdio::piped()).spawn();
    let output = end_of(child.expect("it starts"));
    let printed = String::from_utf8_lossy(&output.stderr).into_owned();
    output.status.success().then_some(()).ok_or(printed)
}

/// Returns the words to run a line with; `None` if a test cannot run it.
fn runnable(line: &Line) -> Option<Vec<String>> {
    let mut words = words(&line.text);
    let is_elsewhere = |word: &String| PATHS_OUTSIDE.iter().any(|part| word.contains(part));
    let command = words
        .get(1)
        .filter(|word| RUN.contains(&word.as_str()))?
        .clone();
    let is_of_board = command == "status" && !words.iter().any(|word| word == "native");
    if !line.is_block || is_of_board || words[0] == "cargo" || words.iter().any(is_elsewhere) {
        return None;
    }
    for word in &mut words[2..] {
        *word = match word.as_str() {
            "FILE" | "TERRAIN" | "mountain.tif" | "dem.tif" => "file.asc".into(),
            "PATH.csv" => "path.csv".into(),
            "FORCES.csv" => "forces.csv".into(),
            "tiles/**/*.tif" => "tiles/**/*.asc".into(),
            word => word.to_owned(),
        };
    }
    if command == "run" && !words.iter().any(|word| word == "--device") {
        words.extend(["--device", "native"].map(str::to_owned));
    }
    let is_live = command == "run" || command == "demo";
    if is_live && !words.iter().any(|word| word == "--duration") {
        words.extend(["--duration", "1s"].map(str::to_owned));
    }
    Some(words)
}

#[test]
fn command_lines_without_a_board_run() {
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
        for words in lines {
            println!("{}", words.join(" "));
            count += 1;
            if let Err(printed) = run(folder.path(), &words) {
                let _ = writeln!(wrong, "{}: {}\n{printed}", page.display(), words.join(" "));
            }
        }
    }
    println!("{count} command lines were run");
    assert!(count > 20, "only {count} command lines were run");
    assert!(wrong.is_empty(), "{wrong}");
}
