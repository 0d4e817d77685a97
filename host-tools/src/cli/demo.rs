//! `hapterra demo`: a whole session, from a terrain file to a picture of the rendered forces.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::ValueHint;
use hapterra_core::phantom::Calibration;

use super::failure::{Failure, OrHint};
use super::options::device::{EmulatedBoard, VirtualDevice};
use super::options::events::{self, EventOptions};
use super::options::placing::{self, Placing};
use super::options::rendering::Rendering;
use super::options::steering::{self, Commands, PlacementControl};
use super::options::terrain_file::{ReadingOptions, TerrainFile};
use super::run::duration;
use super::session_summary::{self, SessionSummary};
use super::settings::SettingsOption;
use super::terminal::waiting::shown_planning;
use super::terminal::{interrupt, partial_files, progress, writer};
use super::viewing::{PreparedViewer, ViewerSession, Viewing};
use crate::events::{Event as Reported, Watcher};
use crate::link::{
    Arming, Event, HostClock, LinkError, Native, Session, Timeouts, Transport, move_arm_while,
};
use crate::materials::Materials;
use crate::output::{Output, OutputError, OutputFolder, check_distinct};
use crate::phantom::{HeldPhantom, PlacedTerrain};
use crate::place::{PlacedSurface, Placement};
use crate::replay::settings::{Device, PlacementSettings};
use crate::replay::{LoopColumns, Mark, Record, Recording, Rule, Settings};
use crate::stability;
use crate::synth::{Kind, Synth};
use crate::telemetry::{Placements, SampleLog};
use heightfield::without_key;
use heightfield::{Raster, files_read_with};

/// Samples along the side of the demo's own terrain.
const OWN_SIZE: u32 = 1024;
/// Name of the demo's own terrain in a recording: the command that makes it as a file.
pub(super) const OWN_TERRAIN: &str = "hapterra synth fractal --size 1024 --seed 1";

/// Arguments of `hapterra demo`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Terrain file, or many: a folder, a quoted pattern, a .vrt; without one the demo makes a
    /// terrain
    #[arg(value_hint = ValueHint::FilePath)]
    pub file: Option<PathBuf>,

    /// Properties that the file does not state.
    #[command(flatten)]
    pub reading: ReadingOptions,

    /// Device of the loop: native, emulated or emulated:ELF
    ///
    /// emulated: the Cortex-M4F board in QEMU, with the image ELF, else that of HAPTERRA_MPS2_ELF.
    /// [default: emulated if that variable names an image, else native]
    #[arg(long)]
    pub device: Option<VirtualDevice>,

    /// Folder for the picture and the recording
    #[arg(short, long, value_name = "DIR", default_value = "demo", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,

    /// End after this time of the device, such as 60s
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub duration: Option<f64>,

    /// Number of tours
    #[arg(long, value_name = "N", default_value_t = 1,
          value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub rounds: u32,

    /// Place and scale of the terrain.
    #[command(flatten)]
    pub placing: Placing,

    /// Rendering.
    #[command(flatten)]
    pub rendering: Rendering,

    /// Source of the settings.
    #[command(flatten)]
    pub settings: SettingsOption,

    /// Commands that change the placement during the session.
    #[command(flatten)]
    pub commands: Commands,

    /// Events to other programs.
    #[command(flatten)]
    pub events: EventOptions,

    /// The viewer.
    #[command(flatten)]
    pub viewing: Viewing,
}

/// Runs the demonstration.
///
/// # Errors
/// The file, the device or the output folder fails.
pub fn run(args: &Args) -> Result<(), Failure> {
    let (raster, name) = terrain_of(args)?;
    let outputs = Outputs::new(&args.out, &name);
    outputs.check_distinct(args)?;
    let options = &args.rendering.surface;
    let surface = options.load()?;
    let params = surface.params;
    let materials = surface.materials(options, (&name, &raster), &args.reading)?;
    args.rendering.warn_if_level_is_kept(materials.is_some());
    let cells = args.reading.cells();
    let mut request = args.placing.of((&args.rendering, cells), &raster)?;
    request.grid = request.grid.with_materials(materials.as_ref());
    request.grid = request.grid.with_tip(args.rendering.tip_of_hand_mm());
    // The virtual arm is a Premium 1.5.
    let view = request.view(&Calibration::PREMIUM_1_5)?;
    let terrain = view.terrain(request.grid)?;
    let placed = shown_planning(&name, &raster, || {
        PlacedTerrain::in_view(&terrain, view.home_mm, params, &|| !interrupt::requested())
    })?;
    let placed = placed.repeated(args.rounds);
    show(args, (&placed, &view), &name, &outputs)
}

