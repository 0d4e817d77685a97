//! `hapterra run`: serves a terrain to a device for as long as it is touched.

mod watch;

use std::path::PathBuf;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use clap::ValueHint;
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::Scene;
use hapterra_core::wire::hello::DeviceHello;
use hapterra_core::wire::session::{DEFAULT_SILENCE_S, SILENCE_S};

use super::bringup::required::{brought_up, drives_no_arm};
use super::failure::{Failure, OrHint};
use super::met_device::calibration_of;
use super::options::placing::{self, Placing};
use super::options::rendering::Rendering;
use super::options::steering::{Commands, ViewControl};
use super::options::terrain_file::TerrainFile;
use super::session_summary::{self, SessionSummary};
use super::terminal::voice::{say, show, tell};
use super::terminal::{interrupt, left_behind};
use super::viewing::{ToBeShown, Viewing};
use crate::link::{
    Arming, DeviceAddress, HostClock, LinkError, Native, Patience, Tcp, Transport, serve_plant,
};
use crate::output::{Output, keep_apart};
use crate::phantom::{HeldPhantom, PlacedTerrain};
use crate::place::{Laid, View};
use crate::remote::without_key;
use crate::replay::settings::Device;
use crate::replay::{Column, LoopColumns, Recording, Settings};
use crate::serving::{Service, told_of_last_end};
use crate::stability::limits;
use crate::steering::CommandQueue;
use crate::terrain::Terrain;
use watch::Watch;

/// Between two tries to find a device that is gone.
const RETRY: Duration = Duration::from_millis(500);
/// For how long the virtual arm stays after the session has ended.
const LINGER: Duration = Duration::from_secs(2);
/// What to do where the recording cannot be written.
const OTHER_FILE: &str = "name another file with --record";

/// Arguments of `hapterra run`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The terrain file.
    #[command(flatten)]
    pub terrain: TerrainFile,

    /// Device: usb, usb:SERIAL (`hapterra list` shows it), tcp:HOST:PORT, or native (the
    /// application in this program, with a virtual Phantom in a scripted hand)
    #[arg(long, default_value = "usb")]
    pub device: DeviceAddress,

    /// Where the emulated board's plant line is, for a virtual Phantom in a
    /// scripted hand: tcp:HOST:PORT
    #[arg(long, value_name = "tcp:HOST:PORT", value_parser = parse_plant)]
    pub plant: Option<String>,

    /// Write what was felt to a file, tick by tick, as replay does: CSV, or Parquet where
    /// its name ends in .parquet
    #[arg(long, value_name = "OUT", value_hint = ValueHint::FilePath)]
    pub record: Option<PathBuf>,

    /// End after this many seconds of the device's time
    #[arg(long, value_name = "S")]
    pub seconds: Option<f64>,

    /// For how many seconds the device lets an armed arm be while it hears nothing from
    /// here; then it lets the force out and disarms
    #[arg(long, value_name = "S", default_value_t = DEFAULT_SILENCE_S,
          value_parser = clap::value_parser!(u16).range(i64::from(SILENCE_S.0)..=i64::from(SILENCE_S.1)))]
    pub silence_s: u16,

    /// Serve a real board although its log of `hapterra bringup` is not complete
    #[arg(long)]
    pub unchecked: bool,

    /// Which part of the terrain, and how large.
    #[command(flatten)]
    pub placing: Placing,

    /// How the terrain feels.
    #[command(flatten)]
    pub rendering: Rendering,

    /// How the view may be changed meanwhile.
    #[command(flatten)]
    pub commands: Commands,
    /// Whether it is shown.
    #[command(flatten)]
    pub viewing: Viewing,
}

impl Args {
    /// The same, and the board that is the only one now for good: one that is plugged in
    /// later is not taken for it.
    #[must_use]
    pub fn pinned(mut self) -> Self {
        self.device = self.device.pinned();
        self
    }
}

fn parse_plant(text: &str) -> Result<String, String> {
    match text.parse()? {
        DeviceAddress::Tcp(address) => Ok(address),
        _ => Err("the plant's line is tcp:HOST:PORT".into()),
    }
}

