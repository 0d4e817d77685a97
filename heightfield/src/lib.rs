//! Reads terrain files of every supported format as a [`Raster`].
//!
//! | format | read by | notes |
//! |---|---|---|
//! | GeoTIFF, TIFF, BigTIFF, COG | `tiff-reader` | first full image; a band by number |
//! | SRTM `.hgt` | here | place from the name |
//! | Esri ASCII `.asc` | here | |
//! | `.flt`, `.bil`, `.bip`, `.bsq` | here | by the `.hdr` beside them |
//! | PNG | `png` | grey, grey + alpha, or depth in the alpha or colours of a colour picture |
//! | raw samples | here | with a stated [`RawLayout`] |
//! | NumPy `.npy` | here | |
//! | all other formats of GDAL | `heightfield-gdal` | where the machine has a libgdal |
//!
//! Each format is one file or folder of `formats`, and one line in its table. From a path to
//! samples: `open` finds the format in the table; the format decodes (`input`, `read`) into
//! `decoded`, which [`Raster`] reads. A folder or a pattern of names is many files as one terrain
//! (`mosaic`).
//!
//! A window of a DEM:
//!
//! ```no_run
//! use heightfield::{OpenOptions, Raster, Wait, Window};
//!
//! let dem = Raster::open("dem.tif", &OpenOptions::default())?;
//! let window = Window { column: 200, row: 100, columns: 64, rows: 64 };
//! let mut heights = vec![0.0; 64 * 64];
//! if !dem.read_window(0, window, &mut heights, Wait::UntilRead).is_complete() {
//!     dem.check_complete()?;
//! }
//! println!("{} × {} m a unit", heights[0], dem.metres_per_vertical_unit());
//! # Ok::<(), heightfield::Error>(())
//! ```
//!
//! **Places.** A format returns its map from columns and rows to coordinates (`ground_map`) and its
//! reference system (`crs`). All other geometry is derived from these, the same for all formats
//! (`placed`, and `georeference` for the rest of the program). World files and `.prj` files are
//! read by `beside`.
//!
//! **No-data** is the format's no-data value, NaN, masked samples and missing tiles of a sparse
//! file: [`Raster::height`] is NaN there. Samples beyond [`MAX_HEIGHT`] are also no-data, with a
//! remark. With [`OpenOptions::fill`], no-data near data gets a height.

#![forbid(unsafe_code)]

mod beside;
pub mod bilinear;
mod blocks;
mod crs;
mod decoded;
mod decoder_panic;
pub mod disk_cache;
mod encoding;
mod error;
mod file_layout;
mod fill;
mod format;
mod formats;
mod geometry;
mod georeference;
mod globe;
mod ground_map;
mod height_summary;
mod input;
mod mosaic;
mod numbers;
mod one_file;
mod open;
mod options;
mod place;
mod placed;
pub mod printable_text;
mod raw_samples;
mod read;
mod read_status;
pub mod regular_file;
mod remote;
mod samples;
mod storage;
mod subsampled;
mod suspicious_values;
mod tangents;
mod unreadable_parts;
mod xml;

// Time-outs for the tests of all crates, each of which uses some.
#[cfg(test)]
#[path = "../../tests/src/timeouts.rs"]
#[allow(dead_code, unreachable_pub)]
mod timeouts;

use std::path::{Path, PathBuf};

pub use crs::{LonLat, ReferenceSystem};
pub use error::{Error, RasterError};
pub use file_layout::{FileLayout, RasterType};
pub use fill::Fill;
pub use geometry::metres_in;
pub use geometry::{CellSize, CellUnit, Certainty, VerticalDatum};
pub use georeference::around;
pub use georeference::{Georeference, GroundTransform, Sides, System};
pub use globe::Globe;
pub use ground_map::Bounds;
pub use height_summary::HeightSummary;
pub use mosaic::files_read_with;
pub use options::{Encoding, OpenOptions, PngChannel, RawLayout};
pub use read_status::{ReadStatus, ReadTracker, Wait};
pub use remote::{RemoteFetcher, file_name, is_url, without_key};
pub use samples::{Endian, SampleType, Samples};
pub use suspicious_values::MAX_HEIGHT;

use blocks::{Blocks, Survey};
use decoded::Decoded;
use place::Place;
use samples::{SampleValue, with_samples};
use storage::Storage;

/// Loads the libgdal of this machine, on the first call, for formats that this crate does not read.
///
/// # Errors
/// The reason why no libgdal can be used.
pub fn gdal() -> Result<heightfield_gdal::Library, heightfield_gdal::Error> {
    heightfield_gdal::Library::load(heightfield_gdal::Settings::default())
}

