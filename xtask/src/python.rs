//! `cargo xtask python`: the Python package, in an environment of its own under `target/`.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::deny;
use crate::run::{cargo, output, root, run, run_quietly, say, target_dir, timed};

/// Names the interpreter to use.
const PYTHON: &str = "HAPTERRA_PYTHON";
/// Succeeds on an interpreter that is new enough.
const IS_NEW_ENOUGH: &str = "import sys; sys.exit(sys.version_info < (3, 9))";

/// Builds the wheel, and gives its path; none, and a line, where there is no Python.
///
/// # Errors
/// What failed: the environment, which takes a network the first time, or the build.
pub(crate) fn build() -> Result<Option<PathBuf>> {
    let Some(python) = interpreter()? else {
        say("SKIPPED: the Python package: there is no Python 3.9 or newer on the PATH");
        return Ok(None);
    };
    let python = environment(&python)?;
    install(&python, &["maturin>=1.8,<2"])?;
    timed("building the wheel", || wheel(&python)).map(Some)
}

/// Lints the package's crate, holds its dependencies to `deny.toml`, installs the wheel, and runs
/// its tests with `hapterra` beside them. Without Python it ends well after one line.
///
/// # Errors
/// As [`build`], and what the tests say.
pub(crate) fn test() -> Result<()> {
    let Some(wheel) = build()? else {
        return Ok(());
    };
    timed("linting the Python package's crate", lint)?;
    deny::check_workspace("python/Cargo.toml")?;
    timed("building the hapterra command", || {
        run(cargo().args(["build", "--package", "hapterra", "--bin", "hapterra"]))
    })?;
    let python = interpreter_of(&home());
    install(&python, &[&format!("{}[test]", wheel.display())])?;
    // The version stays the same while one works on it.
    let again = ["--force-reinstall", "--no-deps", &wheel.to_string_lossy()];
    install(&python, &again)?;
    let program = format!("hapterra{}", std::env::consts::EXE_SUFFIX);
    let mut tests = Command::new(&python);
    tests
        .args(["-m", "pytest"])
        .current_dir(root().join("python"))
        .env("HAPTERRA", target_dir().join("debug").join(program));
    timed("running the Python package's tests", || run(&mut tests))
}

/// The interpreter that is asked for, or the first that is new enough.
fn interpreter() -> Result<Option<PathBuf>> {
    if let Some(given) = std::env::var_os(PYTHON) {
        let given = PathBuf::from(given);
        let why = || {
            format!(
                "{PYTHON} is {}: name a Python 3.9 or newer",
                given.display()
            )
        };
        ensure!(is_new_enough(&given), why());
        return Ok(Some(given));
    }
    let names = ["python3", "python"].map(PathBuf::from);
    Ok(names.into_iter().find(|name| is_new_enough(name)))
}

fn is_new_enough(python: &Path) -> bool {
    output(Command::new(python).args(["-c", IS_NEW_ENOUGH])).is_some()
}

fn home() -> PathBuf {
    target_dir().join("python-env")
}

/// The interpreter of an environment.
fn interpreter_of(home: &Path) -> PathBuf {
    match cfg!(windows) {
        true => home.join("Scripts").join("python.exe"),
        false => home.join("bin").join("python"),
    }
}

/// The package's own environment, made where it is not there or its interpreter has gone.
fn environment(python: &Path) -> Result<PathBuf> {
    let home = home();
    let own = interpreter_of(&home);
    if !is_new_enough(&own) {
        let mut make = Command::new(python);
        make.args(["-m", "venv", "--clear"]).arg(&home);
        let hint = "Python's venv is missing; on Debian: apt-get install python3-venv";
        run_quietly(&mut make).context(hint)?;
    }
    Ok(own)
}

fn install(python: &Path, words: &[&str]) -> Result<()> {
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "install", "--quiet"]);
    pip.args(["--disable-pip-version-check"]).args(words);
    run_quietly(&mut pip)
        .context("pip cannot install what the Python package needs: is there a network?")
}

/// The wheel, alone in its folder.
fn wheel(python: &Path) -> Result<PathBuf> {
    let wheels = target_dir().join("wheels");
    if wheels.exists() {
        std::fs::remove_dir_all(&wheels).context("target/wheels cannot be emptied")?;
    }
    let mut maturin = Command::new(python);
    maturin
        .args(["-m", "maturin", "build", "--release", "--locked"])
        .arg("--interpreter")
        .arg(python)
        .arg("--out")
        .arg(&wheels)
        .current_dir(root().join("python"))
        .env("CARGO_TARGET_DIR", target_dir());
    run_quietly(&mut maturin)?;
    let mut made = std::fs::read_dir(&wheels).context("maturin has made no folder of wheels")?;
    let wheel = made.next().context("maturin has made no wheel")??;
    Ok(wheel.path())
}

/// Formatting and clippy of the crate.
fn lint() -> Result<()> {
    let cargo = |words: &[&str]| {
        let mut command = cargo();
        command.current_dir(root().join("python")).args(words);
        command
    };
    run(&mut cargo(&["fmt", "--check"])).context("type: cd python && cargo fmt")?;
    let clippy = ["clippy", "--release", "--locked", "--", "-D", "warnings"];
    run(&mut cargo(&clippy))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_that_are_no_python_are_not_taken() {
        assert!(!is_new_enough(Path::new("/no/such/python")));
        assert!(!is_new_enough(Path::new("false")));
    }
}
