//! A recording given as an option.

use std::path::Path;

use crate::cli::failure::{Failure, OrHint};
use crate::replay::{ReplayError, Settings, Trajectory};
use heightfield::regular_file;

/// Checks that a recording is a regular file, because it is read twice and a pipe might not end.
///
/// # Errors
/// There is no such file, or it is of another kind.
pub(in crate::cli) fn check_file(path: &Path) -> Result<(), Failure> {
    let opened = regular_file::open(path).map(drop);
    opened
        .map_err(|why| format!("{}: {why}", path.display()))
        .or_hint("name a recording that is a file")
}

/// Returns the settings of a recording; `None` for any other trajectory.
///
/// # Errors
/// As [`check_file`]; the file is no trajectory, or its settings cannot be used.
pub(in crate::cli) fn settings_of(path: &Path) -> Result<Option<Settings>, Failure> {
    check_file(path)?;
    let trajectory = Trajectory::open(path).map_err(ReplayError::from)?;
    Ok(trajectory.settings().cloned())
}
