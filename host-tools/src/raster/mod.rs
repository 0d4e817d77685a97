//! Terrain files of every supported format become one [`Raster`].
//!
//! | format | read by | notes |
//! |---|---|---|
//! | GeoTIFF, TIFF, BigTIFF, COG | `tiff` | first full image, first band |
//! | SRTM `.hgt`, also zipped or gzipped | here | place from the name |
//! | Esri ASCII `.asc` | here | |
//! | PNG | `png` | grey, grey + alpha, depth in the alpha of a colour picture |
//! | raw samples | here | with a stated [`RawLayout`] |
//! | NetCDF 3 and 4 `.nc`, `.grd` | `netcdf-reader` | |
//! | USGS ASCII `.dem` | here | |
//! | NumPy `.npy`, `.npz` | `npyz` | |
//!
//! **Holes.** No-data as the format states it, NaN, masked samples and tiles
//! that a sparse file leaves out are holes: [`Raster::height`] is NaN there. An
//! infinite sample is an error: it is neither a height nor a declared hole.

mod archive;
mod asc;
mod error;
mod geometry;
mod guard;
mod hgt;
mod input;
mod netcdf;
mod npy;
mod open;
mod options;
mod png;
mod raw;
mod samples;
mod tiff;
mod usgs_dem;

use std::path::Path;

pub use error::{Error, Fault};
pub use geometry::{CellSize, CellUnit, Certainty};
pub use options::{Endian, OpenOptions, PngChannel, RawLayout, RawSample};
pub use samples::Samples;

use samples::{HoleMask, Widen, with_samples};

/// No height is larger than this (in the file's vertical unit), whatever the
/// planet: such a sample is a no-data value that the file forgot to declare.
pub const LARGEST_HEIGHT: f64 = 1e30;

/// A height field held once, in the compact type of its file.
///
/// Column 0 is the westernmost, row 0 the **southernmost**, whatever the file's
/// order. Heights are in the file's vertical unit.
#[derive(Clone, Debug)]
pub struct Raster {
    source: Decoded,
    summary: Summary,
}

/// What a decoder hands over: samples in file order and all that the file says
/// about them.
#[derive(Clone, Debug)]
struct Decoded {
    /// Name of the format and variant, as `GeoTIFF, int16, deflate`.
    format: String,
    /// Samples a row.
    columns: u32,
    /// Rows.
    rows: u32,
    /// `columns × rows` samples, the file's first row first.
    samples: Samples,
    /// Whether the file's first row is the southernmost.
    south_up: bool,
    /// Whether the file's first column is the easternmost.
    east_first: bool,
    /// Stored value that means no data.
    no_data: Option<f64>,
    /// Holes that no value marks.
    mask: Option<HoleMask>,
    /// Height = stored × scale + offset.
    scale: f64,
    /// See `scale`.
    offset: f64,
    /// Size of a cell, where the file knows it.
    cell: Option<CellSize>,
    /// Metres per vertical unit, where the file says so.
    metres_per_vertical_unit: Option<f64>,
    /// What the user should know.
    remarks: Vec<String>,
}

impl Decoded {
    /// Plain heights, north row first, with nothing else known.
    fn new(format: impl Into<String>, columns: u32, rows: u32, samples: Samples) -> Self {
        Self {
            format: format.into(),
            columns,
            rows,
            samples,
            south_up: false,
            east_first: false,
            no_data: None,
            mask: None,
            scale: 1.0,
            offset: 0.0,
            cell: None,
            metres_per_vertical_unit: None,
            remarks: Vec::new(),
        }
    }
}

/// Range of the heights and number of holes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// Lowest height in the file's vertical unit.
    pub lowest: f64,
    /// Highest height in the file's vertical unit.
    pub highest: f64,
    /// Samples without a height.
    pub holes: u64,
}

impl Raster {
    /// Opens a terrain file: by its content, and where that says nothing by its
    /// extension.
    ///
    /// # Errors
    /// What is wrong with which file; never a panic, and never an allocation
    /// that the file's own size does not justify.
    pub fn open(path: impl AsRef<Path>, options: &OpenOptions) -> Result<Self, Error> {
        let path = path.as_ref();
        open::decode(path, options)
            .and_then(|decoded| Self::checked(decoded, options.no_data))
            .map_err(|fault| Error::new(path, fault))
    }

    /// A field made in memory, `height(column, row)` with row 0 the
    /// southernmost; NaN is a hole. Cells are 1 m, heights in metres.
    ///
    /// # Errors
    /// When there are fewer than 2 × 2 samples, no heights, or infinite ones.
    pub fn from_fn(
        columns: u32,
        rows: u32,
        mut height: impl FnMut(u32, u32) -> f32,
    ) -> Result<Self, Fault> {
        let mut samples = Vec::with_capacity(columns as usize * rows as usize);
        for row in 0..rows {
            samples.extend((0..columns).map(|column| height(column, row)));
        }
        let mut decoded = Decoded::new("made in memory", columns, rows, Samples::F32(samples));
        decoded.south_up = true;
        decoded.metres_per_vertical_unit = Some(1.0);
        decoded.cell = Some(CellSize {
            east: 1.0,
            north: 1.0,
            unit: CellUnit::Length { metres: 1.0 },
            latitude: None,
            certainty: Certainty::Stated,
        });
        Self::checked(decoded, None)
    }

