//! `hapterra cut`: a terrain's heights for a web page, reduced to a limited number of samples.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::ValueHint;
use serde::Serialize;

use super::failure::{Failure, OrHint};
use super::options::terrain_file::TerrainFile;
use crate::output::{Output, OutputError, OutputFolder, check_distinct};
use crate::terrain::HapticGrid;

/// The file of heights and its description.
const HEIGHTS: &str = "terrain.npy";
const ABOUT: &str = "terrain.json";

/// Hint for a folder that cannot be written.
const HINT: &str = "name another folder with -o";

/// Arguments of `hapterra cut`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The terrain file.
    #[command(flatten)]
    pub terrain: TerrainFile,

    /// Folder to write terrain.npy and terrain.json to
    #[arg(short, long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,

    /// Maximum number of samples: the finest level within it is written
    #[arg(long, value_name = "N", default_value_t = 4_000_000, value_parser = clap::value_parser!(u64).range(1024..))]
    pub max_samples: u64,
}

/// Description of the heights; its fields have the names of the JSON.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct About {
    /// The file of heights, in the same folder.
    file: &'static str,
    /// The terrain's name.
    name: String,
    /// Rendered samples before the reduction, west to east and south to north.
    of: [u32; 2],
    /// Side of a cell on the ground, m.
    cell_m: Option<f64>,
    /// Metres per unit of height.
    unit_m: f64,
}

/// Writes the rendered cells' heights and their description.
///
/// # Errors
/// The terrain cannot be opened, or the folder cannot be written.
pub fn run(args: &Args) -> Result<(), Failure> {
    let heights = args.out.join(HEIGHTS);
    check_distinct(&[&heights], &args.terrain.inputs()).or_hint(HINT)?;
    let raster = args.terrain.open()?;
    let grid = HapticGrid::new(&raster, args.terrain.reading.cells());
    let of = [grid.columns(), grid.rows()];
    let size = |level: u8| of.map(|count| ((count - 1) >> level) + 1);
    let fits = |level: &u8| size(*level).map(u64::from).iter().product::<u64>() <= args.max_samples;
    let level = (0..31).find(fits).unwrap_or(31);
    let about = About {
        file: HEIGHTS,
        name: args.terrain.name(),
        of,
        cell_m: grid.side_m().map(|side| side * f64::from(level).exp2()),
        unit_m: raster.metres_per_vertical_unit(),
    };
    let _folder = OutputFolder::create(&args.out).or_hint(HINT)?;
    write_output(&heights, |out| write_npy(out, &grid, level, size(level))).or_hint(HINT)?;
    raster.check_complete()?;
    write_output(&args.out.join(ABOUT), |out| {
        Ok(serde_json::to_writer_pretty(out, &about)?)
    })
    .or_hint(HINT)?;
    let [columns, rows] = size(level);
    println!(
        "wrote {}: {columns} × {rows} samples of {} × {}",
        heights.display(),
        of[0],
        of[1]
    );
    Ok(())
}

fn write_output(
    path: &Path,
    write: impl FnOnce(&mut Output) -> io::Result<()>,
) -> Result<(), OutputError> {
    let mut output = Output::create(path)?;
    write(&mut output).map_err(|source| OutputError {
        path: path.to_owned(),
        source,
    })?;
    output.finish()
}

/// Writes NumPy's format, 32-bit floats, north row first.
fn write_npy(
    out: &mut impl Write,
    grid: &HapticGrid<'_>,
    level: u8,
    [columns, rows]: [u32; 2],
) -> io::Result<()> {
    let shape =
        format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, {columns}), }}");
    out.write_all(b"\x93NUMPY\x01\x00\x76\x00")?;
    writeln!(out, "{shape:117}")?;
    let mut row = vec![0.0; columns as usize];
    for south in (0..rows).rev() {
        // `check_complete` reports unreadable samples.
        let _ = grid.read_row(level, south, 0, &mut row);
        let bytes: Vec<u8> = row.iter().flat_map(|h| (*h as f32).to_le_bytes()).collect();
        out.write_all(&bytes)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terrain::HapticCells;
    use heightfield::{OpenOptions, Raster};

    #[test]
    fn npy_of_level_1_has_every_second_sample() {
        let height = |column: u32, row: u32| {
            if (column, row) == (2, 4) {
                f32::NAN
            } else {
                (column * 10 + row) as f32
            }
        };
        let raster = Raster::from_fn(7, 6, height).expect("raster");
        let grid = HapticGrid::new(&raster, HapticCells::Square);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(HEIGHTS);
        write_output(&path, |out| write_npy(out, &grid, 1, [4, 3])).expect("written");
        let again = Raster::open(&path, &OpenOptions::default()).expect("read");
        assert_eq!((again.columns(), again.rows()), (4, 3));
        for (column, row) in (0..4).flat_map(|column| (0..3).map(move |row| (column, row))) {
            let expected = f64::from(height(2 * column, 2 * row));
            let found = again.height(column, row);
            assert!(
                found == expected || found.is_nan() && expected.is_nan(),
                "{column} {row}"
            );
        }
    }
}
