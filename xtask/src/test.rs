//! `cargo xtask test`: all tests, from set-up to result.

use std::ffi::OsString;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::board::{BOARDS, Board};
use crate::deny::Advisories;
use crate::run::{TEST_ARGUMENTS, cargo, command_line, report, run, timed};
use crate::setup::{emulator, gdal, qemu, toolchain};
use crate::{counts, deny, image, page, panics, python, size};

/// A board and the ELF of its image.
pub(crate) type Image = (&'static Board, PathBuf);

/// Excluded by `quick`: images of the real boards, and programs that run them or are servers.
const QUICK: [&str; 5] = [
    "--workspace",
    "--exclude",
    "hapterra-image-tests",
    "--exclude",
    "hapterra-url-tests",
];

/// Request of a test run.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Request {
    /// True to leave out the boards that are not emulated, the dependencies, the page and the
    /// Python package.
    pub(crate) quick: bool,
    /// Arguments of `cargo test`, which select programs and tests; empty for all.
    pub(crate) only: Vec<OsString>,
}

/// Builds the images, compares them with their budgets, runs every test of the workspace on the
/// host with QEMU beside it, checks the dependencies, and tests the page and the Python package.
/// Runs each step and each program to its end. With [`Request::only`] runs only the selected
/// programs.
///
/// # Errors
/// All failures, with the commands that repeat them.
pub(crate) fn test(request: &Request) -> Result<()> {
    let qemu = qemu::ready()?;
    gdal::ready_or_report();
    if !request.quick {
        emulator::ready()?;
    }
    let boards: &[Board] = if request.quick { &BOARDS[..1] } else { &BOARDS };
    let images = images(boards)?;
    let counts = counts::image()?;
    let (mut failures, mut notes) = (vec![], vec![]);
    let mut step = |repeat: &str, result: Result<()>| {
        if let Err(why) = result {
            report(format!("error: {why:#}"));
            failures.push(repeat.to_owned());
        }
    };
    if request.only.is_empty() {
        step("cargo xtask size", check_sizes(&images));
        step("cargo xtask panics", check_panics(&images));
        if !request.quick {
            let checked = timed("checking the dependencies", dependencies);
            step("cargo xtask deny", checked.map(|not| notes.extend(not)));
        }
    }
    let tests = || {
        let mut command = cargo();
        command
            .args(["test", "--no-fail-fast"])
            .args(if request.quick {
                &QUICK[..]
            } else {
                &TEST_ARGUMENTS
            })
            .env("HAPTERRA_QEMU", &qemu)
            .env(image::COUNTS_VARIABLE, &counts);
        for (board, path) in &images {
            command.env(board.elf_variable, path);
        }
        command
    };
    let failed = timed("running the workspace's tests", || {
        if request.only.is_empty() {
            return failed_of_all(&tests);
        }
        let mut only = tests();
        only.args(&request.only);
        failed_targets(only, |line| println!("{line}"))
    })?;
    failures.extend(failed.iter().map(|failed| repeat(failed, request.quick)));
    if request.only.is_empty() && !request.quick {
        // The other interfaces: each prints its skipped tests if there is no browser or no Python.
        for (repeat, test) in [
            ("cargo xtask page --test", page::test as fn() -> Result<()>),
            ("cargo xtask python --test", python::test),
        ] {
            if let Err(why) = test() {
                report(format!("error: {why:#}"));
                failures.push(repeat.to_owned());
            }
        }
    }
    notes.iter().for_each(report);
    if failures.is_empty() {
        return Ok(());
    }
    bail!(
        "{} failed; to repeat:\n  {}",
        failures.len(),
        failures.join("\n  ")
    )
}

/// Checks the dependencies of the workspaces that are tested here. Returns the parts that were not
/// checked, for the summary.
fn dependencies() -> Result<Option<String>> {
    let _of_all = deny::check("Cargo.toml")?;
    deny::check("fuzz/Cargo.toml").map(Advisories::not_checked)
}

/// The targets of the workspace in two halves, which run concurrently: many tests wait for a
/// program in real time, or are the last of their program, and leave a core idle. The patterns are
/// complements: every name of a test program is in one half.
const HALVES: [&[&str]; 2] = [
    &["--lib", "--bins", "--test", "[a-f]*"],
    &["--test", "[!a-f]*"],
];

/// A test program with a failure.
#[derive(Debug, PartialEq)]
struct Failed {
    /// Cargo's arguments for it: `-p PACKAGE --lib`.
    target: String,
    /// The names of its failed tests; empty if it was aborted, or was not built.
    tests: Vec<String>,
}

/// Builds all tests, runs both halves at once, and then the examples in the documentation. Returns
/// the programs that failed.
fn failed_of_all(tests: &(dyn Fn() -> Command + Sync)) -> Result<Vec<Failed>> {
    let with = |words: &[&str]| {
        let mut command = tests();
        command.args(words);
        command
    };
    run(&mut with(&["--no-run"]))?;
    let halves: Vec<_> = std::thread::scope(|scope| {
        let run_half = |words| scope.spawn(move || by_program(with(words)));
        let running = HALVES.map(run_half).into_iter();
        running.map(|half| half.join().expect("no panic")).collect()
    });
    let mut failed = vec![];
    for half in halves {
        failed.extend(half?);
    }
    failed.extend(by_program(with(&["--doc"]))?);
    Ok(failed)
}

/// Returns the same as [`failed_targets`]; prints the lines of each program together, when it has
/// ended.
fn by_program(command: Command) -> Result<Vec<Failed>> {
    let mut lines = String::new();
    let failed = failed_targets(command, |line| {
        if begins_program(line) {
            print!("{}", std::mem::take(&mut lines));
        }
        lines += line;
        lines.push('\n');
    });
    print!("{lines}");
    failed
}

