//! The firmware's source, if this program was built from it.

use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::boards::Board;

/// A checkout of the project.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Checkout {
    root: PathBuf,
}

/// Error of an image's build.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// Cargo cannot be started.
    #[error("cannot start {program}")]
    Start {
        /// Program to start.
        program: String,
        /// The reason.
        #[source]
        source: io::Error,
    },
    /// Cargo ended without an image; it has printed the reason.
    #[error("`cargo xtask image {board}` in {} failed", root.display())]
    Failed {
        /// The board to build for.
        board: &'static str,
        /// Folder of the build.
        root: PathBuf,
    },
}

impl Checkout {
    /// Returns the checkout that this program was built from, if it still exists. Other checkouts,
    /// such as one around the working folder, are not trusted, because a build runs their code.
    #[must_use]
    pub fn own() -> Option<Self> {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent()?;
        let manifest = std::fs::read_to_string(root.join("firmware/Cargo.toml"));
        let is_one = manifest.is_ok_and(|text| text.contains("name = \"hapterra-firmware\""));
        is_one.then(|| Self {
            root: root.to_owned(),
        })
    }

    /// Returns the checkout's folder.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Builds the image of a board and returns the ELF's path.
    ///
    /// # Errors
    /// [`BuildError`]; Cargo prints the details to standard error.
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
        let stdout = String::from_utf8_lossy(&output.stdout);
        match stdout.lines().last() {
            Some(path) if output.status.success() => Ok(path.into()),
            _ => Err(BuildError::Failed {
                board: board.name,
                root: self.root.clone(),
            }),
        }
    }
}