    /// Checks what every format must satisfy, and summarises the heights.
    fn checked(mut source: Decoded, no_data: Option<f64>) -> Result<Self, Fault> {
        let (columns, rows) = (u64::from(source.columns), u64::from(source.rows));
        if columns < 2 || rows < 2 {
            return Err(Fault::TooSmall { columns, rows });
        }
        if columns.checked_mul(rows) != u64::try_from(source.samples.len()).ok() {
            return Err(Fault::damaged(format!(
                "{} samples where {columns} × {rows} were promised",
                source.samples.len()
            )));
        }
        if !(source.scale.is_finite() && source.offset.is_finite()) || source.scale == 0.0 {
            return Err(Fault::damaged(format!(
                "heights are stored with scale {} and offset {}",
                source.scale, source.offset
            )));
        }
        source.no_data = no_data
            .or(source.no_data)
            .and_then(|value| source.samples.comparable_no_data(value));
        source.cell = source.cell.filter(CellSize::is_valid);
        let summary = summarise(&source)?;
        Ok(Self { source, summary })
    }

    /// Samples from west to east.
    pub fn columns(&self) -> u32 {
        self.source.columns
    }

    /// Samples from south to north.
    pub fn rows(&self) -> u32 {
        self.source.rows
    }

    /// The height at a sample in the file's vertical unit; NaN in a hole and
    /// outside the field. Row 0 is the southernmost.
    pub fn height(&self, column: u32, row: u32) -> f64 {
        if column >= self.columns() || row >= self.rows() {
            return f64::NAN;
        }
        let index = self.index(column, row);
        with_samples!(&self.source.samples, values => {
            self.source.height_of(values[index].widen(), index)
        })
    }

    /// Copies the heights of a row from `first_column` eastwards, one for each
    /// place in `heights`: the same values as [`Raster::height`].
    pub fn copy_row(&self, row: u32, first_column: u32, heights: &mut [f64]) {
        heights.fill(f64::NAN);
        if row >= self.rows() {
            return;
        }
        let inside = self.columns().saturating_sub(first_column) as usize;
        with_samples!(&self.source.samples, values => {
            for (column, height) in (first_column..).zip(heights.iter_mut().take(inside)) {
                let index = self.index(column, row);
                *height = self.source.height_of(values[index].widen(), index);
            }
        });
    }

    /// Where the sample at a column and row of the field is in the file.
    fn index(&self, column: u32, row: u32) -> usize {
        let file_row = if self.source.south_up {
            row
        } else {
            self.rows() - 1 - row
        };
        let file_column = if self.source.east_first {
            self.columns() - 1 - column
        } else {
            column
        };
        file_row as usize * self.columns() as usize + file_column as usize
    }

    /// Range of the heights and number of holes.
    pub fn summary(&self) -> Summary {
        self.summary
    }

    /// The samples as the file holds them: its own type and order.
    pub fn samples(&self) -> &Samples {
        &self.source.samples
    }

    /// Name of the format and variant, as `GeoTIFF, int16, deflate`.
    pub fn format(&self) -> &str {
        &self.source.format
    }

    /// Size of a cell, where the file knows it.
    pub fn cell(&self) -> Option<CellSize> {
        self.source.cell
    }

    /// Side in metres of the square cell that stands for the file's cells (see
    /// [`CellSize::square_metres`]), where the file knows it.
    pub fn metres_per_cell(&self) -> Option<f64> {
        self.cell().map(|cell| cell.square_metres())
    }

    /// Metres per vertical unit, where the file says so; most say nothing and
    /// mean metres.
    pub fn stated_metres_per_vertical_unit(&self) -> Option<f64> {
        self.source.metres_per_vertical_unit
    }

    /// Metres per vertical unit; one where the file does not say.
    pub fn metres_per_vertical_unit(&self) -> f64 {
        self.stated_metres_per_vertical_unit().unwrap_or(1.0)
    }

    /// How many cells high one vertical unit is at true proportions, where the
    /// file knows its cell size: with `cell_mm` hand millimetres a cell, the true
    /// height of a unit is `cell_mm` times this.
    pub fn cells_per_vertical_unit(&self) -> Option<f64> {
        self.metres_per_cell()
            .map(|metres| self.metres_per_vertical_unit() / metres)
    }

    /// What the user should know about how the file was read, one sentence each.
    pub fn remarks(&self) -> &[String] {
        &self.source.remarks
    }
}

impl Decoded {
    /// Height of a stored value; NaN in a hole.
    fn height_of(&self, stored: f64, index: usize) -> f64 {
        let hole = self.no_data == Some(stored)
            || self.mask.as_ref().is_some_and(|mask| mask.is_hole(index));
        if hole {
            f64::NAN
        } else {
            stored * self.scale + self.offset
        }
    }
}

/// One pass over all samples: range, holes, and the first that is no height.
fn summarise(source: &Decoded) -> Result<Summary, Fault> {
    let mut summary = Summary {
        lowest: f64::INFINITY,
        highest: f64::NEG_INFINITY,
        holes: 0,
    };
    let mut absurd = None;
    with_samples!(&source.samples, values => {
        for (index, value) in values.iter().enumerate() {
            let height = source.height_of(value.widen(), index);
            if height.is_nan() {
                summary.holes += 1;
            } else if height.abs() > LARGEST_HEIGHT {
                absurd = absurd.or(Some((index, value.widen())));
            } else {
                summary.lowest = summary.lowest.min(height);
                summary.highest = summary.highest.max(height);
            }
        }
    });
    if let Some((index, value)) = absurd {
        let columns = source.columns as usize;
        return Err(Fault::NotANumber {
            column: (index % columns) as u64,
            row: (index / columns) as u64,
            value,
        });
    }
    if summary.lowest > summary.highest {
        return Err(Fault::AllNoData {
            samples: summary.holes,
        });
    }
    Ok(summary)
}
