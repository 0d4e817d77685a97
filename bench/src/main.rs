//! `hapterra bench`: run time against error, beside honest opponents.

#![forbid(unsafe_code)]

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, ValueHint};
use hapterra::cli::Failure;
use hapterra_bench::compare::{Effort, Row, compare};
use hapterra_bench::effects::Measured;
use hapterra_bench::grid::Grid;
use hapterra_bench::streaming::{self, Plan};
use hapterra_bench::{continuity, effects, report, solver, state};
use heightfield::{OpenOptions, Raster};
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

    /// Fewer ticks and rounds, and files are read in no time: a look, not figures to quote
    #[arg(long)]
    quick: bool,

    /// Only how much the force changes from tick to tick; nothing is timed
    #[arg(long, conflicts_with_all = ["files", "quick", "png"])]
    continuity: bool,

    /// Only what friction, shading, texture, damping and the passivity controller cost, and how
    /// exact they are; --csv then has these figures, which it has not otherwise
    #[arg(long, conflicts_with_all = ["continuity", "png"])]
    effects: bool,

    /// Only what opening, memory, tiles and the speed of the hand cost against the size of a terrain and
    /// the latency of its server, in made terrains of 10^6 to 10^10 samples and in the files
    #[arg(long, conflicts_with_all = ["continuity", "effects", "steepness"])]
    streaming: bool,

    /// With --streaming: the made terrains' sizes as powers of ten, from 6 to 10
    #[arg(long, value_name = "LIST", requires = "streaming", value_delimiter = ',',
          default_values_t = [6, 7, 8, 9, 10], value_parser = clap::value_parser!(u32).range(6..=10))]
    sizes: Vec<u32>,

    /// With --streaming: what a web server waits before it answers, ms; 0 is a file on disk, others need
    /// a build with the feature remote. Default: 0,20,50,100,200, or 0 without that feature
    #[arg(long, value_name = "LIST", requires = "streaming", value_delimiter = ',',
          value_parser = clap::value_parser!(u32).range(0..=10_000))]
    latencies: Vec<u32>,

    /// What a process of --streaming measures
    #[arg(long, hide = true, requires = "streaming")]
    streaming_case: Option<String>,

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
    if let Some(case) = &args.streaming_case {
        return streaming::measure_case(case).map_err(Failure::new);
    }
    if args.streaming {
        optimised();
        return stream(args);
    }
    if args.continuity {
        let changes = continuity::measure();
        print!("{}", report::continuity(&changes));
        return write(args, &[], &changes);
    }
    optimised();
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

fn optimised() {
    if cfg!(debug_assertions) {
        eprintln!("note: built without full optimisation; for figures: cargo build --release");
    }
}

/// Terrain that is streamed: a line for each row as soon as it is measured.
fn stream(args: &Args) -> Result<(), Failure> {
    let plan = plan(args)?;
    let waiting = spinner();
    let mut rows: Vec<streaming::Row> = vec![];
    waiting.suspend(|| println!("{}", report::streaming_head()));
    let measured = streaming::measure(
        &plan,
        &args.files,
        &mut |what| waiting.set_message(what.to_owned()),
        &mut |why| waiting.suspend(|| eprintln!("warning: not measured: {why}")),
        &mut |row| {
            waiting.suspend(|| println!("{}", report::streaming(&row)));
            rows.push(row);
        },
    );
    waiting.finish_and_clear();
    let room = "free some room where temporary files are, or name another place in TMPDIR";
    measured.map_err(|why| Failure::new(why).hint(room))?;
    if rows.is_empty() {
        let hint = "the warnings above say why; name other files, or leave --files-only out";
        return Err(Failure::new("nothing was measured").hint(hint));
    }
    if let Some(file) = &args.csv {
        report::write_streaming(file, &rows).map_err(|error| {
            let text = format!("cannot write {}: {error}", file.display());
            Failure::new(text).hint(HINT)
        })?;
        println!("wrote {}", file.display());
    }
    if let Some(file) = &args.png {
        report::draw_streaming(&rows, file).map_err(|error| Failure::new(error).hint(HINT))?;
        println!("wrote {}", file.display());
    }
    Ok(())
}

fn plan(args: &Args) -> Result<Plan, Failure> {
    let has_server = cfg!(feature = "remote");
    let latencies_ms = match (args.latencies.is_empty(), has_server) {
        (false, _) => args.latencies.clone(),
        (true, true) => streaming::LATENCIES_MS.to_vec(),
        (true, false) => vec![0],
    };
    if !has_server && latencies_ms.iter().any(|latency| *latency > 0) {
        let text = "this build has no web server, so latencies cannot be measured";
        let hint = "cargo run --release -p hapterra-bench --features remote -- --streaming";
        return Err(Failure::new(text).hint(hint));
    }
    Ok(Plan {
        exponents: match args.files_only {
            true => vec![],
            false => args.sizes.clone(),
        },
        latencies_ms,
        halvings: if args.quick { 4 } else { 6 },
        stands_while_reading: args.quick,
    })
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
