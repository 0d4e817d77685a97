//! Running other programs, with messages.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, bail};

/// Prints one line of progress to stderr, so that stdout has only results.
pub(crate) fn report(line: impl AsRef<str>) {
    eprintln!("xtask: {}", line.as_ref());
}

/// Returns the root of the workspace.
pub(crate) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("xtask/ lies in the workspace")
}

/// Returns the place of cargo's build results for the host.
pub(crate) fn target_dir() -> PathBuf {
    match std::env::var_os("CARGO_TARGET_DIR") {
        Some(dir) => std::path::absolute(&dir).unwrap_or_else(|_| dir.into()),
        None => root().join("target"),
    }
}

/// Variables that cargo sets for a program that it runs, one a line. They differ for each program
/// that calls cargo. So the build scripts that read them would run again, and their dependents
/// would be rebuilt.
const CARGO_VARIABLES: &str = include_str!("../../tests/src/cargo_variables.txt");

/// Returns the cargo that runs this program, in the workspace root, for a build for the host.
pub(crate) fn cargo() -> Command {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command
        .current_dir(root())
        .env("CARGO_TARGET_DIR", target_dir())
        .env_remove("CARGO_BUILD_TARGET");
    without_own_variables(&mut command);
    command
}

/// Removes the variables that cargo sets for this program: a build script that reads them would run
/// again.
pub(crate) fn without_own_variables(command: &mut Command) {
    for variable in CARGO_VARIABLES.lines() {
        command.env_remove(variable);
    }
}

/// The packages and features of all tests: with others, cargo would rebuild dependencies. The image
/// tests need probe-rs anyway, and the command is also tested with it.
pub(crate) const TEST_ARGUMENTS: [&str; 3] = ["--workspace", "--features", "hapterra/probe"];

/// Builds `hapterra` for a user, and returns its path.
pub(crate) fn hapterra(features: &[&str]) -> Result<PathBuf> {
    let mut build = cargo();
    build.args([
        "build",
        "--release",
        "--package",
        "hapterra",
        "--bin",
        "hapterra",
    ]);
    timed(
        "building the command `hapterra` (the first time, this takes minutes)",
        || run(build.args(features)),
    )?;
    Ok(built("release", "hapterra"))
}

/// Builds `hapterra` and `hapterra-lab` as the workspace's tests do, and returns their paths.
pub(crate) fn tested_programs() -> Result<[PathBuf; 2]> {
    let names = ["hapterra", "hapterra-lab"];
    let mut build = cargo();
    build.arg("build").args(TEST_ARGUMENTS);
    build.args(names.map(|name| ["--bin", name]).as_flattened());
    // If the targets include a test, cargo uses the dependencies' features for tests.
    build.args(["--test", "page"]);
    timed("building the tested programs", || run(&mut build))?;
    Ok(names.map(|name| built("debug", name)))
}

/// Returns the path of a program that cargo has built.
pub(crate) fn built(profile: &str, name: &str) -> PathBuf {
    let program = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    target_dir().join(profile).join(program)
}

/// Runs `command` to its end; a failure is an error with the command's name.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    let line = command_line(command);
    let status = command
        .status()
        .with_context(|| format!("cannot start `{line}`"))?;
    if !status.success() {
        bail!("`{line}` failed ({status})");
    }
    Ok(())
}

/// Runs a verbose program like [`run`], and shows its output only if it fails.
pub(crate) fn run_quietly(command: &mut Command) -> Result<()> {
    let line = command_line(command);
    let done = command
        .stdin(Stdio::null())
        .output()
        .with_context(|| format!("cannot start `{line}`"))?;
    if !done.status.success() {
        let output = [done.stdout, done.stderr].concat();
        let output = String::from_utf8_lossy(&output);
        bail!("`{line}` failed ({})\n{}", done.status, output.trim());
    }
    Ok(())
}

/// Runs `command` and returns its standard output; `None` if it cannot be started or fails.
pub(crate) fn output(command: &mut Command) -> Option<String> {
    let output = command
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .output()
        .ok()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    output.status.success().then_some(text)
}

/// Returns the path of `program` on the PATH.
pub(crate) fn on_path(program: &str) -> Option<PathBuf> {
    let name = format!("{program}{}", std::env::consts::EXE_SUFFIX);
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .map(|dir| dir.join(&name))
        .find(|file| file.is_file())
}

/// Runs `step`, and prints its name and duration.
pub(crate) fn timed<T>(name: &str, step: impl FnOnce() -> Result<T>) -> Result<T> {
    report(name);
    let start = Instant::now();
    let done = step().with_context(|| format!("{name}: failed"))?;
    report(format!(
        "{name}: done in {:.1} s",
        start.elapsed().as_secs_f64()
    ));
    Ok(done)
}

/// Returns a command line as a user would type it.
pub(crate) fn command_line(command: &Command) -> String {
    let name = Path::new(command.get_program()).file_stem();
    let words = name.into_iter().chain(command.get_args());
    let words: Vec<_> = words.map(OsStr::to_string_lossy).collect();
    words.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failed_command_is_named() {
        let mut command = cargo();
        command.arg("no-such-command").stderr(Stdio::null());
        let message = run(&mut command).unwrap_err().to_string();
        assert!(message.contains("cargo no-such-command"), "{message}");
    }

    #[test]
    fn missing_program_is_named() {
        let message = run(&mut Command::new("/no/such/program"))
            .unwrap_err()
            .to_string();
        assert!(message.contains("cannot start `program`"), "{message}");
        assert_eq!(output(&mut Command::new("/no/such/program")), None);
    }

    #[test]
    fn failed_quiet_program_error_includes_its_output() {
        let message = run_quietly(cargo().arg("no-such-command"))
            .unwrap_err()
            .to_string();
        assert!(message.contains("error: no such command"), "{message}");
    }

    #[test]
    fn root_is_the_workspace() {
        assert!(root().join("xtask/Cargo.toml").is_file());
    }
}
