//! `hapterra view`: shows a recording in the viewer again.

use std::path::{Path, PathBuf};

use clap::ValueHint;

use super::demo::{OWN_TERRAIN, own_terrain};
use super::failure::{Failure, OrHint};
use super::options::recording::check_file;
use super::options::rendering::Rendering;
use super::options::terrain_file::{ReadingOptions, TerrainFile};
use super::terminal::interrupt;
use super::viewing;
use crate::output::check_distinct;
use crate::replay::{RecordingRows, ReplayError, Settings, terrain_of};
use crate::terrain::Terrain;
use crate::view_feed::{Picture, Program, ViewFeed};
use heightfield::{Raster, files_read_with};

/// Rows between two checks that the viewer still reads.
const CHECK_INTERVAL_ROWS: u64 = 10_000;

/// Arguments of `hapterra view`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Recording of `run`, `demo` or `replay`, CSV or Parquet, or a trajectory
    #[arg(value_hint = ValueHint::FilePath)]
    pub recording: PathBuf,

    /// The terrain: a file, a folder or a quoted pattern [default: the one that the recording names]
    #[arg(value_hint = ValueHint::FilePath)]
    pub terrain: Option<PathBuf>,

    /// Properties that the terrain file does not state.
    #[command(flatten)]
    pub reading: ReadingOptions,

    /// Show a recording's path also on another terrain
    #[arg(long)]
    pub ignore_settings: bool,

    /// Also write a recording for rerun's own viewer
    #[arg(short, long, value_name = "OUT.rrd", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,

    /// Rendering of the terrain, if the recording does not state it.
    #[command(flatten)]
    pub rendering: Rendering,
}

/// Shows a recording until the viewer is closed.
///
/// # Errors
/// The recording or the terrain fails, or there is no viewer.
pub fn run(args: &Args) -> Result<(), Failure> {
    args.rendering.check_level_without_hand()?;
    check_file(&args.recording)?;
    let rows = RecordingRows::open(&args.recording).map_err(ReplayError::from)?;
    let recorded = rows.settings().filter(|_| !args.ignore_settings).cloned();
    let path = path_of(args, recorded.as_ref())?;
    let mut inputs = files_read_with(&path);
    inputs.push(args.recording.clone());
    let outputs = Vec::from_iter(args.out.as_deref());
    check_distinct(&outputs, &inputs).or_hint("name another file with -o")?;
    let program = Program::find()?;
    let file = TerrainFile {
        file: path.clone(),
        reading: args.reading.clone(),
    };
    let raster = match path.to_str() {
        Some(OWN_TERRAIN) => own_terrain()?,
        _ => file.open()?,
    };
    let terrain = terrain(args, recorded.as_ref(), &raster)?;
    if let Some(recorded) = &recorded {
        recorded.check_terrain(&path.display().to_string(), &terrain)?;
    }
    let picture = Picture {
        terrain: &terrain,
        title: &file.name(),
        facts: facts(&args.recording, recorded.as_ref()),
        home_mm: recorded.as_ref().and_then(|it| it.rendered.home_mm),
        laid_mm: None,
        is_live: false,
    };
    let program = program.writing(args.out.as_deref());
    interrupt::listen();
    let feed = ViewFeed::start(&program, picture.prepare(), None)?;
    let recorded = recorded.as_ref();
    let cut = show(feed, rows, (&terrain, &file.name(), recorded))?;
    if cut {
        let path = args.recording.display();
        eprintln!("{path}: its last row is cut in the middle, and left out");
    }
    Ok(())
}

/// Returns the terrain's file: from the command line, else from the recording.
fn path_of(args: &Args, recorded: Option<&Settings>) -> Result<PathBuf, Failure> {
    let named = |it: &Settings| PathBuf::from(&it.terrain.file);
    let path = args.terrain.clone().or_else(|| recorded.map(named));
    path.ok_or_else(|| format!("{} does not name its terrain", args.recording.display()))
        .or_hint("name it: hapterra view RECORDING TERRAIN")
}

/// Shows the rows until their end, an interrupt, or the end of the viewer. Returns true if the
/// recording was cut.
fn show<'t>(
    mut feed: ViewFeed<'t>,
    mut rows: RecordingRows,
    (terrain, title, recorded): (&Terrain<'t>, &str, Option<&Settings>),
) -> Result<bool, Failure> {
    let mut shown = 0;
    for (count, row) in (1..).zip(&mut rows) {
        let row = row.map_err(ReplayError::from)?;
        if row.view != shown
            && let Some(recorded) = recorded
        {
            shown = row.view;
            change_placement(&mut feed, terrain, title, (shown, recorded))?;
        }
        feed.keep_detailed(&row.record);
        feed.row(&row.record, None);
        let is_read = count % CHECK_INTERVAL_ROWS != 0 || feed.wait_for_room();
        if !is_read || interrupt::requested() {
            break;
        }
    }
    viewing::end(feed, |line| eprintln!("{line}"));
    Ok(rows.was_cut())
}

fn change_placement<'t>(
    feed: &mut ViewFeed<'t>,
    first: &Terrain<'t>,
    title: &str,
    (number, recorded): (u32, &Settings),
) -> Result<(), Failure> {
    let view = recorded.views.iter().find(|view| view.number == number);
    let terrain = match view {
        Some(view) => terrain_of(first, view)?,
        None => first.clone(),
    };
    feed.change_placement(Picture {
        terrain: &terrain,
        title,
        facts: vec![],
        home_mm: view.map(|view| view.home_mm).or(recorded.rendered.home_mm),
        laid_mm: None,
        is_live: false,
    });
    Ok(())
}

fn terrain<'r>(
    args: &Args,
    recorded: Option<&Settings>,
    raster: &'r Raster,
) -> Result<Terrain<'r>, Failure> {
    let (rendering, cells) = (&args.rendering, args.reading.cells());
    let measured_at = recorded.and_then(|it| it.rendered.measured_at);
    let grid = rendering.grid((raster, cells), measured_at);
    let scale = rendering.scale(&grid)?;
    rendering.terrain(grid, scale)
}

fn facts(path: &Path, recorded: Option<&Settings>) -> Vec<(String, String)> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let mut facts = vec![("recording".to_owned(), name.into_owned())];
    if let Some(recorded) = recorded {
        facts.push(("rendered by".to_owned(), recorded.device.board.clone()));
    }
    facts
}
