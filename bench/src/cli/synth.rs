//! `hapterra-lab synth`: a terrain file made by formula.

use std::path::PathBuf;

use clap::ValueHint;
use hapterra::cli::options::input::parse_size;
use hapterra::cli::terminal::{interrupt, partial_files, progress};
use hapterra::cli::{Failure, report};
use hapterra::quantity::GROUND;
use hapterra::synth::{Grid, Kind, Synth, write};

/// Arguments of `hapterra-lab synth`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Shape of the terrain
    #[arg(value_enum)]
    pub kind: Kind,

    /// File to write: .tif (GeoTIFF), .asc (Esri ASCII) or .png (16-bit, whole metres)
    #[arg(short, long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: PathBuf,

    /// Samples: WIDTHxHEIGHT, or one number for a square
    #[arg(long, value_name = "WxH", default_value = "1024", value_parser = parse_size)]
    pub size: (u32, u32),

    /// Another seed makes another terrain; the same seed makes the same one anywhere
    #[arg(long, default_value_t = 1)]
    pub seed: u64,

    /// Side of a cell, such as 10m
    #[arg(long, value_name = "LENGTH", default_value = "10m", value_parser = parse_length)]
    pub cell: f64,

    /// Height of the terrain, from its lowest to its highest place at most, such as 500m
    /// [default: what suits the kind, some tens of cells; a plane rises by a fifth of a
    /// cell per cell to the east]
    #[arg(long, value_name = "LENGTH", value_parser = parse_length)]
    pub amplitude: Option<f64>,
}

/// Writes the terrain.
///
/// # Errors
/// When it is too small for a surface, or the file cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    let (columns, rows) = args.size;
    if columns < 2 || rows < 2 {
        let error = format!("too small: {columns} × {rows} samples");
        return Err(Failure::new(error).hint("a surface needs at least --size 2x2"));
    }
    let usual = args.kind.default_amplitude_cells() * args.cell;
    let amplitude = args.amplitude.map(|height| match args.kind {
        // The kind's own amplitude is a slope.
        Kind::Plane => height / Synth::new(Kind::Plane, 0, 1.0).rise(columns, rows),
        _ => height,
    });
    let synth = Synth::new(args.kind, args.seed, amplitude.unwrap_or(usual));
    let grid = Grid {
        columns,
        rows,
        cell_m: args.cell,
    };
    partial_files::report([args.out.as_path()]);
    let progress = progress::bar(Some(rows.into()), "{bar:30} {pos}/{len} rows, {eta} left");
    interrupt::listen();
    let written = write(&args.out, &synth, &grid, &mut || {
        progress.inc(1);
        !interrupt::requested()
    });
    progress.finish_and_clear();
    written?;
    report::put(&format!(
        "wrote {}: {columns} × {rows} samples\n",
        args.out.display()
    ))
}

fn parse_length(text: &str) -> Result<f64, String> {
    match GROUND.read(text)? {
        length if length > 0.0 && length <= 1e9 => Ok(length),
        _ => Err("a length above 0 m and at most 1e9 m".into()),
    }
}
