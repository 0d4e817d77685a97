//! `cargo xtask python`: the Python package, in an environment of its own under `target/`.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::board::EMULATED;
use crate::run::{
    cargo, output, report, root, run, run_quietly, target_dir, tested_programs, timed,
    without_own_variables,
};
use crate::{deny, emulation};

/// Options for the published wheel and the tested one. With the same versions, features and
/// profile, most crates of the registry are already built for the workspace's tests.
const RELEASE: &[&str] = &["--release"];
const TESTED: &[&str] = &["--profile", "dev", "--features", "remote"];
/// Variable with the interpreter to use.
const PYTHON: &str = "HAPTERRA_PYTHON";
/// Prints the version of an interpreter that is new enough, and fails on others.
const VERSION: &str =
    "import sys; v = sys.version_info; print('%d.%d' % v[:2]); sys.exit(v < (3, 9))";

/// Builds the wheel, and returns the interpreter of its environment and the wheel's path; `None`,
/// with a message, without Python.
///
/// # Errors
/// A failure of the environment, which needs a network the first time, or of the build.
pub(crate) fn build() -> Result<Option<(PathBuf, PathBuf)>> {
    build_by(RELEASE)
}

fn build_by(how: &[&str]) -> Result<Option<(PathBuf, PathBuf)>> {
    let Some(python) = interpreter()? else {
        report("SKIPPED: the Python package: there is no Python 3.9 or newer on the PATH");
        return Ok(None);
    };
    let python = environment(&python)?;
    install(&python, &["maturin>=1.8,<2"])?;
    let wheel = timed("building the wheel", || wheel(&python, how))?;
    Ok(Some((python, wheel)))
}

/// Lints the package's crate, checks its dependencies against `deny.toml`, installs the wheel, and
/// runs its tests. Without Python it succeeds after one message.
///
/// # Errors
/// As [`build`], and failures of the tests.
pub(crate) fn test() -> Result<()> {
    let Some((python, wheel)) = build_by(TESTED)? else {
        return Ok(());
    };
    timed("linting the Python package's crate", lint)?;
    deny::check("python/Cargo.toml")?.report();
    install(&python, &[&format!("{}[test]", wheel.display())])?;
    // The version does not change during development.
    let reinstall = ["--force-reinstall", "--no-deps", &wheel.to_string_lossy()];
    install(&python, &reinstall)?;
    let [_, lab] = tested_programs()?;
    let mut tests = Command::new(&python);
    tests
        .args(["-m", "pytest"])
        .env("HAPTERRA_LAB", lab)
        .current_dir(root().join("python"));
    match emulation::emulation() {
        Ok(board) => {
            tests.env(EMULATED.elf_variable, board.image);
            tests.env("HAPTERRA_QEMU", board.qemu);
        }
        Err(why) => report(format!("SKIPPED: the emulated board from Python: {why:#}")),
    }
    timed("running the Python package's tests", || run(&mut tests))
}

/// An interpreter that is new enough.
struct Python {
    program: PathBuf,
    /// Version, such as 3.11.
    version: String,
}

impl Python {
    fn of(program: &Path) -> Option<Self> {
        let version = output(Command::new(program).args(["-c", VERSION]))?;
        let version = version.trim().to_owned();
        // Other programs may succeed and print nothing.
        (!version.is_empty()).then(|| Self {
            program: program.to_owned(),
            version,
        })
    }
}

/// Returns the requested interpreter, or the first that is new enough.
fn interpreter() -> Result<Option<Python>> {
    if let Some(given) = std::env::var_os(PYTHON) {
        let given = PathBuf::from(given);
        let why = || {
            format!(
                "{PYTHON} is {}: name a Python 3.9 or newer",
                given.display()
            )
        };
        return Python::of(&given).with_context(why).map(Some);
    }
    let names = ["python3", "python"];
    Ok(names.iter().find_map(|name| Python::of(Path::new(name))))
}

/// Returns the interpreter of the package's own environment for a version of Python. Creates the
/// environment if it or its interpreter is missing.
fn environment(python: &Python) -> Result<PathBuf> {
    let home = target_dir().join(format!("python-env-{}", python.version));
    let own = match cfg!(windows) {
        true => home.join("Scripts").join("python.exe"),
        false => home.join("bin").join("python"),
    };
    if Python::of(&own).is_none() {
        let mut make = Command::new(&python.program);
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

/// Returns the wheel, the only file in its folder.
fn wheel(python: &Path, how: &[&str]) -> Result<PathBuf> {
    let wheels = target_dir().join("wheels");
    if wheels.exists() {
        std::fs::remove_dir_all(&wheels).context("target/wheels cannot be emptied")?;
    }
    let mut maturin = Command::new(python);
    maturin
        .args(["-m", "maturin", "build", "--locked"])
        .args(how)
        .arg("--interpreter")
        .arg(python)
        .arg("--out")
        .arg(&wheels)
        .current_dir(root().join("python"))
        .env("CARGO_TARGET_DIR", target_dir());
    without_own_variables(&mut maturin);
    run_quietly(&mut maturin)?;
    let mut made = std::fs::read_dir(&wheels).context("maturin has made no folder of wheels")?;
    let wheel = made.next().context("maturin has made no wheel")??;
    Ok(wheel.path())
}

/// Checks formatting of the crate and runs clippy.
fn lint() -> Result<()> {
    let cargo = |words: &[&str]| {
        let mut command = cargo();
        command
            .current_dir(root().join("python"))
            .args(words)
            .env("CARGO_TARGET_DIR", target_dir());
        command
    };
    run(&mut cargo(&["fmt", "--check"])).context("type: cd python && cargo fmt")?;
    let clippy = [
        "clippy",
        "--locked",
        "--features",
        "remote",
        "--",
        "-D",
        "warnings",
    ];
    run(&mut cargo(&clippy))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns names and versions of a lock file's packages.
    fn locked(path: &str) -> Vec<(String, String)> {
        let text = std::fs::read_to_string(root().join(path)).expect("a lock file");
        let packages = text.split("[[package]]").skip(1);
        let value = |package: &str, key: &str| {
            let line = package.lines().find_map(|line| line.strip_prefix(key));
            line.expect("name and version").to_owned()
        };
        packages
            .map(|it| (value(it, "name = "), value(it, "version = ")))
            .collect()
    }

    #[test]
    fn crates_of_both_lock_files_have_the_same_versions() {
        let (root, python) = (locked("Cargo.lock"), locked("python/Cargo.lock"));
        let is_shared = |name: &str| root.iter().any(|(known, _)| known == name);
        let other: Vec<_> = python
            .iter()
            .filter(|package| is_shared(&package.0) && !root.contains(package))
            .collect();
        assert!(python.len() > 200, "{}", python.len());
        assert!(
            other.is_empty(),
            "{other:?} would be built twice: cp Cargo.lock python/ && cd python && cargo metadata --offline"
        );
    }

    #[test]
    fn programs_that_are_no_python_are_ignored() {
        for program in ["/no/such/python", "false", "true"] {
            assert!(Python::of(Path::new(program)).is_none(), "{program}");
        }
    }
}