/// Runs `cargo test`, and shows each line of its output. Returns the programs that failed.
fn failed_targets(mut command: Command, mut show: impl FnMut(&str)) -> Result<Vec<Failed>> {
    let line = command_line(&command);
    let (from, to) = io::pipe()?;
    command.stdout(to.try_clone()?).stderr(to);
    let child = command.spawn();
    // The pipe ends when all programs that write to it have ended.
    drop(command);
    let mut child = child.with_context(|| format!("cannot start `{line}`"))?;
    let mut failures = Failures::default();
    for line in BufReader::new(from).split(b'\n') {
        let line = line?;
        let line = String::from_utf8_lossy(&line);
        show(&line);
        failures.read(&line);
    }
    let failed = failures.failed;
    let status = child.wait()?;
    if !status.success() && failed.is_empty() {
        bail!("`{line}` failed ({status})");
    }
    Ok(failed)
}

/// Returns true if this line of cargo's output begins the next program.
fn begins_program(line: &str) -> bool {
    let line = line.trim_start();
    line.starts_with("Running ") || line.starts_with("Doc-tests ")
}

/// Failures in the output of `cargo test`.
#[derive(Default)]
struct Failures {
    failed: Vec<Failed>,
    /// Failed tests of the running program.
    tests: Vec<String>,
    /// True if that program has printed its result: it ran all of its tests.
    is_complete: bool,
}

impl Failures {
    /// Reads the next line of the output.
    fn read(&mut self, line: &str) {
        if begins_program(line) {
            self.tests.clear();
            self.is_complete = false;
        }
        self.is_complete |= line.starts_with("test result: ");
        let test = line.strip_prefix("test ");
        if let Some(test) = test.and_then(|line| line.strip_suffix(" ... FAILED")) {
            self.tests.push(test.to_owned());
        }
        // "error: test failed, to rerun pass `-p PACKAGE --lib`", with `doctest` for examples.
        let target = line.strip_prefix("error: ").and_then(|line| {
            let (_, target) = line.split_once("test failed, to rerun pass `")?;
            target.strip_suffix('`')
        });
        if let Some(target) = target {
            let tests = std::mem::take(&mut self.tests);
            self.failed.push(Failed {
                target: target.to_owned(),
                tests: if self.is_complete { tests } else { vec![] },
            });
        }
    }
}

/// Returns the command that runs the failed tests of a program again. It names no packages, because
/// the selected packages determine the build, and only all of them select the same programs.
fn repeat(Failed { target, tests }: &Failed, quick: bool) -> String {
    let of_package = target.strip_prefix("-p ");
    let kind = of_package.and_then(|target| target.split_once(' '));
    let (package, kind) = kind.unwrap_or((target, ""));
    let quick = if quick { " --quick" } else { "" };
    // The name of an example is a place in a file, with spaces.
    let tests = match tests.join(" ") {
        tests if tests.is_empty() || kind == "--doc" => String::new(),
        tests => format!(" -- --exact {tests}"),
    };
    format!("cargo xtask test{quick} -- {kind}{tests}    # {package}")
}

/// Builds the images of `boards`.
pub(crate) fn images(boards: &'static [Board]) -> Result<Vec<Image>> {
    let toolchain = toolchain::ready()?;
    let build = |board: &'static Board| {
        timed(&format!("building the image of {}", board.name), || {
            Ok((board, image::build(toolchain, board)?))
        })
    };
    boards.iter().map(build).collect()
}

/// Prints the table of sizes; returns an error if an image is over its budget.
pub(crate) fn check_sizes(images: &[Image]) -> Result<()> {
    size::check(images.iter().map(by_path))
}

/// Returns an error if an interrupt can panic in one of the images.
pub(crate) fn check_panics(images: &[Image]) -> Result<()> {
    images
        .iter()
        .map(by_path)
        .try_for_each(|(board, path)| panics::check(board, path))
}

fn by_path((board, path): &Image) -> (&Board, &Path) {
    (board, path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failed_tests_are_repeated_by_program_and_name() {
        let output = [
            "     Running tests/link/main.rs (target/debug/deps/link-1)",
            "test fallback::late ... ok",
            "test usb::stalls ... FAILED",
            "test usb::resets ... FAILED",
            "test result: FAILED. 1 passed; 2 failed",
            "error: test failed, to rerun pass `-p hapterra-tests --test link`",
            "     Running tests/docs.rs (target/debug/deps/docs-1)",
            "test links ... FAILED",
            "error: test failed, to rerun pass `-p hapterra-tests --test docs`",
            "   Doc-tests hapterra_core",
            "test core/src/crc.rs - crc (line 5) ... FAILED",
            "test result: FAILED. 0 passed; 1 failed",
            "error: doctest failed, to rerun pass `-p hapterra-core --doc`",
            "error: 3 targets failed:",
            "    `-p hapterra-tests --test link`",
        ];
        let mut failures = Failures::default();
        output.iter().for_each(|line| failures.read(line));
        let commands: Vec<_> = failures
            .failed
            .iter()
            .map(|failed| repeat(failed, false))
            .collect();
        let expected = [
            "cargo xtask test -- --test link -- --exact usb::stalls usb::resets    # hapterra-tests",
            "cargo xtask test -- --test docs    # hapterra-tests",
            "cargo xtask test -- --doc    # hapterra-core",
        ];
        assert_eq!(commands, expected);
    }
}
