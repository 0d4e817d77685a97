//! `hapterra demo`: the whole thing, from a file to a picture of what a hand
//! felt.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::ValueHint;

use super::emulation::{Emulation, explain_link};
use super::feel::Feel;
use super::input::{Input, Reading};
use super::report::{self, Report};
use super::{Failure, interrupt};
use crate::link::{
    Arming, Emulator, Event, HostClock, LinkError, Native, Patience, Session, Transport,
    serve_plant,
};
use crate::live::{Figures, Stage, StageError, suggest};
use crate::output::Output;
use crate::phantom::Rig;
use crate::raster::Raster;
use crate::replay::{Record, Recording, state_name};
use crate::synth::{Kind, Synth};
use crate::terrain::Scale;

/// Samples along the side of the terrain that the demo makes itself.
const OWN_SIZE: u32 = 1024;
/// Times that heights are halved until the arm reaches the terrain.
const HALVINGS: u32 = 12;

/// Arguments of `hapterra demo`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Terrain file; without one the demo makes a terrain
    #[arg(value_hint = ValueHint::FilePath)]
    pub file: Option<PathBuf>,

    /// What the file does not say itself.
    #[command(flatten)]
    pub reading: Reading,

    /// Where the loop runs
    #[arg(long, value_enum, default_value_t)]
    pub device: Where,

    /// Folder for the picture and the recording
    #[arg(long, value_name = "DIR", default_value = "demo", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,

    /// End after this many seconds of the device's time
    #[arg(long, value_name = "S")]
    pub seconds: Option<f64>,

    /// How it feels. Without a stated height the demo chooses one that suits
    /// the hand, and says which.
    #[command(flatten)]
    pub feel: Feel,

    /// The emulated board.
    #[command(flatten)]
    pub emulation: Emulation,
}

/// Where the loop runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Where {
    /// On the emulated Cortex-M4F board
    #[default]
    Emulated,
    /// In this program: the application compiled for this machine
    Native,
}

/// Runs the demonstration.
///
/// # Errors
/// What is wrong with the file, the device or the output folder.
pub fn run(args: &Args) -> Result<(), Failure> {
    let (raster, name) = terrain_of(args)?;
    let law = args.feel.law()?;
    let mut scale = scale_of(args, &raster)?;
    for _ in 0..HALVINGS {
        let terrain = args.feel.terrain(&raster, scale)?;
        match Stage::set(&terrain, law, args.feel.rule()) {
            Ok(stage) => return show(args, &stage, &name),
            // Heights that nobody asked for may as well be lower.
            Err(StageError::OutOfReach(_)) if args.feel.height_mm_per_unit.is_none() => {
                let lower = 0.5 * scale.height_mm_per_unit();
                scale = Scale::new(scale.cell_mm(), lower).map_err(Failure::new)?;
            }
            Err(error) => return Err(too_tall(error)),
        }
    }
    Err(too_tall("the terrain is too tall for the arm"))
}