/// Serves the terrain until Ctrl-C, the end of the time or of the script.
///
/// # Errors
/// What is wrong with the file, or no device there at the beginning. A device
/// that goes later is waited for.
pub fn run(args: &Args) -> Result<(), Failure> {
    let outputs = Vec::from_iter(args.record.as_deref());
    let mut inputs = args.terrain.inputs();
    inputs.extend(args.commands.file());
    keep_apart(&outputs, &inputs).or_hint(OTHER_FILE)?;
    left_behind::tell(args.record.as_deref());
    let viewer = args.viewing.program()?;
    let raster = args.terrain.open()?;
    let asked = args.placing.of(&args.rendering, &raster)?;
    let (law, rule) = (args.rendering.law()?, args.rendering.rule());
    // What cannot be recorded is known before anything is armed.
    let recording = recording(args)?;
    let commands = args.commands.open()?;
    interrupt::listen();
    // The virtual Phantom is a Premium 1.5.
    let (mut calibration, mut met) = (Calibration::PREMIUM_1_5, Ok(()));
    if !is_scripted(args) {
        met = calibration_of(&args.device).map(|of_device| calibration = of_device);
    }
    let view = asked.view(&calibration)?;
    let terrain = view.terrain(asked.grid)?;
    let tour = match is_scripted(args) {
        true => Some(PlacedTerrain::in_view(&terrain, view.home_mm, law, rule)?),
        false => None,
    };
    let title = args.terrain.name();
    // The coarse levels are read before anything is armed.
    let shown = viewer.map(|program| ToBeShown::new(program, &terrain, &view, &title));
    let placed = Placed {
        terrain: &terrain,
        view,
        scene: view.scene(&terrain, law, rule)?,
        arm: calibration,
        tour,
    };
    raster.check_came()?;
    let served = (recording, commands);
    let (Some(address), Some(tour)) = (&args.plant, &placed.tour) else {
        return serve(args, &placed, met, served, shown);
    };
    let arm = tour.held_phantom();
    let done = OnceLock::new();
    std::thread::scope(|scope| {
        scope.spawn(|| move_arm(address, arm, &done));
        let ended = serve(args, &placed, met, served, shown);
        // The arm is still there while the board lets its force go out.
        let _ = done.set(Instant::now() + LINGER);
        ended
    })
}

/// A terrain as it lies under the arm, and how an arm that is virtual moves over it.
struct Placed<'t> {
    terrain: &'t Terrain<'t>,
    view: View,
    scene: Scene,
    /// Of the arm that feels it.
    arm: Calibration,
    tour: Option<PlacedTerrain<'t>>,
}

/// Moves the virtual Phantom at a board's plant line, which may come and go;
/// until the line ends after the session has, or the time that `done` names.
fn move_arm(address: &str, mut arm: HeldPhantom, done: &OnceLock<Instant>) {
    let stop = || done.get().is_some_and(|by| Instant::now() >= *by);
    while done.get().is_none() {
        let ended = Tcp::connect(address)
            .and_then(|mut line| serve_plant(&mut line, &mut arm, &stop).map_err(LinkError::Gone));
        if let Err(why) = ended {
            tracing::info!("the plant's line at {address}: {why:?}");
            std::thread::sleep(RETRY);
        }
    }
}

/// Whether the arm is virtual, held by a hand that follows a script.
fn is_scripted(args: &Args) -> bool {
    args.plant.is_some() || args.device == DeviceAddress::Native
}

/// `met`: whether the device has told its calibration. If not, it is said goodbye to: the
/// arm may be armed from before.
fn serve(
    args: &Args,
    placed: &Placed<'_>,
    met: Result<(), Failure>,
    (recording, commands): (Option<Recording>, CommandQueue),
    shown: Option<ToBeShown<'_>>,
) -> Result<(), Failure> {
    let service = service(args, placed);
    interrupt::board_may_be_armed(true);
    let opened = service.open(|line| met.and_then(|()| fit_to_serve(args, line)));
    // Where it could not be opened, what has to be told is told.
    let (served, device) = opened.inspect_err(|_| interrupt::board_may_be_armed(false))?;
    let how = session_summary::in_words(placed.terrain);
    say(format!("terrain        {}: {how}", args.terrain.name()));
    show(placing::told(&placed.view, placed.terrain));
    say(format!(
        "device         {}",
        session_summary::device(&device)
    ));
    if let Some(line) = told_of_last_end(&device) {
        tell(line);
    }
    limits::warn(&placed.scene.law, device.tick_hz);
    let recording = described(recording, args, placed, &device);
    let laid = Laid {
        view: placed.view,
        law: placed.scene.law,
    };
    let mut control = ViewControl::new(
        (placed.terrain, laid, placed.scene.rule),
        (&placed.arm, args.rendering.level),
        commands,
    );
    // Before anybody else asks the keyboard for anything.
    if let Some(line) = control.listen(&args.commands) {
        tell(line);
    }
    // A viewer that does not start ends nothing.
    let shown = shown.and_then(|shown| shown.start(&device, tell));
    let mut watch = Watch::new(args, placed, &device, recording, control).shown(shown);
    let end = served.serve(&mut watch);
    // What was recorded is kept, however it ended, and before anything else is done.
    let log = watch.finish();
    let kept = log.kept.or_hint(OTHER_FILE);
    let ended = told(end.why, end.disarmed);
    interrupt::board_may_be_armed(false);
    let summary = SessionSummary {
        ticks: log.ticks,
        device,
        figures: log.figures,
        tally: end.tally,
    };
    show(summary.text());
    if let (Ok(()), Some(path)) = (&kept, &args.record) {
        say(format!("recording      {}", path.display()));
    }
    if let Some(shown) = log.shown {
        shown.end(say);
    }
    ended.and(kept)
}

