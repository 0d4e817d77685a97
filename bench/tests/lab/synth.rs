//! `hapterra-lab synth` as a command.

use std::path::Path;
use std::process::{Command, Output, Stdio};

use hapterra_tests::{terrain_file, timeouts::end_of};

fn synth(words: &[&str], file: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hapterra-lab"));
    command.arg("synth").args(words).arg("-o").arg(file);
    let child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    end_of(child.expect("it starts"))
}

fn output_text(output: &Output) -> String {
    String::from_utf8_lossy(&[&output.stdout[..], &output.stderr].concat()).into_owned()
}

#[test]
fn file_equals_that_of_the_library() {
    let folder = tempfile::tempdir().expect("a folder");
    let [here, there] = ["a.tif", "b.tif"].map(|name| folder.path().join(name));
    let made = synth(&["crater", "--size", "40", "--seed", "3"], &here);
    assert!(made.status.success(), "{}", output_text(&made));
    terrain_file(&there, hapterra::synth::Kind::Crater, 40, 3);
    let [here, there] = [here, there].map(|file| std::fs::read(file).expect("there"));
    assert!(here == there);
}

#[test]
fn terrain_too_large_for_the_disk_is_refused_before_writing() {
    let folder = tempfile::tempdir().expect("a folder");
    let huge = ["plane", "--size", "4000000000x4000000000"];
    let refused = synth(&huge, &folder.path().join("huge.tif"));
    let output = output_text(&refused);
    assert_eq!(refused.status.code(), Some(1), "{output}");
    assert!(
        output.contains("GB are free") && output.contains("hint:"),
        "{output}"
    );
    assert_eq!(std::fs::read_dir(folder.path()).expect("listed").count(), 0);
}

#[cfg(unix)]
#[test]
fn file_name_reaches_the_terminal_without_control_characters() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("x\u{1b}]0;owned\u{7}\u{202e}.tif");
    let made = synth(&["plane", "--size", "8"], &file);
    let output = output_text(&made);
    assert!(
        made.status.success() && output.contains("wrote"),
        "{output}"
    );
    let controls = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
    assert!(!output.contains(controls), "{output:?}");
}

#[cfg(unix)]
#[test]
fn unprintable_report_is_a_failure() {
    let folder = tempfile::tempdir().expect("a folder");
    let full = std::fs::File::options().write(true).open("/dev/full");
    let mut command = Command::new(env!("CARGO_BIN_EXE_hapterra-lab"));
    command.args(["synth", "plane", "--size", "8", "-o"]);
    command
        .arg(folder.path().join("plane.tif"))
        .stdout(full.expect("a full device"));
    let output = command.output().expect("it runs");
    assert_eq!(output.status.code(), Some(1), "{}", output_text(&output));
}

/// Its name is that of a killed command's partial file: no step waits for a writer of the pipe.
#[cfg(unix)]
#[test]
fn pipe_named_as_a_partial_file_does_not_block() {
    let folder = tempfile::tempdir().expect("a folder");
    let pipe = folder.path().join("out.tif.a1B2c3.partial");
    let made = Command::new("mkfifo").arg(&pipe).status();
    assert!(made.expect("mkfifo runs").success());
    let made = synth(&["fractal", "--size", "16"], &folder.path().join("out.tif"));
    assert!(made.status.success(), "{}", output_text(&made));
}
