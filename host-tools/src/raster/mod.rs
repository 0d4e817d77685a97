//! Terrain files of every supported format become one [`Raster`].
//!
//! | format | read by | notes |
//! |---|---|---|
//! | GeoTIFF, TIFF, BigTIFF, COG | `tiff-reader` | first full image; a band by number |
//! | SRTM `.hgt`, also zipped or gzipped | here | place from the name |
//! | DTED 0 to 2 | here | |
//! | Esri ASCII `.asc`, GRASS ASCII | here | |
//! | `.flt`, `.bil`, `.bip`, `.bsq`, ENVI | here | by the `.hdr` beside them |
//! | PNG | `png` | grey, grey + alpha, depth in the alpha of a colour picture, encoded in its colours |
//! | raw samples | here | with a stated [`RawLayout`] |
//! | NetCDF 3 and 4 `.nc`, `.grd` | `netcdf-reader` | |
//! | USGS ASCII `.dem` | here | |
//! | NumPy `.npy`, `.npz` | `npyz` | |
//!
//! Each format is one file or folder of `formats`, and one line in its table. From a
//! path to samples: `open` unpacks (`archive`), asks the table, and lets the format
//! decode (`input`, `read`) into `decoded`; [`Raster`] answers from that.
//!
//! **Places.** A format hands over its map from columns and rows to coordinates
//! (`ground_map`) and its reference system (`crs`); what follows from these is worked out
//! once for all (`placed`), as are places of samples for the rest of the program
//! (`georeference`). World files and `.prj` files are read by `beside`.
//!
//! **Holes.** No-data as the format states it, NaN, masked samples and tiles
//! that a sparse file leaves out are holes: [`Raster::height`] is NaN there. An
//! infinite sample is an error: it is neither a height nor a declared hole.

mod archive;
mod beside;
mod crs;
mod decoded;
mod error;
mod format;
mod formats;
mod geometry;
mod georeference;
mod globe;
mod ground_map;
mod guard;
mod input;
mod open;
mod options;
mod place;
mod placed;
mod read;
mod samples;

use std::path::Path;

pub use crs::{LonLat, ReferenceSystem};
pub use decoded::{HeightSummary, LARGEST_HEIGHT};
pub use error::{BadRaster, Error};
pub(crate) use geometry::metres_in;
pub use geometry::{CellSize, CellUnit, Certainty, VerticalDatum};
pub(crate) use georeference::around;
pub use georeference::{Georeference, GroundTransform, Sides, System};
pub use globe::Globe;
pub use ground_map::Bounds;
pub use options::{Encoding, OpenOptions, PngChannel, RawLayout};
pub use samples::{Endian, SampleType, Samples};

use decoded::Decoded;
use place::Place;
use samples::{SampleValue, with_samples};

