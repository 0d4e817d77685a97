//! `hapterra replay`: renders a trajectory, tick by tick.

use std::path::PathBuf;
use std::time::Instant;

use clap::ValueHint;
use hapterra_core::force::{Damping, SurfaceParams};
use hapterra_core::rate::TickRate;
use hapterra_core::scene::TickRecord;

use super::failure::{Failure, OrHint};
use super::options::device::{EmulatedBoard, VirtualDevice};
use super::options::rendering::Rendering;
use super::options::terrain_file::TerrainFile;
use super::session_summary;
use super::settings::{SettingsOption, differences};
use super::terminal::{interrupt, partial_files, progress};
use super::viewing::{self, Viewing};
use crate::link::{Timeouts, Transport};
use crate::materials::Materials;
use crate::output::{Output, check_distinct};
use crate::replay::settings::{Device, PlacementSettings};
use crate::replay::{
    Mark, OfflineDevice, Pace, Record, ReplayError, Rule, Settings, Summary, Trajectory,
    TrajectoryTicks, on_native_at, replay_trajectory,
};
use crate::stability;
use crate::terrain::Terrain;
use crate::view_feed::{Picture, Program, ViewFeed};

/// Arguments of `hapterra replay`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The terrain file.
    #[command(flatten)]
    pub terrain: TerrainFile,

    /// Trajectory of the HIP: CSV with the header t_s,x_mm,y_mm,z_mm, or a recording
    ///
    /// Device millimetres; x east, y north, z up, origin at the south-west sample at height zero: at
    /// 1mm/cell they count haptic cells, which are squares on the ground. Further columns are ignored.
    /// It is replayed at the device's ticks, a thousand a second, by t_s, seconds: between two rows the
    /// HIP moves on a straight line at a constant speed, and the output has a row for each tick. Rows a
    /// tick apart are replayed row by row; so are those of a file without t_s, header x_mm,y_mm,z_mm.
    /// A recording, CSV or Parquet, is replayed with the settings that it was recorded with, tick rate
    /// and contact rule included, on the terrain that it was recorded on; options given here win.
    #[arg(value_hint = ValueHint::FilePath)]
    pub trajectory: PathBuf,

    /// Take a recording's path alone: not its settings, and on any terrain
    #[arg(long)]
    pub ignore_settings: bool,

    /// Take each row as one tick, whatever t_s says
    #[arg(long)]
    pub rows_are_ticks: bool,

    /// File for the recording: CSV, Parquet if its name ends in .parquet, - for standard output
    #[arg(short, long, value_hint = ValueHint::FilePath)]
    pub out: PathBuf,

    /// Device of the loop: native, emulated or emulated:ELF
    ///
    /// emulated: the Cortex-M4F board in QEMU, with the image ELF, else that of HAPTERRA_MPS2_ELF.
    #[arg(long, default_value = "native")]
    pub device: VirtualDevice,

    /// Rendering of the terrain.
    #[command(flatten)]
    pub rendering: Rendering,

    /// Source of the settings.
    #[command(flatten)]
    pub settings: SettingsOption,

    /// The viewer.
    #[command(flatten)]
    pub viewing: Viewing,
}

/// Replays the trajectory.
///
/// # Errors
/// The terrain, the trajectory, the device or the output fails.
pub fn run(args: &Args) -> Result<(), Failure> {
    run_with_rule(args, None)
}

