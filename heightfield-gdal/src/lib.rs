//! Rasters of every format that GDAL reads, block by block, through a libgdal that is found when
//! the program runs. Nothing is linked: a program builds and starts without GDAL.
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
//! - [`Dataset`]: a file, a folder or whatever else a driver opens, for reading;
//! - [`Library::mount`]: has GDAL read files through their caller, as those at a server;
//! - [`Library::entries`], [`Library::length`]: what is in an archive;
//! - [`Band`]: its samples, overviews and masks, and what they mean;
//! - [`SpatialReference`]: a reference system by its text or code, as PROJ knows it.
//!
//! A dataset is used by one thread at a time, and may go from thread to thread. A call takes as long
//! as GDAL takes: no thread that must not wait may read.
//!
//! Before a file is opened, it, what lies beside it and what it names as a VRT are looked at: pipes
//! and devices are refused ([`Error::NotOpened`]). [`Settings`] lists GDAL's own settings.

mod axes;
mod band;
mod callbacks;
mod dataset;
mod error;
mod file_system;
mod functions;
mod library;
mod loaded;
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
