//! A folder with a terrain of hills, and runs of `hapterra` on its files.

use std::collections::HashMap;
use std::path::PathBuf;
use std::process::{Command, Output};

use hapterra::synth::Kind;
use hapterra_tests::{hapterra_binary, terrain_file};

pub(super) struct Folder(tempfile::TempDir);

impl Folder {
    /// Creates a terrain of hills, 256 samples wide.
    pub(super) fn new() -> Self {
        Self::of(256)
    }

    /// Creates a terrain of hills of this width in samples.
    pub(super) fn of(size: u32) -> Self {
        let folder = Self(tempfile::tempdir().expect("a folder"));
        terrain_file(&folder.path("hills.tif"), Kind::Fractal, size, 1);
        folder
    }

    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(super) fn text(&self, name: &str) -> String {
        self.path(name).to_str().expect("a plain path").to_owned()
    }

    pub(super) fn run(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(hapterra_binary());
        let command = command.args(arguments).env_remove("HAPTERRA_MPS2_ELF");
        command.output().expect("started")
    }

    /// Runs a command that succeeds. Returns its standard error.
    pub(super) fn runs(&self, arguments: &[&str]) -> String {
        let run = self.run(arguments);
        assert!(run.status.success(), "{arguments:?}: {}", output_text(&run));
        output_text(&run)
    }

    /// Runs a command that fails. Returns its messages.
    pub(super) fn fails(&self, arguments: &[&str]) -> String {
        let run = self.run(arguments);
        assert_eq!(
            run.status.code(),
            Some(1),
            "{arguments:?}: {}",
            output_text(&run)
        );
        output_text(&run)
    }

    /// Replays `from` into `to`.
    pub(super) fn replay(&self, from: &str, to: &str, more: &[&str]) -> Output {
        let [terrain, from, to] = ["hills.tif", from, to].map(|name| self.text(name));
        self.run(&[&["replay", &terrain, &from, "-o", &to], more].concat())
    }

    /// Replays `from` into `to` with success. Returns the messages.
    pub(super) fn replays(&self, from: &str, to: &str, more: &[&str]) -> String {
        let run = self.replay(from, to, more);
        assert!(
            run.status.success(),
            "{from} {more:?}: {}",
            output_text(&run)
        );
        output_text(&run)
    }

    pub(super) fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).expect("there")
    }

    pub(super) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).expect("written");
    }

    /// Writes a trajectory of one row a tick that goes up and down over the hills.
    pub(super) fn write_trajectory(&self, name: &str) {
        let mut text = "t_s,x_mm,y_mm,z_mm\n".to_owned();
        for tick in 0..400 {
            let t = f64::from(tick) / 400.0;
            let (x, z) = (60.0 + 30.0 * t, 40.0 * (12.0 * t).cos() + 20.0);
            let t_s = f64::from(tick) * 1e-3;
            text += &format!("{t_s},{x},{},{z}\n", 70.0 - 10.0 * t);
        }
        self.write(name, &text);
    }
}

/// Returns the standard error of a command.
pub(super) fn output_text(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

/// Returns the rows of a recording by the names of its columns.
pub(super) fn rows(text: &str) -> Vec<HashMap<&str, &str>> {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<_> = lines.next().expect("a header").split(',').collect();
    lines
        .map(|line| header.iter().copied().zip(line.split(',')).collect())
        .collect()
}