/// Names of the formats that are read without GDAL.
pub fn own_formats() -> impl Iterator<Item = &'static str> {
    formats::FORMATS.iter().map(|format| format.name)
}

/// A rectangle of a level's samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Its westernmost column.
    pub column: u32,
    /// Its southernmost row.
    pub row: u32,
    /// Samples from west to east.
    pub columns: u32,
    /// Samples from south to north.
    pub rows: u32,
}

/// A height field, stored once, in the compact type of its file.
///
/// Column 0 is the westernmost, row 0 the **southernmost**, whatever the file's order. Heights are
/// in the file's vertical unit.
#[derive(Clone, Debug)]
pub struct Raster {
    source: Decoded,
    survey: Survey,
    fill: Option<Fill>,
    /// Empty if the raster was made in memory.
    path: PathBuf,
}

impl Raster {
    /// Opens a terrain file. The format follows from its content, or else from its extension.
    ///
    /// # Errors
    /// Names the file and its fault. Damaged files never cause a panic, or an allocation that the
    /// file's size does not justify.
    pub fn open(path: impl AsRef<Path>, options: &OpenOptions) -> Result<Self, Error> {
        Self::opened(path.as_ref(), options, open::decode)
    }

    /// Opens files as one terrain, like those of a folder.
    ///
    /// # Errors
    /// As [`Raster::open`].
    pub fn open_all(files: Vec<PathBuf>, options: &OpenOptions) -> Result<Self, Error> {
        let first = files.first().cloned().unwrap_or_default();
        Self::opened(&first, options, |_, options| {
            open::decode_all(&files, options)
        })
    }

    /// Opens a terrain file with GDAL, even if [`Raster::open`] reads its format itself: both must
    /// agree.
    ///
    /// # Errors
    /// As [`Raster::open`], and [`RasterError::UnknownFormat`] without a libgdal.
    pub fn open_by_gdal(path: impl AsRef<Path>, options: &OpenOptions) -> Result<Self, Error> {
        Self::opened(path.as_ref(), options, open::decode_by_gdal)
    }

    fn opened(
        path: &Path,
        options: &OpenOptions,
        decode: impl Fn(&Path, &OpenOptions) -> Result<Decoded, RasterError>,
    ) -> Result<Self, Error> {
        options.fetcher.set_disk_cache(&options.disk_cache);
        decode(path, options)
            .and_then(|decoded| decoded.with_ground_cell(options.ground_cell_m))
            .map(|decoded| decoded.with_vertical_unit(options.vertical_unit_m))
            .and_then(|mut decoded| {
                decoded.storage.set_path(path);
                decoded.storage.set_disk_cache(&options.disk_cache);
                decoded.remark_if_in_memory(options.max_in_memory_bytes);
                Self::checked(decoded, options.no_data)
            })
            .inspect(|_| options.fetcher.set_terrain_open())
            .map(|raster| Self {
                path: path.to_owned(),
                fill: options.fill.filter(|_| !options.classes),
                ..raster
            })
            .map_err(|fault| Error::new(path, fault))
    }

    /// Makes a field in memory from `height(column, row)`, with row 0 the southernmost; NaN is
    /// no-data. Cells are 1 m, heights in metres.
    ///
    /// # Errors
    /// If there are fewer than 2 × 2 samples, or no heights.
    pub fn from_fn(
        columns: u32,
        rows: u32,
        mut height: impl FnMut(u32, u32) -> f32,
    ) -> Result<Self, RasterError> {
        let mut samples = Vec::with_capacity(columns as usize * rows as usize);
        for row in 0..rows {
            samples.extend((0..columns).map(|column| height(column, row)));
        }
        let mut decoded = Decoded::new(
            "made in memory".into(),
            (columns, rows),
            Samples::from(samples),
        );
        decoded.south_up = true;
        decoded.metres_per_vertical_unit = Some(1.0);
        let metre = CellUnit::Length { metres: 1.0 };
        decoded.cell = Some(CellSize::stated((1.0, 1.0), metre, None));
        Self::checked(decoded, None)
    }

    /// Returns the same samples with another cell size.
    #[must_use]
    pub fn with_cell(mut self, cell: CellSize) -> Self {
        self.source.cell = Some(cell).filter(CellSize::is_valid);
        self
    }

    fn checked(mut source: Decoded, no_data: Option<f64>) -> Result<Self, RasterError> {
        let survey = source.check(no_data)?;
        Ok(Self {
            source,
            survey,
            fill: None,
            path: PathBuf::new(),
        })
    }