/// Whether a device may be served: a real board was brought up, and one that is given a
/// virtual arm drives no real one.
fn fit_to_serve(args: &Args, line: &mut dyn Transport) -> Result<(), Failure> {
    match (&args.plant, &args.device) {
        (_, DeviceAddress::Native) => Ok(()),
        // Whatever else is said: its zero pose would be taken for known, and its lines for
        // an arm that hurts nobody.
        (Some(_), _) => drives_no_arm(line),
        (None, _) if args.unchecked => Ok(()),
        (None, _) => brought_up(line),
    }
}

/// What is served, and to which device.
fn service<'s, 't: 's>(args: &'s Args, placed: &'s Placed<'t>) -> Service<'s, 't> {
    Service {
        terrain: placed.terrain,
        scene: placed.scene,
        // A virtual arm was switched on in its zero pose; where a real one was,
        // its user has to say.
        arming: match is_scripted(args) {
            true => Arming::VIRTUAL,
            false => Arming::default(),
        },
        patience: Patience {
            silence_s: args.silence_s,
            ..Patience::REAL_TIME
        },
        connect: Box::new(move || connect(args, placed)),
        device: args.device.to_string(),
        retry: RETRY,
        goes_on: &|| !interrupt::requested(),
        tell: &|line| tell(line),
    }
}

/// How it ended, as a failure; where two things went wrong, the first is told here.
fn told(why: Result<(), LinkError>, disarmed: Result<(), LinkError>) -> Result<(), Failure> {
    match (why, disarmed) {
        (Err(error), Err(not_confirmed)) => {
            tell(not_confirmed);
            Err(error.into())
        }
        (why, disarmed) => Ok(why.and(disarmed)?),
    }
}

fn recording(args: &Args) -> Result<Option<Recording>, Failure> {
    let [state, mode, limits, view] = LoopColumns::COLUMNS;
    let [tick, work, cost, late] = ["tick", "work", "cost", "late"].map(Column::Count);
    let columns = [state, tick, work, cost, late, mode, limits, view];
    let recording = args.record.as_deref().map(|path| {
        let output = Output::create(path)?;
        Recording::new(output, &columns)
    });
    recording.transpose().or_hint(OTHER_FILE)
}

/// The recording, with the settings in which the device feels the terrain.
fn described(
    mut recording: Option<Recording>,
    args: &Args,
    placed: &Placed<'_>,
    device: &DeviceHello,
) -> Option<Recording> {
    if let Some(recording) = &mut recording {
        let (file, device) = (without_key(&args.terrain.file), Device::of(device));
        let law = (placed.scene.law, placed.scene.rule);
        let home_mm = Some(placed.view.home_mm);
        let settings = Settings::new(&file, placed.terrain, law, home_mm, device);
        recording.describe(&settings);
    }
    recording
}

fn connect<'t>(args: &Args, placed: &Placed<'t>) -> Result<Box<dyn Transport + 't>, LinkError> {
    let native = || {
        let arm = placed.tour.as_ref().map(PlacedTerrain::held_phantom);
        let device = Native::new(HostClock::default(), arm.map(|arm| Box::new(arm) as _));
        match args.viewing.view {
            true => device.in_real_time(),
            false => device,
        }
    };
    args.device.connect(native)
}
