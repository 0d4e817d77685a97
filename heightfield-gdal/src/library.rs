//! A libgdal: its drivers, and what it opens.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use crate::dataset::Dataset;
use crate::error::Error;
use crate::file_system::{FileSystem, PREFIX};
use crate::loaded::Loaded;
use crate::mount::{Mount, Mounted};
use crate::settings::Settings;
use crate::srs::SpatialReference;
use crate::text::from_c;
use crate::version::Version;
use crate::{callbacks, open_timeout, path_check};

/// A driver of GDAL's that reads rasters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Driver {
    /// As `HFA`.
    pub name: String,
    /// As `Erdas Imagine Images (.img)`.
    pub title: String,
}

/// A libgdal that is loaded; it stays loaded until the process ends. Clones are the same one.
#[derive(Clone)]
pub struct Library {
    pub(crate) loaded: Arc<Loaded>,
}

impl Library {
    /// Loads libgdal: the one that the environment variable `GDAL_LIBRARY` names, else that of an
    /// active conda environment, else the newest that the system finds. Once it is loaded the same
    /// one is given again.
    ///
    /// # Errors
    /// [`Error::NotFound`], [`Error::Version`], [`Error::Incomplete`]. The next call tries again.
    pub fn load(settings: Settings) -> Result<Self, Error> {
        let loaded = Loaded::load(settings)?;
        Ok(Self { loaded })
    }

    /// Returns its path, or its name in the system.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.loaded.path
    }

    /// Its version.
    #[must_use]
    pub fn version(&self) -> Version {
        self.loaded.version
    }

    /// The drivers that read rasters, in GDAL's order.
    #[must_use]
    pub fn drivers(&self) -> Vec<Driver> {
        let functions = &self.loaded.functions;
        // SAFETY: drivers are counted from 0, and stay.
        let count = unsafe { (functions.GDALGetDriverCount)() };
        let drivers = (0..count).filter_map(|number| {
            // SAFETY: as above; texts are copied.
            unsafe {
                let driver = (functions.GDALGetDriver)(number);
                if driver.is_null() {
                    return None;
                }
                let raster = c"DCAP_RASTER".as_ptr();
                from_c((functions.GDALGetMetadataItem)(
                    driver,
                    raster,
                    std::ptr::null(),
                ))?;
                Some(Driver {
                    name: from_c((functions.GDALGetDriverShortName)(driver))?,
                    title: from_c((functions.GDALGetDriverLongName)(driver)).unwrap_or_default(),
                })
            }
        });
        drivers.collect()
    }

    /// Opens a raster for reading, with a driver's open options, each as `NAME=VALUE`.
    ///
    /// # Errors
    /// [`Error::Refused`] in GDAL's words, [`Error::NotOpened`], [`Error::OpenOption`],
    /// [`Error::Slow`], [`Error::ZeroByte`].
    pub fn open(&self, path: &Path, options: &[&str]) -> Result<Dataset, Error> {
        path_check::check(&self.loaded, path)?;
        open_timeout::open(&self.loaded, path, options)
    }

    /// Has GDAL read files through their caller.
    ///
    /// # Errors
    /// [`Error::Refused`].
    pub fn mount(&self, files: Box<dyn FileSystem>) -> Result<Mount, Error> {
        callbacks::install(&self.loaded)?;
        Ok(Mount(Mounted::new(self.loaded.clone(), files)))
    }

    /// A reference system by its text.
    ///
    /// # Errors
    /// [`Error::Refused`] in GDAL's words, also where it is neither geographic nor projected;
    /// [`Error::ZeroByte`].
    pub fn reference_of_text(&self, text: &str) -> Result<SpatialReference, Error> {
        SpatialReference::of_text(&self.loaded, text)
    }

    /// A reference system by its code of EPSG's.
    ///
    /// # Errors
    /// [`Error::Refused`] in GDAL's words.
    pub fn reference_of_epsg(&self, code: u16) -> Result<SpatialReference, Error> {
        SpatialReference::of_epsg(&self.loaded, code)
    }

    /// Opens what a driver or an archive names, as `NETCDF:"ocean.nc":depth` of a file that was
    /// opened, or `/vsizip/{tiles.zip}/a.tif`.
    ///
    /// # Errors
    /// As [`open`](Self::open), but nothing is looked at before.
    pub fn open_part(&self, name: &str, options: &[&str]) -> Result<Dataset, Error> {
        let dataset = open_timeout::open(&self.loaded, Path::new(name), options)?;
        // One on disk is looked into; here, it may name pipes, devices and addresses.
        let is_in_archive = name.starts_with("/vsi") && !name.starts_with(PREFIX);
        match is_in_archive && dataset.driver() == "VRT" {
            true => Err(Error::NotOpened {
                path: name.into(),
                why: "a VRT inside an archive may name any file: unpack the archive".into(),
            }),
            false => Ok(dataset),
        }
    }
}

impl fmt::Debug for Library {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "GDAL {} ({})", self.version(), self.path().display())
    }
}