    /// Starts reading in the background the missing data of a level, in an inclusive range of
    /// columns and of rows of level 0. Returns at once, and requests 16 blocks at most.
    pub fn prefetch(&self, level: u8, columns: [u32; 2], rows: [u32; 2]) {
        let Storage::Blocks(blocks) = &self.source.storage else {
            return;
        };
        let inside = |[first, last]: [u32; 2], count: u32, turned: bool| {
            let (first, last) = (first.min(count - 1), last.min(count - 1));
            let at = |index: u32| if turned { count - 1 - index } else { index };
            let (one, other) = (at(first), at(last));
            [one.min(other), one.max(other)]
        };
        let columns = inside(columns, self.columns(), self.source.east_first);
        let rows = inside(rows, self.rows(), !self.source.south_up);
        blocks.prefetch_full(level, columns, rows);
    }

    /// Returns the number of blocks read from the file; zero if all samples are in memory.
    pub fn blocks_read(&self) -> u64 {
        match &self.source.storage {
            Storage::Memory { .. } => 0,
            Storage::Blocks(blocks) => blocks.blocks_read(),
        }
    }

    /// Returns the number of blocks in the file; zero if all samples are in memory.
    pub fn blocks(&self) -> u64 {
        match &self.source.storage {
            Storage::Memory { .. } => 0,
            Storage::Blocks(blocks) => blocks.block_count(),
        }
    }

    /// Returns true if a block of the file is being read in the background, or will be
    /// ([`Wait::Never`]). Coarse samples that are computed from the file do not count.
    pub fn is_reading(&self) -> bool {
        match &self.source.storage {
            Storage::Memory { .. } => false,
            Storage::Blocks(blocks) => blocks.is_reading(),
        }
    }

    /// Checks that every earlier waiting read was complete: results from missing heights are wrong.
    ///
    /// # Errors
    /// The reason why a height could not be read.
    pub fn check_complete(&self) -> Result<(), Error> {
        let outage = match &self.source.storage {
            Storage::Memory { .. } => None,
            Storage::Blocks(blocks) => blocks.take_outage(),
        };
        outage.map_or(Ok(()), |fault| Err(Error::new(&self.path, fault)))
    }

    /// Samples from west to east.
    pub fn columns(&self) -> u32 {
        self.source.columns
    }

    /// Samples from south to north.
    pub fn rows(&self) -> u32 {
        self.source.rows
    }

    /// Returns the height at a sample in the file's vertical unit; NaN for no-data, outside the
    /// field, and if it cannot be read at present ([`Raster::check_complete`]). Row 0 is the
    /// southernmost.
    pub fn height(&self, column: u32, row: u32) -> f64 {
        self.sample(column, row, Wait::UntilRead).0
    }

    /// Returns the height at a sample as [`Raster::height`] does, and whether it is pending.
    pub fn read_height(&self, column: u32, row: u32, wait: Wait) -> (f64, ReadStatus) {
        self.sample(column, row, wait)
    }

    /// Copies the heights of a window of level *L*, row after row, its southernmost row first, as
    /// [`Raster::read_row`] does.
    ///
    /// # Panics
    /// If the length of `heights` is not the window's number of samples.
    pub fn read_window(
        &self,
        level: u8,
        window: Window,
        heights: &mut [f32],
        wait: Wait,
    ) -> ReadStatus {
        let columns = window.columns as usize;
        assert_eq!(
            heights.len(),
            columns * window.rows as usize,
            "room for the window"
        );
        let reads = ReadTracker::default();
        let mut line = vec![0.0; columns];
        for (row, heights) in (window.row..).zip(heights.chunks_exact_mut(columns.max(1))) {
            reads.add(self.read_row(level, row, window.column, &mut line, wait));
            for (height, read) in heights.iter_mut().zip(&line) {
                *height = *read as f32;
            }
        }
        reads.status()
    }

    /// Copies heights of a row of level *L* from `first_column` eastwards until `heights` is full.
    ///
    /// Level *L* is the field with every 2ᴸ-th sample, or an overview's heights there
    /// ([`Raster::surface`]); row and column count in samples of the level.
    pub fn read_row(
        &self,
        level: u8,
        row: u32,
        first_column: u32,
        heights: &mut [f64],
        wait: Wait,
    ) -> ReadStatus {
        heights.fill(f64::NAN);
        let step = 1_u64.checked_shl(level.into()).unwrap_or(u64::MAX);
        let row = u64::from(row).saturating_mul(step);
        let reads = ReadTracker::default();
        if row >= u64::from(self.rows()) {
            return reads.status();
        }
        let columns = (u64::from(first_column)..).map(|column| column.saturating_mul(step));
        let columns = columns.take_while(|column| *column < u64::from(self.columns()));
        // Both fit: they are inside the field.
        let each = columns.map(|column| column as u32).zip(heights);
        let image = self.image_of(level);
        for (column, height) in each {
            *height = reads.record(match image {
                0 => self.sample(column, row as u32, wait),
                _ => self.surface_of(image, [f64::from(column), row as f64], wait),
            });
        }
        reads.status()
    }