fn terrain_of(args: &Args) -> Result<(Raster, String), Failure> {
    if let Some(file) = &args.file {
        let input = TerrainFile {
            file: file.clone(),
            reading: args.reading.clone(),
        };
        return Ok((input.open()?, input.name()));
    }
    Ok((own_terrain()?, "fractal".into()))
}

/// Returns the demo's own terrain: [`OWN_TERRAIN`].
pub(super) fn own_terrain() -> Result<Raster, Failure> {
    let amplitude = Kind::Fractal.default_amplitude_cells();
    let raster = Synth::new(Kind::Fractal, 1, amplitude).raster(OWN_SIZE, OWN_SIZE);
    raster.map_err(Failure::new)
}

/// Hint for an output of the demo that cannot be written.
const OTHER_FOLDER: &str = "name another folder with --out";

/// The files that the demo writes.
struct Outputs {
    folder: PathBuf,
    recording: PathBuf,
    picture: PathBuf,
}

impl Outputs {
    /// Returns the outputs in a folder, named after the terrain.
    fn new(folder: &Path, name: &str) -> Self {
        let stem = Path::new(name).file_stem();
        let stem = stem.map_or(name.into(), |stem| stem.to_string_lossy());
        Self {
            folder: folder.to_owned(),
            recording: folder.join(format!("{stem}.csv")),
            picture: folder.join(format!("{stem}.png")),
        }
    }

    fn check_distinct(&self, args: &Args) -> Result<(), Failure> {
        let mut inputs = args.file.as_deref().map_or(vec![], files_read_with);
        inputs.extend(args.commands.file());
        inputs.extend(args.rendering.surface.inputs());
        inputs.extend(args.settings.file());
        check_distinct(&[&self.recording, &self.picture], &inputs).or_hint(OTHER_FOLDER)
    }
}

/// Runs the tour and draws its forces.
fn show(
    args: &Args,
    (placed, view): (&PlacedTerrain<'_>, &Placement),
    name: &str,
    outputs: &Outputs,
) -> Result<(), Failure> {
    // The folder is removed again if it stays empty.
    let _folder = OutputFolder::create(&outputs.folder).or_hint(OTHER_FOLDER)?;
    let terrain = placed.terrain();
    println!(
        "terrain        {name}: {}",
        session_summary::in_words(terrain)
    );
    print!("{}", placing::describe(view, terrain));
    if let Some(line) = session_summary::materials(terrain) {
        println!("{line}");
    }
    partial_files::report([outputs.recording.as_path(), &outputs.picture]);
    let server = args.events.listen()?;
    let (runs_on, mut control) = (device(args), control(args, placed, view)?);
    if let Some(line) = control.listen(&args.commands) {
        writer::write_text(std::io::stderr(), &format!("{line}\n"));
    }
    let arm = placed.held_phantom();
    let stop_s = args.duration.unwrap_or(f64::MAX).min(placed.duration_s());
    interrupt::listen();
    let viewer = args.viewing.program()?;
    let viewer = viewer.map(|program| PreparedViewer::new(program, terrain, view, name));
    terrain.check_complete()?;
    let tour = Tour {
        placed,
        stop_s,
        is_level_by_speed: args.rendering.is_level_by_speed(),
        control: &mut control,
        viewer,
        events: server.as_ref().map(|server| args.events.watcher(server, 1)),
    };
    let (tour_result, viewer) = match runs_on {
        VirtualDevice::Native => {
            let mut device = Native::new(HostClock::default(), Some(Box::new(arm)));
            if args.viewing.view || args.events.events.is_some() {
                device = device.in_real_time();
            }
            tour.run(Box::new(device), Timeouts::EMULATED)?
        }
        VirtualDevice::Emulated(board) => tour_emulated(&board, tour, arm)?,
    };
    server.into_iter().for_each(events::end);
    // Restores the terminal.
    drop(control);
    let file = args.file.as_ref();
    let file = file.map_or(OWN_TERRAIN.into(), |file| without_key(file));
    let device = Device::of(&tour_result.summary.device);
    let params = (placed.params(), Rule::Swept);
    let settings = Settings::new(&file, terrain, params, Some(placed.home_mm()), device);
    write(&tour_result, &settings, &outputs.recording).or_hint(OTHER_FOLDER)?;
    let summary = &tour_result.summary;
    print!("{}", summary.text());
    draw(&tour_result, view, name, &outputs.picture)?;
    println!("recording      {}", outputs.recording.display());
    println!("picture        {}", outputs.picture.display());
    if let Some(viewer) = viewer {
        viewer.end(|line| println!("{line}"));
    }
    match summary.figures.fault {
        None => Ok(()),
        Some(fault) => Err(format!(
            "the device latched fault {} ({fault:?})",
            fault.number()
        ))
        .or_hint("this should not happen with a virtual arm: please report it"),
    }
}

/// Returns the requested device; by default the emulated board if there is one.
fn device(args: &Args) -> VirtualDevice {
    match &args.device {
        Some(device) => device.clone(),
        None if EmulatedBoard::has_image() => VirtualDevice::Emulated(EmulatedBoard::default()),
        None => {
            eprintln!(
                "note: no image of the emulated board is named (--device emulated:ELF), so the same application runs in this program (--device native)"
            );
            VirtualDevice::Native
        }
    }
}

/// Returns the steering by keys and commands.
fn control<'t>(
    args: &Args,
    placed: &PlacedTerrain<'t>,
    view: &Placement,
) -> Result<PlacementControl<'t>, Failure> {
    let (params, view) = (placed.params(), *view);
    let arm = (&Calibration::PREMIUM_1_5, args.rendering.fixed_level());
    let served = (placed.terrain(), PlacedSurface { view, params });
    Ok(PlacementControl::new(served, arm, args.commands.open()?))
}

