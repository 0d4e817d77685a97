//! Replay: a trajectory of the HIP goes through the loop tick by tick, and
//! the samples come out. Also the recording that `run` and `demo` write,
//! which has the same format.
//!
//! In lock-step: the device feels one point a tick, answers, and only then gets the
//! next. Every point is rendered exactly once, with all the terrain it needs, so
//! the result depends on nothing but the terrain, the surface parameters, the trajectory
//! and the tick rate.
//! [`Ticks`] says where the HIP is in each tick.

mod loop_columns;
mod marks;
mod offline_device;
mod published;
mod recording;
pub mod settings;
mod states;
mod ticks;
mod trajectory;

pub use loop_columns::{LoopColumns, mode_name};
pub use marks::Mark;
pub use offline_device::OfflineDevice;
pub use recording::{COLUMNS, Column, Record, Recording, TICK_COLUMNS, Value};
pub use settings::{Rule, Settings};
pub use states::state_name;
pub use ticks::{Pace, Tick, Ticks};
pub use trajectory::{
    ColumnValues, RecordedColumns, RecordingRow, RecordingRows, Row, Trajectory, TrajectoryError,
};

use hapterra_core::contact::ContactState;
use hapterra_core::force::SurfaceParams;
use hapterra_core::rate::TickRate;
use hapterra_core::scene::TickRecord;

use crate::link::{LinkError, Native, Timeouts};
use crate::output::{Output, OutputError};
use crate::terrain::{HapticGrid, Terrain, TerrainError};
use settings::PlacementSettings;

/// Reason for which a replay ended early. Nothing is left at the output's path.
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
    /// A view of the recording that its terrain cannot be rendered in.
    #[error("placement {number} of the recording cannot be rendered: {why}")]
    Placement {
        /// The view.
        number: u32,
        /// Reason for the refusal.
        why: TerrainError,
    },
    /// The user.
    #[error("interrupted")]
    Interrupted,
}

/// Summary of a replay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Ticks rendered, a row of the output each.
    pub rows: u64,
    /// Of those, rows in contact.
    pub in_contact: u64,
    /// Of those, rows below the ground that were not rendered, because the HIP had not been
    /// above it.
    pub below_ground: u64,
    /// Of those, rows whose HIP is more than a window of the device away from the one before:
    /// contact begins anew there.
    pub leaps: u64,
}

/// The columns that a replay's recording has after the usual ones; the view only where
/// there are several.
const MORE: [Column; 2] = [Column::Text("state"), Column::Count("view")];

