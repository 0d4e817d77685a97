//! The source of the firmware, where this program is run inside it.

use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::boards::Board;

/// A checkout of the project.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Checkout {
    root: PathBuf,
}

/// An image could not be built.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// Cargo cannot be started.
    #[error("cannot start {program}")]
    Start {
        /// What was to be started.
        program: String,
        /// Why.
        #[source]
        source: io::Error,
    },
    /// It ended without an image; it has said why.
    #[error("`cargo xtask image {board}` in {} failed", root.display())]
    Failed {
        /// The board.
        board: &'static str,
        /// Where it was built.
        root: PathBuf,
    },
}

impl Checkout {
    /// The checkout that `folder` lies in.
    #[must_use]
    pub fn around(folder: &Path) -> Option<Self> {
        let root = folder.ancestors().find(|root| {
            let manifest = std::fs::read_to_string(root.join("firmware/Cargo.toml"));
            manifest.is_ok_and(|text| text.contains("name = \"hapterra-firmware\""))
                && root.join("xtask/Cargo.toml").is_file()
        });
        root.map(|root| Self {
            root: root.to_owned(),
        })
    }

    /// Builds the image of a board and gives the ELF's path.
    ///
    /// # Errors
    /// [`BuildError`]; what went wrong is on standard error.
    pub fn build(&self, board: &Board) -> Result<PathBuf, BuildError> {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let output = Command::new(&cargo)
            .args(["xtask", "image", board.name])
            .current_dir(&self.root)
            .stderr(Stdio::inherit())
            .output()
            .map_err(|source| BuildError::Start {
                program: cargo.to_string_lossy().into_owned(),
                source,
            })?;
        let said = String::from_utf8_lossy(&output.stdout);
        match said.lines().last() {
            Some(path) if output.status.success() => Ok(path.into()),
            _ => Err(BuildError::Failed {
                board: board.name,
                root: self.root.clone(),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_checkout_is_found_from_any_folder_in_it_and_nowhere_else() {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let found = Checkout::around(&here.join("src/board")).expect("this is one");
        assert_eq!(Some(found.root.as_path()), here.parent());
        let elsewhere = tempfile::tempdir().expect("a folder");
        assert_eq!(Checkout::around(elsewhere.path()), None);
    }
}
