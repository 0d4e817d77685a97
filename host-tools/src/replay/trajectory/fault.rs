//! Faults of trajectories, and their positions in the file.

use std::io;
use std::path::{Path, PathBuf};

use hapterra_touch::ticks::TimeFault;

use crate::replay::settings::SettingsError;

/// Fault of a trajectory.
#[derive(Debug, thiserror::Error)]
#[error("{}: {fault}", path.display())]
pub struct TrajectoryError {
    path: PathBuf,
    fault: TrajectoryFault,
}

impl TrajectoryError {
    pub(super) fn new(path: &Path, fault: TrajectoryFault) -> Self {
        let path = path.to_owned();
        Self { path, fault }
    }

    /// Returns true if the fault is in the settings of the recording.
    #[must_use]
    pub const fn is_about_settings(&self) -> bool {
        matches!(self.fault, TrajectoryFault::Settings(_))
    }

    /// Returns true if the fault is in the times.
    #[must_use]
    pub const fn is_about_time(&self) -> bool {
        matches!(self.fault, TrajectoryFault::Time { .. })
    }
}

/// Fault of a trajectory, and its position. Lines and rows count from 1.
#[derive(Debug, thiserror::Error)]
pub(super) enum TrajectoryFault {
    #[error("cannot read the trajectory: {0}")]
    Unreadable(io::Error),
    #[error(
        "{at} is not the header of a trajectory: `{found}` where `t_s,x_mm,y_mm,z_mm` is expected, or `x_mm,y_mm,z_mm` without times"
    )]
    Header { at: String, found: String },
    #[error(
        "the first columns are {0} where t_s, x_mm, y_mm, z_mm are expected, double-precision numbers all"
    )]
    Schema(String),
    #[error("{at} has {found} columns where the header has {expected}")]
    Columns {
        at: String,
        found: usize,
        expected: usize,
    },
    #[error("{at}, column {column}: {what}")]
    Field {
        at: String,
        column: &'static str,
        what: String,
    },
    #[error("{at}, column t_s: {what}")]
    Time { at: String, what: TimeFault },
    #[error("{0}")]
    Settings(SettingsError),
}
