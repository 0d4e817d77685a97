//! `hapterra bench`: run time against error, beside honest opponents.

#![forbid(unsafe_code)]

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, ValueHint};
use hapterra::cli::Failure;
use hapterra::raster::{OpenOptions, Raster};
use hapterra_bench::compare::{Effort, Row, compare};
use hapterra_bench::effects::Measured;
use hapterra_bench::grid::Grid;
use hapterra_bench::{continuity, effects, report, solver, state};
use indicatif::ProgressBar;

/// Measure the contact beside other ways to render a height field: time for a
/// tick, error against the exact closest point, largest jump of the force
#[derive(Debug, Parser)]
#[command(name = "hapterra-bench", bin_name = "hapterra bench", version)]
struct Args {
    /// Terrain files to measure on
    #[arg(value_hint = ValueHint::FilePath)]
    files: Vec<PathBuf>,

    /// Measure on the files only, not on the made terrains of the paper's sizes and 4096 × 4096
    #[arg(long, requires = "files")]
    files_only: bool,

    /// Heights of the files times this; 10 is the paper's scale for 10 m posts
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    steepness: f64,

    /// Fewer ticks and rounds: a look, not figures to quote
    #[arg(long)]
    quick: bool,

    /// Only how much the force changes from tick to tick; nothing is timed
    #[arg(long, conflicts_with_all = ["files", "quick", "png"])]
    continuity: bool,

    /// Only what friction, shading, texture, damping and the passivity controller cost, and how
    /// exact they are; --csv then has these figures, which it has not otherwise
    #[arg(long, conflicts_with_all = ["continuity", "png"])]
    effects: bool,

    /// Write all figures to this CSV file
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    csv: Option<PathBuf>,

    /// Draw run time against error to this PNG file
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    png: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            failure.report();
            ExitCode::FAILURE
        }
    }
}

fn run(args: &Args) -> Result<(), Failure> {
    if args.continuity {
        let changes = continuity::measure();
        print!("{}", report::continuity(&changes));
        return write(args, &[], &changes);
    }
    if cfg!(debug_assertions) {
        eprintln!("note: built without full optimisation; for figures: cargo build --release");
    }
    let effort = if args.quick {
        Effort::QUICK
    } else {
        Effort::FULL
    };
    let files = read(args)?;
    let effects = of_effects(args, &files, effort)?;
    print!("{}", report::effects(&effects));
    if args.effects {
        return write_effects(args, &effects);
    }
    let mut rows = Vec::new();
    for grid in files {
        measure(&grid, effort, &mut rows);
    }
    if !args.files_only {
        for make in made() {
            measure(&make(), effort, &mut rows);
        }
    }
    show(&solver::patches(effort), &mut rows);
    show(&solver::roots(effort), &mut rows);
    let changes = continuity::measure();
    print!("{}", report::continuity(&changes));
    print!("{}", report::summary(&rows));
    write(args, &rows, &changes)
}

/// Opens every file before anything is measured.
fn read(args: &Args) -> Result<Vec<Grid>, Failure> {
    let open = |file: &PathBuf| {
        let raster = Raster::open(file, &OpenOptions::default()).map_err(|error| {
            Failure::new(error).hint(format!("see: hapterra info {}", file.display()))
        })?;
        Ok(Grid::from_raster(file, &raster, args.steepness))
    };
    args.files.iter().map(open).collect()
}

/// The effects on the files, and on one made terrain. A file that is too small or too high for them
/// has its other figures all the same.
fn of_effects(args: &Args, files: &[Grid], effort: Effort) -> Result<Measured, Failure> {
    let made = (!args.files_only).then(state::terrain);
    let mut all = Measured::default();
    for grid in files.iter().chain(&made) {
        // Else with the other figures.
        if args.effects {
            remark(grid);
        }
        let waiting = spinner();
        waiting.set_message(format!("{}: effects", grid.name));
        let measured = effects::measure(grid, effort);
        waiting.finish_and_clear();
        match measured {
            Ok(measured) => all.append(measured),
            Err(why) => eprintln!("warning: no effects on {}: {why}", grid.name),
        }
    }
    match args.effects && all.errors.is_empty() {
        true => {
            let hint = "name a file that is larger, or lower (--steepness)";
            Err(Failure::new("no terrain has room for the effects").hint(hint))
        }
        false => Ok(all),
    }
}

fn spinner() -> ProgressBar {
    let waiting = ProgressBar::new_spinner();
    waiting.enable_steady_tick(std::time::Duration::from_millis(500));
    waiting
}

/// The paper's three sizes, one of them ten times as steep (the paper's own
/// scale: 10 m posts, 1 m units), and one larger.
fn made() -> [fn() -> Grid; 5] {
    [
        || Grid::fractal("525 × 525", [525, 525], 1, 1.0),
        || Grid::fractal("1250 × 1250", [1250, 1250], 2, 1.0),
        || Grid::fractal("1231 × 1231", [1231, 1231], 3, 1.0),
        || Grid::fractal("1250 × 1250, steep × 10", [1250, 1250], 2, 10.0),
        || Grid::fractal("4096 × 4096", [4096, 4096], 4, 1.0),
    ]
}

fn remark(grid: &Grid) {
    for remark in &grid.remarks {
        println!("{}: {remark}", grid.name);
    }
}

fn measure(grid: &Grid, effort: Effort, rows: &mut Vec<Row>) {
    remark(grid);
    let waiting = spinner();
    let measured = compare(grid, effort, |path| {
        waiting.set_message(format!("{}: {path}", grid.name));
    });
    waiting.finish_and_clear();
    show(&measured, rows);
}

fn show(measured: &[Row], rows: &mut Vec<Row>) {
    print!("{}", report::table(measured));
    rows.extend_from_slice(measured);
}

const HINT: &str = "check that the folder exists and that you may write there";

fn write_effects(args: &Args, measured: &Measured) -> Result<(), Failure> {
    let Some(file) = &args.csv else {
        return Ok(());
    };
    report::write_effects(file, measured).map_err(|error| {
        let text = format!("cannot write {}: {error}", file.display());
        Failure::new(text).hint(HINT)
    })?;
    println!("wrote {}", file.display());
    Ok(())
}

fn write(args: &Args, rows: &[Row], changes: &[continuity::Row]) -> Result<(), Failure> {
    if let Some(file) = &args.csv {
        report::write_csv(file, rows, changes).map_err(|error| {
            let text = format!("cannot write {}: {error}", file.display());
            Failure::new(text).hint(HINT)
        })?;
        println!("wrote {}", file.display());
    }
    if let Some(file) = &args.png {
        report::draw(rows, file).map_err(|error| Failure::new(error).hint(HINT))?;
        println!("wrote {}", file.display());
    }
    Ok(())
}
