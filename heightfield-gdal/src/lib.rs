//! Rasters of every format that GDAL reads, in blocks, through a libgdal that is loaded at run
//! time. Nothing is linked: a program can be built and started without GDAL.
//!
//! ```no_run
//! use heightfield_gdal::{Library, Settings, Window};
//!
//! let gdal = Library::load(Settings::default())?;
//! let dataset = gdal.open("dem.img".as_ref(), &[])?;
//! let band = dataset.band(1)?;
//! let [columns, rows] = band.block_size();
//! let mut heights = vec![0.0_f32; (columns * rows) as usize];
//! band.read(Window { column: 0, row: 0, columns, rows }, &mut heights)?;
//! # Ok::<(), heightfield_gdal::Error>(())
//! ```
//!
//! - [`Library`]: finds and loads libgdal, versions 3.4 and newer, and lists its drivers;
//! - [`Dataset`]: a file, a folder or other source that a driver opens, for reading;
//! - [`Library::mount`]: makes GDAL read files through this crate's user, such as files on a
//!   server;
//! - [`Library::entries`], [`Library::length`]: the contents of an archive;
//! - [`Band`]: its samples, overviews and masks, and their meaning;
//! - [`SpatialReference`]: a reference system from PROJ, by its text or code.
//!
//! A dataset is used by one thread at a time, and may move between threads. Calls block until GDAL
//! returns, so real-time threads must not read.
//!
//! Before a file is opened, the file, its neighbours and the files that a VRT references are
//! checked: pipes and devices are rejected ([`Error::NotOpened`]). [`Settings`] lists GDAL's own
//! settings.

mod axes;
mod band;
mod callbacks;
mod dataset;
mod error;
mod file_system;
mod functions;
mod libgdal;
mod library;
mod mount;
mod mrf;
mod open_timeout;
mod path_check;
mod pending_calls;
mod settings;
mod srs;
mod text;
mod version;
mod virtual_files;
mod vrt;
mod xml;

pub use axes::Axis;
pub use band::{Band, Mask, Sample, SampleType, Window};
pub use dataset::{Dataset, Subdataset};
pub use error::Error;
pub use file_system::{FileSystem, ReadAt};
pub use library::{Driver, Library};
pub use mount::Mount;
pub use pending_calls::exit_if_stuck;
pub use settings::Settings;
pub use srs::{AxisUnit, SpatialReference};
pub use version::Version;
