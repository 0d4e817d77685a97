//! Replay: a trajectory of the HIP goes through the loop tick by tick, and
//! what was felt comes out. Also the recording that `run` and `demo` write,
//! which has the same format.
//!
//! In lock-step: the device feels one point, answers, and only then gets the
//! next. Every point is felt exactly once, with all the terrain it needs, so
//! the result depends on nothing but the terrain, the law and the trajectory.

mod felt;
mod recording;
mod trajectory;

pub use felt::Replayer;
pub use recording::{Record, Recording};
pub use trajectory::{Row, Trajectory, TrajectoryError};

use std::path::Path;

use hapterra_core::contact::Rule;
use hapterra_core::force::ForceLaw;

use crate::link::{LinkError, Native, Patience, Transport};
use crate::output::{Output, OutputError};
use crate::terrain::Terrain;

/// Why a replay did not come to its end. Nothing is left at the output's path.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The trajectory.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// The output.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The device.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The user.
    #[error("interrupted")]
    Interrupted,
}

/// What a replay did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Rows felt.
    pub rows: u64,
    /// Of those, rows in contact.
    pub in_contact: u64,
}

/// Runs a trajectory file through a device and writes what was felt to another
/// file, which appears only when it is complete.
///
/// `go_on` is asked now and then, with the number of rows so far, whether to.
///
/// # Errors
/// [`ReplayError`] says what was wrong, with file, line and column.
pub fn replay_file(
    replayer: &mut Replayer<'_>,
    trajectory: &Path,
    output: &Path,
    go_on: &mut dyn FnMut(u64) -> bool,
) -> Result<Summary, ReplayError> {
    const ASK_EVERY: u64 = 512;
    let scale = *replayer.terrain().scale();
    let mut rows = Trajectory::open(trajectory, scale)?;
    let mut recording = Recording::new(Output::create(output)?, &["state"]);
    let mut summary = Summary::default();
    while let Some(row) = rows.next_row()? {
        let sample = replayer.feel(row.hip)?;
        let record = Record::new(row.t_s, row.hip_mm, &sample, &scale);
        recording.write(&record, &[&state_name(sample.state)])?;
        summary.rows += 1;
        summary.in_contact += u64::from(record.contact);
        if summary.rows % ASK_EVERY == 0 && !go_on(summary.rows) {
            return Err(ReplayError::Interrupted);
        }
    }
    recording.finish()?;
    Ok(summary)
}

/// A replayer on the application in this program's memory.
///
/// # Errors
/// As [`Replayer::open`].
pub fn on_native<'t>(
    terrain: &'t Terrain<'t>,
    law: ForceLaw,
    rule: Rule,
) -> Result<Replayer<'t>, LinkError> {
    let device: Box<dyn Transport> = Box::new(Native::for_replay());
    Replayer::open(terrain, law, rule, device, Patience::REAL_TIME)
}

/// A state's name in a recording.
#[must_use]
pub fn state_name(state: hapterra_core::contact::ContactState) -> &'static str {
    use hapterra_core::contact::ContactState;
    match state {
        ContactState::Waiting => "waiting",
        ContactState::Free => "free",
        ContactState::Touching => "touching",
        ContactState::Fading => "letting go",
    }
}