/// Replays the trajectory with a contact rule; by default the recording's, else that of devices.
///
/// # Errors
/// As [`run`].
pub fn run_with_rule(args: &Args, rule: Option<Rule>) -> Result<(), Failure> {
    args.rendering.check_level_without_hand()?;
    let mut inputs = args.terrain.inputs();
    inputs.push(args.trajectory.clone());
    let of_surface = args.rendering.surface.inputs();
    inputs.extend(of_surface);
    inputs.extend(args.settings.file());
    check_distinct(&[&args.out], &inputs).or_hint("name another file with -o")?;
    partial_files::report([args.out.as_path()]);
    let viewer = args.viewing.program()?;
    let trajectory = Trajectory::open(&args.trajectory).map_err(ReplayError::from)?;
    let recorded = trajectory
        .settings()
        .filter(|_| !args.ignore_settings)
        .cloned();
    let recorded_at = recorded.as_ref().map(rate_of).transpose()?;
    if let Some(recorded) = &recorded {
        check_options(args, recorded)?;
    }
    let rendering = &args.rendering;
    let raster = args.terrain.open()?;
    let measured_at = recorded.as_ref().and_then(|it| it.rendered.measured_at);
    let name = args.terrain.name();
    let (options, reading) = (&rendering.surface, &args.terrain.reading);
    let surface = options.load()?;
    let recorded_rule = recorded.as_ref().map(|it| it.force.rule);
    let rule = rule.or(recorded_rule).unwrap_or(Rule::Swept);
    check_rule(rule, &surface.params)?;
    let materials = surface.materials(options, (&name, &raster), reading)?;
    let grid = rendering.grid((&raster, reading.cells()), measured_at);
    let grid = grid.with_materials(materials.as_ref());
    let scale = rendering.scale(&grid)?;
    let terrain = rendering.terrain(grid, scale)?;
    let file = args.terrain.file.display().to_string();
    if let Some(recorded) = &recorded {
        recorded.check_terrain(&file, &terrain)?;
    }
    for line in [
        session_summary::materials(&terrain),
        session_summary::tip(&terrain),
    ] {
        line.iter().for_each(|line| eprintln!("{line}"));
    }
    let home_mm = recorded.as_ref().and_then(|it| it.rendered.home_mm);
    let later = recorded.map(|it| (it.views, it.marks));
    let (views, marks) = later.unwrap_or_default();
    let replayed = Inputs {
        terrain: &terrain,
        params: (surface.params, rule),
        file,
        title: args.terrain.name(),
        home_mm,
        recorded_at,
        views,
        marks,
        viewer,
    };
    let began = Instant::now();
    let (summary, mut ticks) = match &args.device {
        VirtualDevice::Native => native(args, &replayed, trajectory),
        VirtualDevice::Emulated(board) => emulated(args, board, &replayed, trajectory),
    }?;
    let seconds = began.elapsed().as_secs_f64();
    for remark in ticks.remarks() {
        eprintln!("note: {}: {remark}", args.trajectory.display());
    }
    if ticks.trajectory().was_cut() {
        eprintln!(
            "{}: its last row is cut in the middle, and left out: the command that wrote it was killed",
            args.trajectory.display()
        );
    }
    if summary.below_ground > 0 {
        eprintln!(
            "{} rows are below ground and not rendered: the HIP had not been above the surface before them",
            summary.below_ground
        );
    }
    if summary.leaps > 0 {
        eprintln!(
            "{} rows move the HIP by more than the device's window: contact starts again there",
            summary.leaps
        );
    }
    eprintln!(
        "{} rows, {} in contact, {:.0} rows a second: {}{}",
        summary.rows,
        summary.in_contact,
        summary.rows as f64 / seconds.max(1e-9),
        args.out.display(),
        ticks
            .pace()
            .map(|pace| format!("; {pace}"))
            .unwrap_or_default()
    );
    Ok(())
}

/// Inputs of a replay.
struct Inputs<'t> {
    terrain: &'t Terrain<'t>,
    params: (SurfaceParams, Rule),
    /// The recording's tick rate.
    recorded_at: Option<TickRate>,
    /// The recording's further placements.
    views: Vec<PlacementSettings>,
    /// The recording's marks.
    marks: Vec<Mark>,
    /// The terrain file, as named by the user.
    file: String,
    /// The title in the viewer.
    title: String,
    /// Home position of the arm, if a recording states it.
    home_mm: Option<[f64; 3]>,
    /// The viewer.
    viewer: Option<Program>,
}

impl<'t> Inputs<'t> {
    fn viewer_feed(&self, replayer: &OfflineDevice<'_>) -> Result<Option<ViewFeed<'t>>, Failure> {
        let Some(program) = &self.viewer else {
            return Ok(None);
        };
        let device = replayer.device();
        let mut picture = self.picture(self.terrain, self.home_mm);
        picture.facts = vec![("rendered by".to_owned(), device.board.to_string())];
        Ok(Some(ViewFeed::start(
            program,
            picture.prepare(),
            Some(device),
        )?))
    }

    fn picture<'p>(
        &'p self,
        terrain: &'p Terrain<'t>,
        home_mm: Option<[f64; 3]>,
    ) -> Picture<'p, 't> {
        Picture {
            terrain,
            title: &self.title,
            facts: vec![],
            home_mm,
            laid_mm: None,
            // A replay runs as fast as it can, so the viewer does not follow its time.
            is_live: false,
        }
    }
}

/// Reports options that differ from the recording.
///
/// # Errors
/// Options for a recording of several placements, each with its own; a recording that cannot be
/// read twice.
fn check_options(args: &Args, recorded: &Settings) -> Result<(), Failure> {
    if !args.trajectory.is_file() {
        return Err("the recording must be a regular file, because it is read twice")
            .or_hint("write it to a file first, or replay the path alone with --ignore-settings");
    }
    let cells = args.terrain.reading.cells();
    let lines = differences(&args.rendering, cells, (&args.trajectory, recorded));
    if let (Some(line), false) = (lines.first(), recorded.views.is_empty()) {
        let views = 1 + recorded.views.len();
        return Err(format!(
            "{line}: a recording of {views} placements is rendered in its own"
        ))
        .or_hint("leave that option out, or replay the path alone with --ignore-settings");
    }
    for line in lines {
        eprintln!("note: {line}");
    }
    Ok(())
}

/// Checks that the surface parameters have no effects under the published rule, which supports
/// none.
fn check_rule(rule: Rule, params: &SurfaceParams) -> Result<(), Failure> {
    let plain = SurfaceParams {
        stiffness_n_per_mm: params.stiffness_n_per_mm,
        max_force_n: params.max_force_n,
        damping: Damping {
            ns_per_m: 0.0,
            ..params.damping
        },
        ..SurfaceParams::PREMIUM
    };
    match rule == Rule::Paper && *params != plain {
        false => Ok(()),
        true => Err("an effect with the published contact rule, which has none")
            .or_hint("leave out what --surface and --friction add, or replay the path alone with --ignore-settings"),
    }
}