/// A height field held once, in the compact type of its file.
///
/// Column 0 is the westernmost, row 0 the **southernmost**, whatever the file's
/// order. Heights are in the file's vertical unit.
#[derive(Clone, Debug)]
pub struct Raster {
    source: Decoded,
    summary: HeightSummary,
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
            .and_then(|decoded| decoded.with_ground_cell(options.ground_cell_m))
            .map(|decoded| decoded.with_vertical_unit(options.vertical_unit_m))
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
    ) -> Result<Self, BadRaster> {
        let mut samples = Vec::with_capacity(columns as usize * rows as usize);
        for row in 0..rows {
            samples.extend((0..columns).map(|column| height(column, row)));
        }
        let mut decoded = Decoded::new("made in memory".into(), (columns, rows), samples.into());
        decoded.south_up = true;
        decoded.metres_per_vertical_unit = Some(1.0);
        let metre = CellUnit::Length { metres: 1.0 };
        decoded.cell = Some(CellSize::stated((1.0, 1.0), metre, None));
        Self::checked(decoded, None)
    }

    /// The same samples in cells of another size.
    #[must_use]
    pub fn with_cell(mut self, cell: CellSize) -> Self {
        self.source.cell = Some(cell).filter(CellSize::is_valid);
        self
    }

    fn checked(mut source: Decoded, no_data: Option<f64>) -> Result<Self, BadRaster> {
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
        let mut height = [f64::NAN];
        self.copy_row(0, row, column, &mut height);
        height[0]
    }

    /// Copies heights of a row from `first_column` eastwards, one for each place in
    /// `heights`: the same values as [`Raster::height`].
    ///
    /// Level *L* is the field with every 2ᴸ-th sample; row and column count in it.
    pub fn copy_row(&self, level: u8, row: u32, first_column: u32, heights: &mut [f64]) {
        heights.fill(f64::NAN);
        let (columns, rows) = (u64::from(self.columns()), u64::from(self.rows()));
        let step = 1_u64.checked_shl(level.into()).unwrap_or(u64::MAX);
        let row = u64::from(row).saturating_mul(step);
        if row >= rows {
            return;
        }
        let file_row = if self.source.south_up {
            row
        } else {
            rows - 1 - row
        };
        with_samples!(&self.source.samples, values => {
            for (column, height) in (u64::from(first_column)..).zip(heights) {
                let column = column.saturating_mul(step);
                if column >= columns {
                    return;
                }
                let file_column = match self.source.east_first {
                    true => columns - 1 - column,
                    false => column,
                };
                let index = (file_row * columns + file_column) as usize;
                *height = self.source.height_of(values[index].widen(), index);
            }
        });
    }

    /// Range of the heights and number of holes.
    pub fn summary(&self) -> HeightSummary {
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

    /// The horizontal reference system, where the file states it.
    pub fn reference_system(&self) -> Option<&ReferenceSystem> {
        self.source.system.as_ref()
    }

    /// Where the reference system comes from.
    pub fn reference_system_from(&self) -> Certainty {
        self.source.system_from
    }

    /// Outer edges of the cells around all samples, in the units of the file's
    /// coordinates, where the file knows its place.
    pub fn bounds(&self) -> Option<Bounds> {
        self.source.bounds()
    }

    /// The same in degrees of longitude and latitude, as [`Georeference::lonlat`] says,
    /// where the reference system is known. Longitudes run on over 180° where the field does.
    pub fn bounds_lonlat(&self) -> Option<Bounds> {
        self.source.bounds_lonlat()
    }

    /// What the heights count from, where the file says so.
    pub fn vertical_datum(&self) -> Option<&VerticalDatum> {
        self.source.vertical_datum.as_ref()
    }

    /// Where the vertical unit comes from.
    pub fn vertical_unit_from(&self) -> Certainty {
        match self.source.metres_per_vertical_unit {
            Some(_) => self.source.vertical_unit_from,
            None => Certainty::Assumed,
        }
    }

    /// Where the samples lie in the coordinates of the file's reference system.
    pub fn georeference(&self) -> Georeference<'_> {
        let source = &self.source;
        let last = [source.columns, source.rows].map(|count| f64::from(count) - 1.0);
        let ground = source.place.and_then(|place| place.map.of_centres());
        let ground = ground.map(|map| {
            let map = match source.east_first {
                true => map.with_columns_from(last[0]),
                false => map,
            };
            match source.south_up {
                true => map,
                false => map.with_rows_from(last[1]),
            }
        });
        Georeference::new(ground, source.system.as_ref(), source.cell, last)
    }

    /// The same samples at a place: the south-west one at `origin`, and the steps to the
    /// next column and row, in coordinates of the reference system with an EPSG code.
    #[must_use]
    pub fn with_ground(mut self, ground: GroundTransform, epsg: Option<u16>) -> Self {
        self.source.place = ground_map::GroundMap::of_samples(&ground).map(Place::new);
        self.source.system = epsg.and_then(ReferenceSystem::from_code);
        self
    }

    /// Size of a cell, where the file knows it.
    pub fn cell(&self) -> Option<CellSize> {
        self.source.cell
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

    /// What the user should know about how the file was read, one sentence each.
    pub fn remarks(&self) -> &[String] {
        &self.source.remarks
    }
}
