//! Partial recordings of killed commands are found, named and left unchanged.
#![cfg(unix)]

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use hapterra::synth::Kind;
use hapterra_tests::timeouts::wait_for;
use hapterra_tests::{hapterra_binary, terrain_file};

/// Points that fill the recording's buffer more than once.
const POINTS: usize = 4_000;

fn terrain(folder: &Path) -> PathBuf {
    let path = folder.join("terrain.tif");
    terrain_file(&path, Kind::Fractal, 64, 1);
    path
}

fn output_text(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

fn replay(folder: &Path, terrain: &Path) -> Command {
    let mut command = Command::new(hapterra_binary());
    command.arg("replay").arg(terrain).arg("/dev/stdin");
    command.arg("--out").arg(folder.join("out.csv"));
    command.stdin(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn write_points(process: &mut Child) {
    let mut points = String::from("t_s,x_mm,y_mm,z_mm\n");
    for point in 0..POINTS {
        points += &format!("{},10,10,5\n", point as f64 * 1e-3);
    }
    let stdin = process.stdin.as_mut().expect("piped");
    stdin.write_all(points.as_bytes()).expect("written");
}

/// Returns the partial files in a folder.
fn partial(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("listed");
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("entry").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|kind| kind == "partial"));
    paths
}

/// Kills a replay while it waits for more points. Returns its partial file.
fn killed(folder: &Path, terrain: &Path) -> PathBuf {
    let mut process = replay(folder, terrain).spawn().expect("started");
    // Its input stays open, so it cannot finish.
    write_points(&mut process);
    let partial_file = wait_for("a partial recording", || {
        assert_eq!(process.try_wait().expect("waited for"), None, "it ended");
        let is_written = |path: &PathBuf| path.metadata().is_ok_and(|meta| meta.len() > 0);
        partial(folder).into_iter().find(is_written)
    });
    process.kill().expect("killed");
    process.wait().expect("waited for");
    partial_file
}

/// Checks that a command named the partial file and its size, and left it unchanged.
fn assert_names_partial_file(run: &Output, partial_file: &Path, content: &[u8]) {
    let printed = output_text(run);
    assert!(run.status.success(), "{printed}");
    let size = format!("({} bytes)", content.len());
    for part in [&*partial_file.to_string_lossy(), &size, "to keep it"] {
        assert!(printed.contains(part), "{part} in {printed}");
    }
    assert_eq!(fs::read(partial_file).expect("still there"), content);
}

/// Safety: images.
#[test]
fn recording_of_a_killed_run_is_kept_and_named_at_next_start() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let terrain = terrain(folder);
    let partial_file = killed(folder, &terrain);
    let content = fs::read(&partial_file).expect("left behind");
    let text = String::from_utf8_lossy(&content);
    let is_recording = text.starts_with("# hapterra-recording") && text.contains("\nt_s,x_mm");
    assert!(is_recording, "it is the recording, with its settings");

    let mut again = replay(folder, &terrain).spawn().expect("started");
    write_points(&mut again);
    drop(again.stdin.take());
    assert_names_partial_file(
        &again.wait_with_output().expect("ended"),
        &partial_file,
        &content,
    );
    assert!(folder.join("out.csv").exists());
    assert_eq!(partial(folder), [partial_file.as_path()]);

    let run = Command::new(hapterra_binary())
        .arg("run")
        .arg(&terrain)
        .args(["--device", "native", "--duration", "0.05s", "--out"])
        .arg(folder.join("out.csv"))
        .output()
        .expect("started");
    assert_names_partial_file(&run, &partial_file, &content);
}