    /// Returns the height at a position in columns and rows of level 0, bilinear between samples;
    /// NaN outside the field, and if a corner with a weight has no height.
    ///
    /// A raster in memory has one image for all levels. A raster in its file reads level *L* from
    /// the coarsest overview that is no coarser than *L*; without overviews, and for *L* of 3 or
    /// more, from every 8th, 64th or 512th sample.
    pub fn surface(&self, level: u8, place: [f64; 2]) -> f64 {
        self.read_surface(level, place, Wait::UntilRead).0
    }

    /// Returns the height between samples as [`Raster::surface`] does, and whether it is pending.
    pub fn read_surface(&self, level: u8, place: [f64; 2], wait: Wait) -> (f64, ReadStatus) {
        self.surface_of(self.image_of(level), place, wait)
    }

    /// As `read_surface`, for an image of the file.
    fn surface_of(&self, image: usize, [column, row]: [f64; 2], wait: Wait) -> (f64, ReadStatus) {
        let last = [self.columns(), self.rows()].map(|count| f64::from(count) - 1.0);
        if !(0.0..=last[0]).contains(&column) || !(0.0..=last[1]).contains(&row) {
            return (f64::NAN, ReadStatus::Complete);
        }
        match &self.source.storage {
            Storage::Blocks(blocks) if image > 0 => {
                let column = if self.source.east_first {
                    last[0] - column
                } else {
                    column
                };
                let row = if self.source.south_up {
                    row
                } else {
                    last[1] - row
                };
                let size = blocks.size(image);
                blocks.between(image, [column, row], |at| {
                    self.filled(at, size, |at| self.in_blocks(blocks, image, at, wait))
                })
            }
            _ => {
                let reads = ReadTracker::default();
                let height = bilinear::at([column, row], |column, row| {
                    reads.record(self.sample(column, row, wait))
                });
                (height, reads.status())
            }
        }
    }

    /// Returns the image of the file that serves a level; 0 is the full one.
    fn image_of(&self, level: u8) -> usize {
        match &self.source.storage {
            Storage::Memory { .. } => 0,
            Storage::Blocks(blocks) => blocks.image_of(level),
        }
    }

    /// Returns the level at which samples `samples` apart are best read one by one; 0 for a raster
    /// in memory, where any sample is available.
    pub fn level_for(&self, samples: f64) -> u8 {
        match self.source.storage {
            Storage::Memory { .. } => 0,
            Storage::Blocks(_) => samples.max(1.0).log2() as u8,
        }
    }

    /// Returns the height at a sample of the full image.
    fn sample(&self, column: u32, row: u32, wait: Wait) -> (f64, ReadStatus) {
        if column >= self.columns() || row >= self.rows() {
            return (f64::NAN, ReadStatus::Complete);
        }
        let at = [self.file_column(column), self.file_row(row)];
        let size = [self.columns(), self.rows()];
        self.filled(at, size, |at| match &self.source.storage {
            Storage::Memory { samples, mask } => {
                let [column, row] = at.map(u64::from);
                let index = (row * u64::from(self.columns()) + column) as usize;
                let height = match mask.as_ref().is_some_and(|mask| mask.contains(index)) {
                    true => f64::NAN,
                    false => with_samples!(samples, values => {
                        self.source.height_of(values[index].widen())
                    }),
                };
                (height, ReadStatus::Complete)
            }
            Storage::Blocks(blocks) => self.in_blocks(blocks, 0, at, wait),
        })
    }

    /// Returns the height at a sample of an image, in the file's order, filled if
    /// [`OpenOptions::fill`] is set.
    fn filled(
        &self,
        at: [u32; 2],
        size: [u32; 2],
        read: impl Fn([u32; 2]) -> (f64, ReadStatus),
    ) -> (f64, ReadStatus) {
        match self.fill {
            Some(fill) => fill.height(at, size, read),
            None => read(at),
        }
    }

    /// Returns the height at a sample of an image in blocks, in the file's order.
    fn in_blocks(
        &self,
        blocks: &Blocks,
        image: usize,
        at: [u32; 2],
        wait: Wait,
    ) -> (f64, ReadStatus) {
        blocks.height(image, at, wait, |stored| self.source.height_in_file(stored))
    }

