//! A recording that an option names.

use std::path::Path;

use crate::cli::failure::{Failure, OrHint};
use crate::replay::{ReplayError, Settings, Trajectory};
use heightfield::regular_file;

/// Checks that a recording is a file: it is read twice, and a pipe might never end.
///
/// # Errors
/// There is none, or it is of another kind.
pub(in crate::cli) fn check_file(path: &Path) -> Result<(), Failure> {
    let opened = regular_file::open(path).map(drop);
    opened
        .map_err(|why| format!("{}: {why}", path.display()))
        .or_hint("name a recording that is a file")
}

/// The settings of a recording; none of another trajectory.
///
/// # Errors
/// As [`check_file`]; no trajectory, or settings that cannot be used.
pub(in crate::cli) fn settings_of(path: &Path) -> Result<Option<Settings>, Failure> {
    check_file(path)?;
    let trajectory = Trajectory::open(path).map_err(ReplayError::from)?;
    Ok(trajectory.settings().cloned())
}
