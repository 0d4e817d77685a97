//! Checks of terrains.

use alloc::vec::Vec;

use hapterra_core::grid::MAX_CELL;
use hapterra_core::terrain::MAX_STEP_CELLS;

use crate::scale::ScaleError;
use crate::tip::TipError;

/// Heights or scale that a terrain cannot have.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum TerrainError {
    /// The size is too small or too large.
    #[error(
        "a terrain of {columns} × {rows} samples; from 2 × 2 to {MAX_CELL} × {MAX_CELL} can be touched"
    )]
    Size {
        /// Samples from west to east.
        columns: u32,
        /// Samples from south to north.
        rows: u32,
    },
    /// The number of samples does not match the size.
    #[error("{given} samples for {columns} columns and {rows} rows: pass columns times rows")]
    Count {
        /// Samples in the array.
        given: usize,
        /// Samples from west to east.
        columns: u32,
        /// Samples from south to north.
        rows: u32,
    },
    /// There is not enough memory for the samples.
    #[error("no memory for {columns} × {rows} samples: read them tile by tile")]
    Memory {
        /// Samples from west to east.
        columns: u32,
        /// Samples from south to north.
        rows: u32,
    },
    /// A row has another length than the first.
    #[error("row {row} has {given} samples and row 0 has {first}: make all rows equally long")]
    Ragged {
        /// The row's index, in the order of the array.
        row: usize,
        /// Its samples.
        given: usize,
        /// Samples of the first row.
        first: usize,
    },
    /// The millimetres of a cell or of a vertical unit are invalid.
    #[error(transparent)]
    Scale(#[from] ScaleError),
    /// The tip's radius is not possible over these cells.
    #[error(transparent)]
    Tip(#[from] TipError),
    /// Under this tip the terrain would have more cells than positions can address.
    #[error(
        "a tip of {tip_mm} mm cuts each cell into {parts} along a side, and {columns} × {rows} samples are too many for that: use a larger tip, or fewer samples"
    )]
    TipCells {
        /// The radius, mm.
        tip_mm: f64,
        /// Haptic cells along the side of a cell.
        parts: u32,
        /// Samples from west to east.
        columns: u32,
        /// Samples from south to north.
        rows: u32,
    },
    /// Heights are beyond the range of positions.
    #[error(
        "heights reach {cells:.4e} cells of {cell_mm} mm; at most ±{MAX_CELL} can be touched: scale the heights down, or make no-data NaN"
    )]
    TooTall {
        /// The largest height, in cells.
        cells: f64,
        /// Millimetres a cell.
        cell_mm: f64,
    },
    /// Neighbouring samples are too steep.
    #[error(
        "sample {column}, {row}, from the south-west, differs from a neighbour by {cells:.3e} cells; at most {MAX_STEP_CELLS} can be touched: scale the heights down, or make the sample NaN"
    )]
    Step {
        /// Column of the sample, from the west.
        column: u32,
        /// Row of the sample, from the south.
        row: u32,
        /// The difference of height, in cells.
        cells: f64,
    },
}

pub(crate) fn check_size(columns: u32, rows: u32) -> Result<(), TerrainError> {
    let ok = |samples: u32| (2..=MAX_CELL as u32).contains(&samples);
    match ok(columns) && ok(rows) {
        true => Ok(()),
        false => Err(TerrainError::Size { columns, rows }),
    }
}

pub(crate) fn check_count(columns: u32, rows: u32, given: usize) -> Result<(), TerrainError> {
    check_size(columns, rows)?;
    match u64::from(columns) * u64::from(rows) == given as u64 {
        true => Ok(()),
        false => Err(TerrainError::Count {
            given,
            columns,
            rows,
        }),
    }
}

/// Allocates memory for the samples.
pub(crate) fn reserve_samples<T>(columns: u32, rows: u32) -> Result<Vec<T>, TerrainError> {
    check_size(columns, rows)?;
    let mut samples = Vec::new();
    let count = usize::try_from(u64::from(columns) * u64::from(rows)).unwrap_or(usize::MAX);
    let reserved = samples.try_reserve_exact(count);
    reserved.map_err(|_| TerrainError::Memory { columns, rows })?;
    Ok(samples)
}
