//! `hapterra replay`: what a trajectory feels, tick by tick.

use std::path::PathBuf;
use std::time::Instant;

use clap::ValueHint;

use super::failure::Failure;
use super::options::emulated_board::{EmulatedBoard, RunsOn};
use super::options::rendering::Rendering;
use super::options::terrain_file::TerrainFile;
use super::terminal::{interrupt, left_behind, progress};
use crate::link::{Patience, Transport};
use crate::replay::{Replayer, Summary, on_native, replay_file};
use crate::terrain::Terrain;

/// Arguments of `hapterra replay`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The terrain file.
    #[command(flatten)]
    pub terrain: TerrainFile,

    /// Trajectory of the HIP: CSV with the header t_s,x_mm,y_mm,z_mm
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
    #[arg(long, value_enum, default_value = "native")]
    pub on: RunsOn,

    /// How the terrain feels.
    #[command(flatten)]
    pub rendering: Rendering,

    /// The emulated board.
    #[command(flatten)]
    pub board: EmulatedBoard,
}

/// Replays the trajectory.
///
/// # Errors
/// What is wrong with the terrain, the trajectory, the device or the output.
pub fn run(args: &Args) -> Result<(), Failure> {
    left_behind::tell([args.output.as_path()]);
    let raster = args.terrain.open()?;
    let grid = args.rendering.grid(&raster);
    let scale = args.rendering.scale(&grid)?;
    let terrain = args.rendering.terrain(grid, scale)?;
    let began = Instant::now();
    let summary = match args.on {
        RunsOn::Native => native(args, &terrain),
        RunsOn::Emulated => emulated(args, &terrain),
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
    let mut replayer = on_native(terrain, args.rendering.law()?, args.rendering.rule())?;
    replay(args, &mut replayer)
}

fn emulated(args: &Args, terrain: &Terrain<'_>) -> Result<Summary, Failure> {
    let (law, rule) = (args.rendering.law()?, args.rendering.rule());
    let (emulator, lines) = args.board.start()?;
    // The other line stays open and silent: points take the arm's place.
    let _plant = lines.plant;
    let link: Box<dyn Transport> = Box::new(lines.link);
    let mut replayer = Replayer::open(terrain, law, rule, link, Patience::EMULATED)?;
    let summary = replay(args, &mut replayer)?;
    replayer.say_goodbye()?;
    if let Err(why) = emulator.finish() {
        tracing::info!("the emulated board did not end well: {why}");
    }
    Ok(summary)
}

fn replay(args: &Args, replayer: &mut Replayer<'_>) -> Result<Summary, Failure> {
    let progress = progress::bar(None, "{spinner} {human_pos} rows, {per_sec}");
    interrupt::listen();
    let summary = replay_file(replayer, &args.trajectory, &args.output, &mut |rows| {
        progress.set_position(rows);
        !interrupt::requested()
    });
    progress.finish_and_clear();
    Ok(summary?)
}
