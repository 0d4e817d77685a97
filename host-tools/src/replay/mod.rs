//! Replay: renders a trajectory of the HIP tick by tick and returns the samples. Also the
//! recordings of `run` and `demo`, in the same format.
//!
//! A replay is in lock-step: the device renders one point in each tick, answers, and only then gets
//! the next. Every point is rendered exactly once, with all the terrain it needs, so the result
//! depends only on the terrain, the surface parameters, the trajectory and the tick rate.
//! [`TrajectoryTicks`] computes the HIP's position in each tick.

mod loop_columns;
mod marks;
mod offline_device;
mod published;
mod recording;
pub mod settings;
mod states;
mod trajectory;
mod trajectory_ticks;

pub use loop_columns::{LoopColumns, mode_name};
pub use marks::Mark;
pub use offline_device::OfflineDevice;
pub use recording::{COLUMNS, Column, Record, Recording, TICK_COLUMNS, Value};
pub use settings::{Rule, Settings};
pub use states::state_name;
pub use trajectory::{
    ColumnValues, RecordedColumns, RecordingRow, RecordingRows, Row, Trajectory, TrajectoryError,
};
pub use trajectory_ticks::{Pace, Tick, TrajectoryTicks};

use hapterra_core::contact::ContactState;
use hapterra_core::force::SurfaceParams;
use hapterra_core::rate::TickRate;
use hapterra_core::scene::TickRecord;

use crate::link::{LinkError, Native, Timeouts};
use crate::output::{Output, OutputError};
use crate::terrain::{HapticGrid, Terrain, TerrainError};
use settings::PlacementSettings;

/// Reason why a replay ended early. No file remains at the output's path.
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
    /// A placement of the recording whose terrain cannot be rendered.
    #[error("placement {number} of the recording cannot be rendered: {why}")]
    Placement {
        /// Number of the placement.
        number: u32,
        /// Reason for the refusal.
        why: TerrainError,
    },
    /// The user interrupted the replay.
    #[error("interrupted")]
    Interrupted,
}

/// Summary of a replay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Summary {
    /// Rendered ticks, one row of the output for each.
    pub rows: u64,
    /// Rows in contact.
    pub in_contact: u64,
    /// Rows below the ground that were not rendered, because the HIP had not been above it.
    pub below_ground: u64,
    /// Rows whose HIP is more than a window of the device away from the row before: contact starts
    /// again there.
    pub leaps: u64,
}

/// The additional columns of a replay's recording; the placement only if there are several.
const MORE: [Column; 2] = [Column::Text("state"), Column::Count("view")];

/// Receives each sample and its row, and the number and terrain of its placement.
pub type OnSample<'f, 't> = dyn FnMut(&TickRecord, &Record, (u32, &Terrain<'t>)) + 'f;

/// Renders a trajectory on a device and writes the samples to an output, which appears only when it
/// is complete.
///
/// `on_sample` receives each sample; `should_continue` is called regularly with the number of rows, and
/// returns false to stop.
///
/// # Errors
/// [`ReplayError`] reports the fault with file, line and column.
pub fn replay_trajectory<'t>(
    replayer: &mut OfflineDevice<'t>,
    ticks: &mut TrajectoryTicks,
    settings: &Settings,
    output: Output,
    on_sample: &mut OnSample<'_, 't>,
    should_continue: &mut dyn FnMut(u64) -> bool,
) -> Result<Summary, ReplayError> {
    const CHECK_INTERVAL_ROWS: u64 = 512;
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
        // A file without settings has no placements.
        if tick.view != view && !settings.views.is_empty() {
            view = tick.view;
            let of_views = (&first, settings);
            change_placement(
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
        if summary.rows % CHECK_INTERVAL_ROWS == 0 && !should_continue(summary.rows) {
            return Err(ReplayError::Interrupted);
        }
    }
    marks.for_each(|mark| recording.mark(mark));
    recording.finish()?;
    Ok(summary)
}

/// Returns the terrain of a recording in another of its placements.
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
    first.with_grid(grid, scale, view.level).map_err(cannot)
}

/// Changes to the placement of a row, as in the recorded session.
fn change_placement<'t>(
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

/// Returns true if no force is rendered because the HIP is below ground and did not enter through
/// the surface.
#[must_use]
pub fn is_below_ground(sample: &TickRecord, record: &Record, terrain: &Terrain<'_>) -> bool {
    let [x, y, z] = record.hip_mm;
    let waits = sample.state == ContactState::Unseeded && sample.missing_tile.is_none();
    waits && terrain.height_mm(x, y).is_some_and(|ground| z < ground)
}

/// Opens an offline device on the application in this program's memory, at a thousand ticks a
/// second.
///
/// # Errors
/// As [`OfflineDevice::open`].
pub fn on_native<'t>(
    terrain: &'t Terrain<'t>,
    params: SurfaceParams,
) -> Result<OfflineDevice<'t>, LinkError> {
    on_native_at(TickRate::DEFAULT, terrain, params)
}

/// As [`on_native`], at another tick rate.
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