/// Returns the tick rate of a recording.
fn rate_of(recorded: &Settings) -> Result<TickRate, Failure> {
    let tick_hz = recorded.device.tick_hz;
    let why = format!("the recording has tick_hz = {tick_hz}, and no device has that rate");
    TickRate::new(tick_hz)
        .ok_or(why)
        .or_hint("correct tick_hz in its settings (whole kilohertz from 1000 to 10000), or replay its path alone with --ignore-settings")
}

fn native(
    args: &Args,
    replayed: &Inputs<'_>,
    trajectory: Trajectory,
) -> Result<(Summary, TrajectoryTicks), Failure> {
    let (params, rule) = replayed.params;
    let rate = replayed.recorded_at.unwrap_or_default();
    let mut replayer = on_native_at(rate, replayed.terrain, params)?;
    if rule == Rule::Paper {
        replayer = replayer.by_published_rule(params);
    }
    replay(args, replayed, trajectory, &mut replayer)
}

fn emulated(
    args: &Args,
    board: &EmulatedBoard,
    replayed: &Inputs<'_>,
    trajectory: Trajectory,
) -> Result<(Summary, TrajectoryTicks), Failure> {
    let (params, rule) = replayed.params;
    if rule == Rule::Paper {
        return Err("no device has the published contact rule of this recording")
            .or_hint("leave --device out: the host renders it");
    }
    let (emulator, lines) = board.start()?;
    // The arm's line stays open without data, because the trajectory replaces the arm.
    let _plant = lines.plant;
    let link: Box<dyn Transport> = Box::new(lines.link);
    let mut replayer = OfflineDevice::open(replayed.terrain, params, link, Timeouts::EMULATED)?;
    let replayed = replay(args, replayed, trajectory, &mut replayer)?;
    replayer.close()?;
    if let Err(why) = emulator.finish() {
        tracing::info!("the emulated board ended with an error: {why}");
    }
    Ok(replayed)
}

/// Returns the trajectory at the ticks of a device.
fn ticks(
    args: &Args,
    replayed: &Inputs<'_>,
    trajectory: Trajectory,
    tick_hz: u32,
) -> Result<TrajectoryTicks, Failure> {
    let recorded = replayed.recorded_at.map(TickRate::hz);
    if let Some(recorded_hz) = recorded.filter(|hz| *hz != tick_hz) {
        let why =
            format!("the recording has {recorded_hz} ticks a second, and the device has {tick_hz}");
        return Err(why).or_hint(
            "replay it with --device native, or replay its path alone, by its own times, with --ignore-settings",
        );
    }
    let pace = match recorded {
        _ if args.rows_are_ticks => Pace::RowByRow,
        Some(_) => Pace::Recorded,
        None => Pace::ByTime,
    };
    Ok(TrajectoryTicks::new(trajectory, pace, tick_hz))
}

fn replay<'t>(
    args: &Args,
    replayed: &Inputs<'t>,
    trajectory: Trajectory,
    replayer: &mut OfflineDevice<'t>,
) -> Result<(Summary, TrajectoryTicks), Failure> {
    let mut ticks = ticks(args, replayed, trajectory, replayer.device().tick_hz)?;
    let progress = progress::bar(None, "{spinner} {human_pos} rows, {per_sec}");
    interrupt::listen();
    let materials = replayed.terrain.grid().materials();
    let table = materials.map(Materials::table);
    stability::warn_for_materials(&replayed.params.0, table, replayer.device());
    let device = Device::of(replayer.device());
    let mut settings = Settings::new(
        &replayed.file,
        replayed.terrain,
        replayed.params,
        None,
        device,
    );
    settings.views.clone_from(&replayed.views);
    settings.marks.clone_from(&replayed.marks);
    let output = Output::create_or_standard_output(&args.out).map_err(ReplayError::from)?;
    let mut feed = replayed.viewer_feed(replayer)?;
    let mut shown = 0;
    let mut show = |sample: &TickRecord, record: &Record, (view, terrain): (u32, &Terrain<'t>)| {
        let Some(feed) = &mut feed else {
            return;
        };
        if view != shown {
            shown = view;
            let settings = replayed.views.iter().find(|known| known.number == view);
            let home_mm = settings.map(|settings| settings.home_mm);
            feed.change_placement(replayed.picture(terrain, home_mm));
        }
        feed.keep_detailed(record);
        feed.on_sample(sample, record);
    };
    let summary = replay_trajectory(
        replayer,
        &mut ticks,
        &settings,
        output,
        &mut show,
        &mut |rows| {
            progress.set_position(rows);
            !interrupt::requested()
        },
    );
    progress.finish_and_clear();
    if let Some(feed) = feed {
        viewing::end(feed, |line| eprintln!("{line}"));
    }
    Ok((summary?, ticks))
}
