//! Path and start of the viewer.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Environment variable that names the viewer, if it is not beside this program or on the `PATH`.
pub const VARIABLE: &str = "HAPTERRA_VIEW";
const NAME: &str = "hapterra-view";

/// Reason why there is no viewer.
#[derive(Debug, thiserror::Error)]
pub enum ProgramError {
    /// The viewer was not found.
    #[error("there is no {NAME} beside this program or on the PATH")]
    Absent,
    /// The viewer was found, but did not start.
    #[error("{} does not start: {why}", path.display())]
    NotStarted {
        /// The program.
        path: PathBuf,
        /// Error of the system.
        why: std::io::Error,
    },
}

/// The viewer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Program {
    path: PathBuf,
    /// Output path of a recording for Rerun's own viewer.
    rrd: Option<PathBuf>,
}

impl Program {
    /// Finds the viewer: by [`VARIABLE`], otherwise beside this program, otherwise on the `PATH`.
    ///
    /// # Errors
    /// [`ProgramError::Absent`].
    pub fn find() -> Result<Self, ProgramError> {
        if let Some(named) = std::env::var_os(VARIABLE).filter(|named| !named.is_empty()) {
            return Ok(Self::at(named.into()));
        }
        let beside = std::env::current_exe().ok();
        let beside = beside.as_deref().and_then(Path::parent);
        let path = std::env::var_os("PATH").unwrap_or_default();
        Self::among(beside.map(PathBuf::from), std::env::split_paths(&path))
    }

    fn among(
        beside: Option<PathBuf>,
        path: impl Iterator<Item = PathBuf>,
    ) -> Result<Self, ProgramError> {
        let name = format!("{NAME}{}", std::env::consts::EXE_SUFFIX);
        let mut places = beside.into_iter().chain(path);
        let found = places.find_map(|folder| {
            let program = folder.join(&name);
            program.is_file().then_some(program)
        });
        found.map(Self::at).ok_or(ProgramError::Absent)
    }

    const fn at(path: PathBuf) -> Self {
        Self { path, rrd: None }
    }

    /// Makes the viewer write a recording for Rerun's own viewer.
    #[must_use]
    pub fn writing(self, rrd: Option<&Path>) -> Self {
        Self {
            rrd: rrd.map(PathBuf::from),
            ..self
        }
    }

    /// Starts the viewer, with a pipe as its standard input.
    pub(super) fn start(&self) -> Result<Child, ProgramError> {
        let rrd = self
            .rrd
            .iter()
            .flat_map(|rrd| [OsStr::new("-o"), rrd.as_os_str()]);
        Command::new(&self.path)
            .args(rrd)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .map_err(|why| ProgramError::NotStarted {
                path: self.path.clone(),
                why,
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viewer_beside_the_program_is_preferred_to_the_path() {
        let folders = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
        let [beside, path] = folders.each_ref().map(|folder| folder.path().to_owned());
        let find = || Program::among(Some(beside.clone()), std::iter::once(path.clone()));
        assert!(matches!(find(), Err(ProgramError::Absent)));
        let name = format!("{NAME}{}", std::env::consts::EXE_SUFFIX);
        for folder in [&path, &beside] {
            std::fs::write(folder.join(&name), "").expect("a file");
            assert_eq!(find().expect("found").path, folder.join(&name));
        }
    }

    #[test]
    fn missing_viewer_error_names_its_path() {
        let missing = Program::at("/no/such/program".into());
        let message = missing.start().expect_err("there is none").to_string();
        assert!(message.contains("/no/such/program"), "{message}");
    }
}