/// Result of a tour.
struct TourResult<'t> {
    /// The rows of the recording, with the loop's columns.
    rows: Vec<(Record, LoopColumns)>,
    marks: Vec<Mark>,
    views: Placements<'t>,
    summary: SessionSummary,
}

/// Draws only the last placement's samples, because another placement's coordinates are other
/// positions of the hand.
fn draw(
    tour_result: &TourResult<'_>,
    first: &Placement,
    name: &str,
    path: &Path,
) -> Result<(), Failure> {
    let last = tour_result
        .rows
        .last()
        .map_or(0, |(_, of_loop)| of_loop.view());
    let in_last = tour_result
        .rows
        .iter()
        .filter(|(_, of_loop)| of_loop.view() == last);
    let records: Vec<Record> = in_last.map(|(record, _)| *record).collect();
    let placement = tour_result.views.get(last as usize);
    let view = placement
        .placed_surface
        .as_ref()
        .map_or(*first, |placed_surface| placed_surface.view);
    let title = match (last, records.first()) {
        (0, _) | (_, None) => name.to_owned(),
        (_, Some(began)) => format!("{name}, view {last}, from {:.1} s on", began.t_s),
    };
    let summary = &tour_result.summary;
    summary.draw(path, (&placement.terrain, &view), &title, &records)
}

/// Runs the tour on an emulated board, with the arm in its own thread.
fn tour_emulated<'t>(
    board: &EmulatedBoard,
    tour: Tour<'_, 't>,
    mut arm: HeldPhantom,
) -> Result<(TourResult<'t>, Option<ViewerSession<'t>>), Failure> {
    let (emulator, mut lines) = board.start()?;
    let report = "please report it with the file";
    move_arm_while(&mut lines.plant, &mut arm, || {
        match tour.run(Box::new(lines.link), Timeouts::EMULATED) {
            Ok(tour_result) => {
                // The arm must run until the board has reduced its force to zero.
                let ended = emulator.finish().map(|()| tour_result);
                ended
                    .map_err(|why| format!("the emulated board ended with an error: {why}"))
                    .or_hint(report)
            }
            // The user ended the tour, and the board may not have been able to reply.
            Err(_) if interrupt::requested() => Err("interrupted").or_hint("nothing was written"),
            // If the link broke because the board ended, the board's failure is reported.
            Err(error) => match emulator.failure() {
                Some(output) => Err(format!("the emulated board failed: {output}")).or_hint(report),
                None => Err(error.into()),
            },
        }
    })
}

/// A tour to run.
struct Tour<'p, 't> {
    placed: &'p PlacedTerrain<'t>,
    stop_s: f64,
    is_level_by_speed: bool,
    control: &'p mut PlacementControl<'t>,
    /// Its viewer.
    viewer: Option<PreparedViewer<'t>>,
    events: Option<Watcher>,
}