    fn file_column(&self, column: u32) -> u32 {
        match self.source.east_first {
            true => self.columns() - 1 - column,
            false => column,
        }
    }

    fn file_row(&self, row: u32) -> u32 {
        match self.source.south_up {
            true => row,
            false => self.rows() - 1 - row,
        }
    }

    /// Returns the distance within which no-data is filled; `None` if it is not.
    pub fn fill(&self) -> Option<Fill> {
        self.fill
    }

    /// Returns the range of the heights and the number of no-data samples, before any is filled:
    /// over all samples if they are in memory, else over those read at opening.
    pub fn summary(&self) -> HeightSummary {
        self.survey.summary
    }

    /// Returns the samples in the file's own type and order; `None` if they stay in the file.
    pub fn samples(&self) -> Option<&Samples> {
        self.source.storage.in_memory()
    }

    /// Returns true if the summary covers all samples: always if they are in memory.
    pub fn is_summary_complete(&self) -> bool {
        self.samples().is_some()
    }

    /// Returns the max memory of the samples, bytes.
    pub fn memory_bytes(&self) -> usize {
        match &self.source.storage {
            Storage::Memory { samples, .. } => samples.bytes(),
            Storage::Blocks(blocks) => blocks.max_bytes(),
        }
    }

    /// Returns a hash of the file's index and of the heights read at opening, if the samples stay
    /// in the file. It depends on the fill.
    pub fn print_in_file(&self) -> Option<u64> {
        let print = self.survey.print?;
        Some(self.fill.map_or(print, |fill| fill.print_of(print)))
    }

    /// Returns the name of the format and variant, as `GeoTIFF, int16, deflate`.
    pub fn format(&self) -> &str {
        &self.source.format
    }

    /// Returns the layout of the file's samples.
    pub fn file_layout(&self) -> &FileLayout {
        &self.source.file_layout
    }

    /// Returns the stored value that means no-data, if there is one.
    pub fn no_data(&self) -> Option<f64> {
        self.source.no_data
    }

    /// Returns scale and offset: a height is a stored value × scale + offset.
    pub fn scale_and_offset(&self) -> (f64, f64) {
        (self.source.scale, self.source.offset)
    }

    /// Returns the horizontal reference system, if the file states it.
    pub fn reference_system(&self) -> Option<&ReferenceSystem> {
        self.source.system.as_ref()
    }

    /// Returns the source of the reference system.
    pub fn reference_system_from(&self) -> Certainty {
        self.source.system_from
    }

    /// Returns the outer edges of the cells around all samples, in the units of the file's
    /// coordinates, if the file states its place.
    pub fn bounds(&self) -> Option<Bounds> {
        self.source.bounds()
    }

    /// Returns the bounds in degrees of longitude and latitude, see [`Georeference::lonlat`], if
    /// the reference system is known. Longitudes continue beyond 180° if the field does.
    pub fn bounds_lonlat(&self) -> Option<Bounds> {
        self.source.bounds_lonlat()
    }

    /// Returns the zero of the heights, if the file states it.
    pub fn vertical_datum(&self) -> Option<&VerticalDatum> {
        self.source.vertical_datum.as_ref()
    }

    /// Returns the source of the vertical unit.
    pub fn vertical_unit_from(&self) -> Certainty {
        match self.source.metres_per_vertical_unit {
            Some(_) => self.source.vertical_unit_from,
            None => Certainty::Assumed,
        }
    }

    /// Returns the place of the samples in the coordinates of the file's reference system.
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

    /// Returns the same samples at a place: the south-west sample and the steps to the next column
    /// and row, in coordinates of the reference system with an EPSG code.
    #[must_use]
    pub fn with_ground(mut self, ground: GroundTransform, epsg: Option<u16>) -> Self {
        self.source.place = ground_map::GroundMap::of_samples(&ground).map(Place::new);
        self.source.system = epsg.and_then(ReferenceSystem::from_code);
        self
    }

    /// Returns the size of a cell, if the file states it.
    pub fn cell(&self) -> Option<CellSize> {
        self.source.cell
    }

    /// Returns the metres per vertical unit, if the file states it; most files state none and mean
    /// metres.
    pub fn stated_metres_per_vertical_unit(&self) -> Option<f64> {
        self.source.metres_per_vertical_unit
    }

    /// Returns the metres per vertical unit; one if the file does not state it.
    pub fn metres_per_vertical_unit(&self) -> f64 {
        self.stated_metres_per_vertical_unit().unwrap_or(1.0)
    }

    /// Returns remarks on how the file was read, one sentence each.
    pub fn remarks(&self) -> &[String] {
        &self.source.remarks
    }
}