/// Receives each sample and its row, and the number of its view with its terrain.
pub type OnSample<'f, 't> = dyn FnMut(&TickRecord, &Record, (u32, &Terrain<'t>)) + 'f;

/// Runs a trajectory through a device and writes the samples to an output, which
/// appears only when it is complete.
///
/// `on_sample` gets each sample; `go_on` is called now and then, with the number of
/// rows so far, whether to.
///
/// # Errors
/// [`ReplayError`] says what was wrong, with file, line and column.
pub fn replay_trajectory<'t>(
    replayer: &mut OfflineDevice<'t>,
    ticks: &mut Ticks,
    settings: &Settings,
    output: Output,
    on_sample: &mut OnSample<'_, 't>,
    go_on: &mut dyn FnMut(u64) -> bool,
) -> Result<Summary, ReplayError> {
    const ASK_EVERY: u64 = 512;
    let columns = match settings.views.is_empty() {
        true => &MORE[..1],
        false => &MORE[..],
    };
    let mut recording = Recording::new(output, columns)?;
    recording.describe(settings);
    let (mut summary, mut view) = (Summary::default(), 0);
    let mut marks = settings.marks.iter().peekable();
    let first = replayer.terrain().clone();
    while let Some(tick) = ticks.next_tick()? {
        // Without settings it is a path alone.
        if tick.view != view && !settings.views.is_empty() {
            view = tick.view;
            let of_views = (&first, settings);
            go_over(
                replayer,
                ticks.trajectory(),
                of_views,
                &tick,
                &mut recording,
            )?;
        }
        let scale = *replayer.terrain().scale();
        let hip = ticks.trajectory().to_grid(tick.hip_mm, &scale)?;
        summary.leaps += u64::from(replayer.is_leap_to(&hip));
        let sample = replayer.step(hip)?;
        let terrain = replayer.terrain();
        let record = Record::new(tick.t_s, tick.hip_mm, &sample, &scale);
        while let Some(mark) = marks.next_if(|mark| mark.t_s <= record.t_s) {
            recording.mark(mark);
        }
        let more = [Value::Text(state_name(sample.state)), Value::Count(view)];
        recording.write(&record, more.get(..columns.len()).unwrap_or(&more))?;
        on_sample(&sample, &record, (view, terrain));
        summary.rows += 1;
        summary.in_contact += u64::from(record.contact);
        summary.below_ground += u64::from(is_below_ground(&sample, &record, terrain));
        if summary.rows % ASK_EVERY == 0 && !go_on(summary.rows) {
            return Err(ReplayError::Interrupted);
        }
    }
    marks.for_each(|mark| recording.mark(mark));
    recording.finish()?;
    Ok(summary)
}

/// The terrain of a recording's beginning in another of its views.
///
/// # Errors
/// [`ReplayError::Placement`].
pub fn terrain_of<'t>(
    first: &Terrain<'t>,
    view: &PlacementSettings,
) -> Result<Terrain<'t>, ReplayError> {
    let grid = match view.measured_at {
        Some(ground) => HapticGrid::at(first.raster(), first.grid().cells(), ground)
            .with_materials(first.grid().materials()),
        None => *first.grid(),
    };
    let grid = grid.with_tip(view.tip_mm.unwrap_or(first.grid().tip_mm()));
    let number = view.number;
    let cannot = |why| ReplayError::Placement { number, why };
    let scale = view.scale().map_err(|why| cannot(why.into()))?;
    first.relaid(grid, scale, view.level).map_err(cannot)
}

/// Goes over to the view of a row, as it was done where it was recorded.
fn go_over<'t>(
    replayer: &mut OfflineDevice<'t>,
    trajectory: &mut Trajectory,
    (first, settings): (&Terrain<'t>, &Settings),
    tick: &Tick,
    recording: &mut Recording,
) -> Result<(), ReplayError> {
    let described = settings.views.iter().find(|view| view.number == tick.view);
    let Some(view) = described else {
        return Err(trajectory.of_unknown_view(tick.view).into());
    };
    let terrain = terrain_of(first, view)?;
    let hip = trajectory.to_grid(tick.hip_mm, terrain.scale())?;
    replayer.put_view(terrain, view.params(), hip)?;
    Ok(recording.view(view)?)
}

/// Returns true if no force is rendered because the HIP is below ground and came there from below, from
/// a hole or from outside.
#[must_use]
pub fn is_below_ground(sample: &TickRecord, record: &Record, terrain: &Terrain<'_>) -> bool {
    let [x, y, z] = record.hip_mm;
    let waits = sample.state == ContactState::Unseeded && sample.missing_tile.is_none();
    waits && terrain.height_mm(x, y).is_some_and(|ground| z < ground)
}

/// A replayer on the application in this program's memory, a thousand ticks a second.
///
/// # Errors
/// As [`OfflineDevice::open`].
pub fn on_native<'t>(
    terrain: &'t Terrain<'t>,
    params: SurfaceParams,
) -> Result<OfflineDevice<'t>, LinkError> {
    on_native_at(TickRate::DEFAULT, terrain, params)
}

/// The same at another tick rate.
///
/// # Errors
/// As [`OfflineDevice::open`].
pub fn on_native_at<'t>(
    rate: TickRate,
    terrain: &'t Terrain<'t>,
    params: SurfaceParams,
) -> Result<OfflineDevice<'t>, LinkError> {
    let device = Native::for_replay_at(rate);
    OfflineDevice::open(terrain, params, device, Timeouts::EMULATED)
}