impl<'t> Tour<'_, 't> {
    /// Serves the terrain until the tour ends.
    fn run(
        self,
        transport: Box<dyn Transport + 't>,
        timeouts: Timeouts,
    ) -> Result<(TourResult<'t>, Option<ViewerSession<'t>>), LinkError> {
        let (terrain, scene) = (self.placed.terrain(), self.placed.scene());
        let (control, mut events) = (self.control, self.events);
        let arming = Some(Arming::VIRTUAL);
        let (mut session, device) = Session::open(terrain, scene, arming, transport, timeouts)?;
        if self.is_level_by_speed {
            control.follow_speed(device.tick_hz);
        }
        let line = format!("device         {}\n", session_summary::device(&device));
        writer::write_text(std::io::stdout(), &line);
        let materials = terrain.grid().materials();
        stability::warn_for_materials(&scene.params, materials.map(Materials::table), &device);
        let notify = |line: String| writer::write_text(std::io::stderr(), &(line + "\n"));
        let mut viewer = self.viewer.and_then(|viewer| viewer.start(&device, notify));
        let stop_tick = (self.stop_s * f64::from(device.tick_hz)).ceil() as u64;
        let template = "rendering {bar:30} {human_pos} of {human_len} ticks, {elapsed}";
        let progress = progress::bar(Some(stop_tick), template);
        let (mut log, mut rows) = (SampleLog::new(terrain, &device), Vec::new());
        let mut marks = Vec::new();
        let mut polled = Ok(());
        while polled.is_ok() && log.ticks() < stop_tick && !interrupt::requested() {
            polled = session.poll(Duration::from_millis(100), &mut |event| {
                control.on_event(&event);
                log.views().on_event(&event);
                if let Some(viewer) = &mut viewer {
                    viewer.on_event(&event);
                }
                if let Event::Sample(sample) = event {
                    let record = log.add(sample);
                    if let Some(viewer) = &mut viewer {
                        viewer.on_sample(sample, &record, log.view());
                    }
                    if let Some(events) = &mut events {
                        let (view, placement) = log.view();
                        events.on_sample(sample, &record, (view, &placement.terrain));
                    }
                    rows.push((record, LoopColumns::of(sample, log.view().0)));
                }
            });
            let print_line = |line: String| progress.suspend(|| notify(line));
            let refuse = |text: String| {
                if let Some(events) = &events {
                    events.send_now(&Reported::Refused { text: &text });
                }
                print_line(text);
            };
            control.update(log.t_s(), &mut |text| refuse(text));
            if control.entered().is_some() {
                refuse("a virtual arm has no open question for `enter`".into());
            }
            for mark in control.marks(&log, false) {
                print_line(steering::mark_text(&mark));
                if let Some(events) = &events {
                    events.mark(&mark);
                }
                marks.push(mark);
            }
            for request in control.requests() {
                session.enqueue(request);
            }
            if let Some(update) = control.take_update(log.views()) {
                polled = polled.and(session.put_view(update.view, update.terrain));
            }
            progress.set_position(log.ticks());
            if let Some(viewer) = &mut viewer {
                viewer.send_due(session.stats());
            }
        }
        progress.finish_and_clear();
        marks.extend(control.marks(&log, true));
        let figures = log.figures();
        let ticks = log.ticks();
        // The device is always notified of the end; its samples after the tour are not shown.
        let closed = session.close(&mut |_| {});
        if let Some(events) = &events {
            let disarmed = closed.is_ok();
            events.send_now(&Reported::End { disarmed });
        }
        polled.and(closed)?;
        let summary = SessionSummary {
            ticks,
            device,
            figures,
            stats: session.stats().clone(),
        };
        let tour_result = TourResult {
            rows,
            marks,
            views: log.into_views(),
            summary,
        };
        Ok((tour_result, viewer))
    }
}

fn write(
    tour_result: &TourResult<'_>,
    settings: &Settings,
    path: &Path,
) -> Result<(), OutputError> {
    let mut recording = Recording::new(Output::create(path)?, &LoopColumns::COLUMNS)?;
    recording.describe(settings);
    let (mut described_view, mut marks) = (0, tour_result.marks.iter().peekable());
    for (record, columns) in &tour_result.rows {
        while let Some(mark) = marks.next_if(|mark| mark.t_s <= record.t_s) {
            recording.mark(mark);
        }
        let (number, placement) = (
            columns.view(),
            tour_result.views.get(columns.view() as usize),
        );
        if number > described_view
            && let Some(placed_surface) = &placement.placed_surface
        {
            described_view = number;
            recording.view(&PlacementSettings::new(
                number,
                &placement.terrain,
                placed_surface,
            ))?;
        }
        recording.write(record, &columns.values())?;
    }
    marks.for_each(|mark| recording.mark(mark));
    recording.finish()
}
