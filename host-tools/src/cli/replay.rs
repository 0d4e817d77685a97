//! `hapterra replay`: what a trajectory feels, tick by tick.

use std::path::PathBuf;
use std::time::Instant;

use clap::ValueHint;
use indicatif::{ProgressBar, ProgressStyle};

use super::emulation::{Emulation, explain_link};
use super::feel::Feel;
use super::input::Input;
use super::{Failure, interrupt};
use crate::link::{Patience, Transport};
use crate::replay::{ReplayError, Replayer, Summary, on_native, replay_file};
use crate::terrain::Terrain;

/// Arguments of `hapterra replay`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The terrain.
    #[command(flatten)]
    pub input: Input,

    /// Trajectory of the hand: CSV with the header t_s,x_mm,y_mm,z_mm
    ///
    /// Millimetres as the hand feels them; x east, y north, z up, origin at
    /// the south-west sample at height zero. Further columns are ignored, so a
    /// recording can be replayed.
    #[arg(value_hint = ValueHint::FilePath)]
    pub trajectory: PathBuf,

    /// File to write what was felt to
    #[arg(short, long, value_hint = ValueHint::FilePath)]
    pub output: PathBuf,

    /// Where the loop runs
    #[arg(long, value_enum, default_value_t)]
    pub on: On,

    /// How it feels.
    #[command(flatten)]
    pub feel: Feel,

    /// The emulated board.
    #[command(flatten)]
    pub emulation: Emulation,
}

/// Where the loop runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum On {
    /// In this program: the application compiled for this machine
    #[default]
    Native,
    /// On the emulated Cortex-M4F board
    Emulated,
}

/// Replays the trajectory.
///
/// # Errors
/// What is wrong with the terrain, the trajectory, the device or the output.
pub fn run(args: &Args) -> Result<(), Failure> {
    let raster = args.input.open()?;
    let scale = args.feel.scale(&raster)?;
    let terrain = args.feel.terrain(&raster, scale)?;
    let began = Instant::now();
    let summary = match args.on {
        On::Native => native(args, &terrain),
        On::Emulated => emulated(args, &terrain),
    }?;
    let seconds = began.elapsed().as_secs_f64();
    eprintln!(
        "{} rows, {} in contact, {:.0} rows a second: {}",
        summary.rows,
        summary.in_contact,
        summary.rows as f64 / seconds.max(1e-9),
        args.output.display()
    );
    Ok(())
}

fn native(args: &Args, terrain: &Terrain<'_>) -> Result<Summary, Failure> {
    let mut replayer =
        on_native(terrain, args.feel.law()?, args.feel.rule()).map_err(explain_link)?;
    felt(args, &mut replayer)
}

fn emulated(args: &Args, terrain: &Terrain<'_>) -> Result<Summary, Failure> {
    let law = args.feel.law()?;
    let (emulator, lines) = args.emulation.start()?;
    // The other line stays open and silent: points take the arm's place.
    let _plant = lines.plant;
    let link: Box<dyn Transport> = Box::new(lines.link);
    let mut replayer = Replayer::open(terrain, law, args.feel.rule(), link, Patience::EMULATED)
        .map_err(explain_link)?;
    let summary = felt(args, &mut replayer)?;
    replayer.say_goodbye().map_err(explain_link)?;
    let status = emulator.finish().map_err(Failure::new)?;
    tracing::info!("the emulated board ended: {status}");
    Ok(summary)
}

fn felt(args: &Args, replayer: &mut Replayer<'_>) -> Result<Summary, Failure> {
    let progress = ProgressBar::new_spinner().with_style(style());
    interrupt::listen();
    let summary = replay_file(replayer, &args.trajectory, &args.output, &mut |rows| {
        progress.set_position(rows);
        !interrupt::requested()
    });
    progress.finish_and_clear();
    summary.map_err(explain)
}

fn style() -> ProgressStyle {
    // The template is constant; the default style is no worse a fallback.
    ProgressStyle::with_template("{spinner} {human_pos} rows, {per_sec}")
        .unwrap_or_else(|_| ProgressStyle::default_spinner())
}

fn explain(error: ReplayError) -> Failure {
    let hint = match error {
        ReplayError::Link(error) => return explain_link(error),
        ReplayError::Trajectory(_) => {
            "a trajectory is CSV: the header t_s,x_mm,y_mm,z_mm, then four numbers a line"
        }
        ReplayError::Output(_) => "name a file in a folder that you may write to with --output",
        ReplayError::Interrupted => "nothing was written",
    };
    Failure::new(error).hint(hint)
}
