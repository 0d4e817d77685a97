//! `hapterra-lab contact`: run time against error, beside other methods.

use std::path::PathBuf;

use hapterra::cli::Failure;
use heightfield::{OpenOptions, Raster};

use super::files::{self, Files, spinner};
use crate::compare::{Effort, Row, compare};
use crate::effects::{self, Measured};
use crate::grid::Grid;
use crate::{continuity, report, solver, tick_states};

/// Arguments of `hapterra-lab contact`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Files to measure and to write.
    #[command(flatten)]
    pub files: Files,

    /// Factor for the heights of the files; 10 is the paper's scale for cells of 10 m
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    pub steepness: f64,

    /// Only the change of the force from tick to tick; nothing is timed
    #[arg(long, conflicts_with_all = ["files", "quick"])]
    pub continuity: bool,

    /// Only run time and error of friction, shading, texture, damping and passivity
    ///
    /// The file of -o then has these figures, which it does not have otherwise.
    #[arg(long, conflicts_with = "continuity")]
    pub effects: bool,
}

/// Measures and prints tables.
///
/// # Errors
/// A file that cannot be read or written, or a failed measurement.
pub fn run(args: &Args) -> Result<(), Failure> {
    let has_picture = !(args.continuity || args.effects);
    let (out, picture) = match has_picture {
        true => args.files.outputs.table_and_picture()?,
        false => (args.files.outputs.table_only()?, None),
    };
    if args.continuity {
        let changes = continuity::measure();
        print!("{}", report::continuity(&changes));
        return files::write(out, |file| report::write_csv(file, &[], &changes));
    }
    super::warn_without_optimisation();
    let effort = if args.files.quick {
        Effort::QUICK
    } else {
        Effort::FULL
    };
    let grids = read(args)?;
    let measured = measure_effects(args, &grids, effort)?;
    print!("{}", report::effects(&measured));
    if args.effects {
        return files::write(out, |file| report::write_effects(file, &measured));
    }
    let mut rows = Vec::new();
    for grid in grids {
        measure(&grid, effort, &mut rows);
    }
    if !args.files.files_only {
        for make in synthetic() {
            measure(&make(), effort, &mut rows);
        }
    }
    show(&solver::patches(effort), &mut rows);
    show(&solver::roots(effort), &mut rows);
    let changes = continuity::measure();
    print!("{}", report::continuity(&changes));
    print!("{}", report::summary(&rows));
    files::write(out, |file| report::write_csv(file, &rows, &changes))?;
    files::write(picture, |file| report::draw(&rows, file))
}

/// Opens every file before the first measurement.
fn read(args: &Args) -> Result<Vec<Grid>, Failure> {
    let open = |file: &PathBuf| {
        let raster = Raster::open(file, &OpenOptions::default()).map_err(|error| {
            Failure::new(error).hint(format!("see: hapterra info {}", file.display()))
        })?;
        Ok(Grid::from_raster(file, &raster, args.steepness))
    };
    args.files.files.iter().map(open).collect()
}

/// Measures the effects on the files, and on one synthetic terrain. A file that is too small or too
/// high for them still has its other figures.
fn measure_effects(args: &Args, files: &[Grid], effort: Effort) -> Result<Measured, Failure> {
    let synthetic = (!args.files.files_only).then(tick_states::terrain);
    let mut all = Measured::default();
    for grid in files.iter().chain(&synthetic) {
        // Otherwise they are printed with the other figures.
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

/// Returns the paper's three sizes, one of them ten times as steep (the paper's own scale: 10 m
/// cells, 1 m units), and a larger one.
fn synthetic() -> [fn() -> Grid; 5] {
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
