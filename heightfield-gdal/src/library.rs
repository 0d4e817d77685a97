//! A libgdal: its drivers, and the rasters that it opens.

use std::fmt;
use std::path::Path;
use std::sync::Arc;

use crate::dataset::Dataset;
use crate::error::Error;
use crate::file_system::{FileSystem, PREFIX};
use crate::libgdal::Libgdal;
use crate::mount::{Mount, Mounted};
use crate::settings::Settings;
use crate::srs::SpatialReference;
use crate::text::from_c;
use crate::version::Version;
use crate::{callbacks, open_timeout, path_check};

/// A GDAL driver that reads rasters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Driver {
    /// As `HFA`.
    pub name: String,
    /// As `Erdas Imagine Images (.img)`.
    pub title: String,
}

/// A loaded libgdal, which stays loaded until the process ends. Clones share it.
#[derive(Clone)]
pub struct Library {
    pub(crate) libgdal: Arc<Libgdal>,
}

impl Library {
    /// Loads libgdal: from the environment variable `GDAL_LIBRARY`, else from an active conda
    /// environment, else the newest that the system finds. Later calls return the same one.
    ///
    /// # Errors
    /// [`Error::NotFound`], [`Error::Version`], [`Error::Incomplete`]. The next call retries.
    pub fn load(settings: Settings) -> Result<Self, Error> {
        let libgdal = Libgdal::load(settings)?;
        Ok(Self { libgdal })
    }

    /// Returns its path, or its name in the system.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.libgdal.path
    }

    /// Returns its version.
    #[must_use]
    pub fn version(&self) -> Version {
        self.libgdal.version
    }

    /// Returns the drivers that read rasters, in GDAL's order.
    #[must_use]
    pub fn drivers(&self) -> Vec<Driver> {
        let functions = &self.libgdal.functions;
        // SAFETY: drivers are numbered from 0, and are never freed.
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
    /// [`Error::Refused`] with GDAL's message, [`Error::NotOpened`], [`Error::OpenOption`],
    /// [`Error::Slow`], [`Error::ZeroByte`].
    pub fn open(&self, path: &Path, options: &[&str]) -> Result<Dataset, Error> {
        path_check::check(&self.libgdal, path)?;
        open_timeout::open(&self.libgdal, path, options)
    }

    /// Lets GDAL read files through this crate's user.
    ///
    /// # Errors
    /// [`Error::Refused`].
    pub fn mount(&self, files: Box<dyn FileSystem>) -> Result<Mount, Error> {
        callbacks::install(&self.libgdal)?;
        Ok(Mount(Mounted::new(self.libgdal.clone(), files)))
    }

    /// Returns a reference system by its text.
    ///
    /// # Errors
    /// [`Error::Refused`] with GDAL's message, also if it is neither geographic nor projected;
    /// [`Error::ZeroByte`].
    pub fn reference_of_text(&self, text: &str) -> Result<SpatialReference, Error> {
        SpatialReference::of_text(&self.libgdal, text)
    }

    /// Returns a reference system by its EPSG code.
    ///
    /// # Errors
    /// [`Error::Refused`] with GDAL's message.
    pub fn reference_of_epsg(&self, code: u16) -> Result<SpatialReference, Error> {
        SpatialReference::of_epsg(&self.libgdal, code)
    }

    /// Opens a part by a driver's or an archive's name, as `NETCDF:"ocean.nc":depth` of an open
    /// file, or `/vsizip/{tiles.zip}/a.tif`.
    ///
    /// # Errors
    /// As [`open`](Self::open), but without checks before opening.
    pub fn open_part(&self, name: &str, options: &[&str]) -> Result<Dataset, Error> {
        let dataset = open_timeout::open(&self.libgdal, Path::new(name), options)?;
        // A VRT on disk is checked before; in an archive, it could reference pipes, devices and
        // URLs.
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
