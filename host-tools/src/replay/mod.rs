//! Replay: a trajectory of the HIP goes through the loop tick by tick, and
//! what was felt comes out. Also the recording that `run` and `demo` write,
//! which has the same format.
//!
//! In lock-step: the device feels one point, answers, and only then gets the
//! next. Every point is felt exactly once, with all the terrain it needs, so
//! the result depends on nothing but the terrain, the law and the trajectory.

mod felt;
mod loop_columns;
mod recording;
pub mod settings;
mod trajectory;

pub use felt::Replayer;
pub use loop_columns::LoopColumns;
pub use recording::{Column, Record, Recording, Value};
pub use settings::Settings;
pub use trajectory::{Row, Trajectory, TrajectoryError};

use hapterra_core::contact::{ContactState, Rule};
use hapterra_core::force::ForceLaw;
use hapterra_core::scene::Sample;

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
    /// Of those, rows below the ground that were not felt, because the HIP had not been
    /// above it.
    pub below_ground: u64,
}

/// The column that a replay's recording has after the usual ones.
const STATE: Column = Column::Text("state");

/// Runs a trajectory through a device and writes what was felt to an output, which
/// appears only when it is complete.
///
/// `go_on` is asked now and then, with the number of rows so far, whether to.
///
/// # Errors
/// [`ReplayError`] says what was wrong, with file, line and column.
pub fn replay_trajectory(
    replayer: &mut Replayer<'_>,
    trajectory: &mut Trajectory,
    settings: &Settings,
    output: Output,
    go_on: &mut dyn FnMut(u64) -> bool,
) -> Result<Summary, ReplayError> {
    const ASK_EVERY: u64 = 512;
    let terrain = replayer.terrain();
    let scale = *terrain.scale();
    let mut recording = Recording::new(output, &[STATE])?;
    recording.describe(settings);
    let mut summary = Summary::default();
    while let Some(row) = trajectory.next_row(&scale)? {
        let sample = replayer.feel(row.hip)?;
        let record = Record::new(row.t_s, row.hip_mm, &sample, &scale);
        recording.write(&record, &[Value::Text(state_name(sample.state))])?;
        summary.rows += 1;
        summary.in_contact += u64::from(record.contact);
        summary.below_ground += u64::from(is_below_ground(&sample, &record, terrain));
        if summary.rows % ASK_EVERY == 0 && !go_on(summary.rows) {
            return Err(ReplayError::Interrupted);
        }
    }
    recording.finish()?;
    Ok(summary)
}

/// Whether nothing is felt because the HIP is below ground and came there from below, from
/// a hole or from outside.
#[must_use]
pub fn is_below_ground(sample: &Sample, record: &Record, terrain: &Terrain<'_>) -> bool {
    let [x, y, z] = record.hip_mm;
    let waits = sample.state == ContactState::Waiting && sample.missing_tile.is_none();
    waits && terrain.height_mm(x, y).is_some_and(|ground| z < ground)
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
pub fn state_name(state: ContactState) -> &'static str {
    match state {
        ContactState::Waiting => "waiting",
        ContactState::Free => "free",
        ContactState::Touching => "touching",
        ContactState::Fading => "letting go",
    }
}
