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
mod decoded;
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

pub use decoded::Summary;
pub use error::{Error, Fault};
pub use geometry::{CellSize, CellUnit, Certainty};
pub use options::{Endian, OpenOptions, PngChannel, RawLayout, RawSample};
pub use samples::Samples;

use decoded::Decoded;
use samples::{Widen, with_samples};

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

    fn checked(mut source: Decoded, no_data: Option<f64>) -> Result<Self, Fault> {
        let summary = source.check(no_data)?;
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