fn too_tall(error: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Failure {
    Failure::new(error).hint("choose a smaller --height-mm-per-unit or --cell-mm")
}

fn terrain_of(args: &Args) -> Result<(Raster, String), Failure> {
    if let Some(file) = &args.file {
        let input = Input {
            file: file.clone(),
            reading: args.reading.clone(),
        };
        return Ok((input.open()?, input.name()));
    }
    let amplitude = Kind::Fractal.usual_amplitude_cells();
    let raster = Synth::new(Kind::Fractal, 1, amplitude).raster(OWN_SIZE, OWN_SIZE);
    Ok((raster.map_err(Failure::new)?, "fractal".into()))
}

/// The scale as stated, or one that suits the hand.
fn scale_of(args: &Args, raster: &Raster) -> Result<Scale, Failure> {
    if args.feel.height_mm_per_unit.is_some() {
        return args.feel.scale(raster);
    }
    suggest(raster, args.feel.cell_mm)
        .map(|suggestion| suggestion.scale)
        .map_err(|error| Failure::new(error).hint("choose another --cell-mm"))
}

/// Runs the tour and shows what was felt.
fn show(args: &Args, stage: &Stage<'_>, name: &str) -> Result<(), Failure> {
    std::fs::create_dir_all(&args.out).map_err(|error| {
        Failure::new(format!("cannot make {}: {error}", args.out.display()))
            .hint("name another folder with --out")
    })?;
    let how = report::how(stage.terrain());
    println!("terrain        {name}: {how}");
    let rig = stage.rig().map_err(Failure::new)?;
    let stop = args.seconds.unwrap_or(f64::MAX).min(stage.duration_s());
    interrupt::listen();
    let felt = match args.device {
        Where::Native => native(stage, rig, stop),
        Where::Emulated => emulated(args, stage, rig, stop),
    }?;
    let stem = Path::new(name)
        .file_stem()
        .map_or(name.into(), |s| s.to_string_lossy());
    let recording = args.out.join(format!("{stem}.csv"));
    let picture = args.out.join(format!("{stem}.png"));
    write(&felt, &recording)?;
    felt.report.print();
    report::draw(
        &picture,
        stage.terrain(),
        (name, &how),
        &felt.records,
        &felt.report,
    )?;
    println!("recording      {}", recording.display());
    println!("picture        {}", picture.display());
    match felt.report.figures.fault {
        None => Ok(()),
        Some(fault) => Err(Failure::new(format!(
            "the device latched fault {} ({fault:?})",
            fault.number()
        ))
        .hint("this should not happen with a virtual arm: please report it")),
    }
}

/// All that was felt.
struct Felt {
    records: Vec<Record>,
    states: Vec<&'static str>,
    report: Report,
}

fn native(stage: &Stage<'_>, rig: Rig, stop_s: f64) -> Result<Felt, Failure> {
    let device = Native::new(HostClock::default(), Some(Box::new(rig)));
    feel(stage, Box::new(device), Patience::REAL_TIME, stop_s).map_err(explain_link)
}

/// The board in an emulator, the arm in a thread of its own.
fn emulated(args: &Args, stage: &Stage<'_>, mut rig: Rig, stop_s: f64) -> Result<Felt, Failure> {
    let (emulator, lines) = args.emulation.start()?;
    let (link, mut plant) = (lines.link, lines.plant);
    let done = std::sync::atomic::AtomicBool::new(false);
    let stopped = || done.load(std::sync::atomic::Ordering::Relaxed);
    let felt = std::thread::scope(|scope| {
        scope.spawn(|| {
            if let Err(error) = serve_plant(&mut plant, &mut rig, &stopped) {
                // At the end the board goes first.
                tracing::debug!("the plant's line ended: {error}");
            }
        });
        let felt = feel(stage, Box::new(link), Patience::EMULATED, stop_s);
        let stop = || done.store(true, std::sync::atomic::Ordering::Relaxed);
        if let Err(error) = felt {
            stop();
            return Err(explain_emulated(error, emulator));
        }
        // The arm is still there while the board lets its force go out.
        let status = emulator.finish();
        stop();
        let status = status.map_err(Failure::new)?;
        if !status.success() {
            return Err(
                Failure::new(format!("the emulated board ended with {status}"))
                    .hint("please report it with the file"),
            );
        }
        felt.map_err(explain_link)
    })?;
    Ok(felt)
}

/// A link that broke because the board ended is the board's failure.
fn explain_emulated(error: LinkError, emulator: Emulator) -> Failure {
    match emulator.failure() {
        Some(said) => Failure::new(format!("the emulated board failed: {said}"))
            .hint("please report it with the file"),
        None => explain_link(error),
    }
}

/// Serves the terrain until the tour has come to its end.
fn feel(
    stage: &Stage<'_>,
    transport: Box<dyn Transport + '_>,
    patience: Patience,
    stop_s: f64,
) -> Result<Felt, LinkError> {
    let terrain = stage.terrain();
    let (mut session, device) =
        Session::open_arming(terrain, stage.scene(), Arming::VIRTUAL, transport, patience)?;
    println!("device         {}", report::device(&device));
    let stop_tick = (stop_s * f64::from(device.tick_hz)).ceil() as u32;
    let progress = report::progress(u64::from(stop_tick));
    let (mut records, mut states) = (Vec::new(), Vec::new());
    let mut figures = Figures::default();
    let mut tick = 0;
    while tick < stop_tick && !interrupt::requested() {
        session.poll(Duration::from_millis(100), &mut |event| {
            let Event::Sample(sample) = event else {
                return;
            };
            let record = Record::of_tick(sample, device.tick_hz, terrain.scale());
            figures.take(sample, &record, terrain);
            tick = sample.tick;
            records.push(record);
            states.push(state_name(sample.state));
        })?;
        progress.set_position(u64::from(tick));
    }
    progress.finish_and_clear();
    let report = Report {
        ticks: u64::from(tick),
        device,
        figures,
        tally: session.tally().clone(),
    };
    session.say_goodbye()?;
    // Lets a device in memory or behind a slow line hear it.
    let _ = session.poll(Duration::from_millis(10), &mut |_| {});
    Ok(Felt {
        records,
        states,
        report,
    })
}

fn write(felt: &Felt, path: &Path) -> Result<(), Failure> {
    let write = || {
        let mut recording = Recording::new(Output::create(path)?, &["state"]);
        for (record, state) in felt.records.iter().zip(&felt.states) {
            recording.write(record, &[state])?;
        }
        recording.finish()
    };
    write().map_err(|error| Failure::new(error).hint("name another folder with --out"))
}
