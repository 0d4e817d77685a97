//! An open raster.

use std::ffi::{CStr, CString, c_char};
use std::fmt;
use std::path::{Path, PathBuf};
use std::ptr;
use std::sync::Arc;

use crate::band::Band;
use crate::error::Error;
use crate::functions::Handle;
use crate::libgdal::Libgdal;
use crate::mount::{self, Mounted};
use crate::text::{from_c, list_from_c, path_to_c, to_c};

/// `GDAL_OF_RASTER | GDAL_OF_VERBOSE_ERROR`, for reading.
const OPEN_FLAGS: u32 = 0x02 | 0x40;
/// `GDAL_OF_MULTIDIM_RASTER`, for reading.
const ARRAYS: u32 = 0x10;
/// `CE_None`.
const FINE: i32 = 0;

/// Open options of all drivers.
const COMMON_OPEN_OPTIONS: [&str; 1] = ["OVERVIEW_LEVEL"];

/// An open raster, closed on drop.
pub struct Dataset {
    pub(crate) libgdal: Arc<Libgdal>,
    handle: Handle,
    /// The file system of its files, if GDAL reads them through its caller.
    files: Option<Arc<Mounted>>,
}

// SAFETY: a dataset may move to another thread if only one thread at a time uses it, as `Send`
// without `Sync` ensures.
unsafe impl Send for Dataset {}

/// One of several rasters in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Subdataset {
    /// Its name for opening it, as `NETCDF:"ocean.nc":depth`.
    pub name: String,
    /// As `[180x360] depth (32-bit floating-point)`.
    pub title: String,
}

impl Dataset {
    pub(crate) fn open(
        libgdal: Arc<Libgdal>,
        path: &Path,
        options: &[&str],
    ) -> Result<Self, Error> {
        libgdal.prepare_thread();
        let files = mounted_in(path);
        let path = path_to_c(path)?;
        let options: Result<Vec<_>, _> = options.iter().map(|option| to_c(option)).collect();
        let options = options?;
        let list = options.iter().map(|option| option.as_ptr());
        let list: Vec<*const c_char> = list.chain([ptr::null()]).collect();
        let functions = &libgdal.functions;
        // SAFETY: texts and list are valid during the call; null means all drivers, and a search
        // for siblings.
        let handle = unsafe {
            (functions.CPLErrorReset)();
            let (drivers, siblings) = (ptr::null(), ptr::null());
            (functions.GDALOpenEx)(path.as_ptr(), OPEN_FLAGS, drivers, list.as_ptr(), siblings)
        };
        if handle.is_null() {
            return Err(libgdal.refused("no driver supports the file"));
        }
        let dataset = Self {
            libgdal,
            handle,
            files,
        };
        dataset.check_options(&options)?;
        Ok(dataset)
    }

    /// Checks that the driver supports the open options: GDAL ignores unknown ones.
    fn check_options(&self, options: &[CString]) -> Result<(), Error> {
        let functions = &self.libgdal.functions;
        // SAFETY: the dataset is open, and its driver is never freed.
        let list = unsafe {
            let driver = (functions.GDALGetDatasetDriver)(self.handle);
            self.libgdal.metadata(driver, "DMD_OPENOPTIONLIST", None)?
        };
        let list = list.unwrap_or_default().replace('"', "'");
        let available = list.split("name='").skip(1);
        let available: Vec<_> = available
            .filter_map(|rest| rest.split('\'').next())
            .collect();
        for option in options {
            let option = option.to_string_lossy();
            let name = option.split('=').next().unwrap_or_default();
            let is_same = |available: &str| available.eq_ignore_ascii_case(name);
            if !COMMON_OPEN_OPTIONS
                .into_iter()
                .chain(available.iter().copied())
                .any(is_same)
            {
                return Err(Error::OpenOption {
                    name: name.to_owned(),
                    driver: self.driver(),
                    available: available.join(", "),
                });
            }
        }
        Ok(())
    }

    /// Returns the files that belong to it: its own, those beside it, and those that it references.
    #[must_use]
    pub fn files(&self) -> Vec<PathBuf> {
        let functions = &self.libgdal.functions;
        // SAFETY: the dataset is open; the list is copied, and freed once.
        let names = unsafe {
            let list = (functions.GDALGetFileList)(self.handle);
            let names = list_from_c(list.cast());
            (functions.CSLDestroy)(list);
            names
        };
        names.into_iter().map(PathBuf::from).collect()
    }

    /// Opens the same file as a tree of arrays.
    pub(crate) fn open_arrays(libgdal: Arc<Libgdal>, path: &Path) -> Result<Self, Error> {
        libgdal.prepare_thread();
        let files = mounted_in(path);
        let path = path_to_c(path)?;
        let none = ptr::null();
        // SAFETY: the path is valid during the call.
        let handle = unsafe {
            (libgdal.functions.CPLErrorReset)();
            (libgdal.functions.GDALOpenEx)(path.as_ptr(), ARRAYS, none, none, none)
        };
        match handle.is_null() {
            true => Err(libgdal.refused("it has no arrays")),
            false => Ok(Self {
                libgdal,
                handle,
                files,
            }),
        }
    }

    /// Returns the reason why GDAL could not read a file through its caller, since the last call.
    /// Samples from GDAL may then be incomplete, even without an error of GDAL.
    #[must_use]
    pub fn take_fault(&self) -> Option<std::io::Error> {
        self.files.as_ref()?.take_fault()
    }

    pub(crate) const fn handle(&self) -> Handle {
        self.handle
    }

    /// Returns the driver's short name, as `HFA`.
    #[must_use]
    pub fn driver(&self) -> String {
        let functions = &self.libgdal.functions;
        // SAFETY: the dataset is open, and its driver is never freed.
        let name = unsafe {
            let driver = (functions.GDALGetDatasetDriver)(self.handle);
            if driver.is_null() {
                return String::new();
            }
            from_c((functions.GDALGetDriverShortName)(driver))
        };
        name.unwrap_or_default()
    }

    /// Returns the number of its bands; zero for a file of several rasters
    /// ([`subdatasets`](Self::subdatasets)).
    #[must_use]
    pub fn bands(&self) -> u32 {
        // SAFETY: the dataset is open.
        let count = unsafe { (self.libgdal.functions.GDALGetRasterCount)(self.handle) };
        count.max(0) as u32
    }

    /// Returns a band by its number, from 1.
    ///
    /// # Errors
    /// [`Error::NoSuchPart`].
    pub fn band(&self, number: u32) -> Result<Band<'_>, Error> {
        let no_such = || Error::NoSuchPart {
            requested: format!("band {number}"),
            available: match self.bands() {
                0 => "the file contains no band of its own".to_owned(),
                1 => "the file has only band 1".to_owned(),
                bands => format!("the file has bands 1 to {bands}"),
            },
        };
        if number == 0 || number > self.bands() {
            return Err(no_such());
        }
        // SAFETY: the open dataset has a band of this number.
        let handle =
            unsafe { (self.libgdal.functions.GDALGetRasterBand)(self.handle, number as i32) };
        Band::of(&self.libgdal, handle).ok_or_else(no_such)
    }

    /// Returns the map from columns and rows to coordinates: x = `[0]` + column · `[1]` + row ·
    /// `[2]`, y = `[3]` + column · `[4]` + row · `[5]`, from the outer corner of the first sample's
    /// cell.
    #[must_use]
    pub fn geo_transform(&self) -> Option<[f64; 6]> {
        let mut numbers = [0.0; 6];
        // SAFETY: the array has space for six numbers.
        let status = unsafe {
            (self.libgdal.functions.GDALGetGeoTransform)(self.handle, numbers.as_mut_ptr())
        };
        (status == FINE && numbers.iter().all(|number| number.is_finite())).then_some(numbers)
    }

    /// Returns the reference system as GDAL's WKT.
    #[must_use]
    pub fn wkt(&self) -> Option<String> {
        // SAFETY: the dataset is open; the text is copied.
        unsafe { from_c((self.libgdal.functions.GDALGetProjectionRef)(self.handle)) }
    }

    /// Returns an item of its metadata, from the named domain or the default one.
    ///
    /// # Errors
    /// [`Error::ZeroByte`].
    pub fn metadata(&self, name: &str, domain: Option<&str>) -> Result<Option<String>, Error> {
        // SAFETY: the dataset is open.
        unsafe { self.libgdal.metadata(self.handle, name, domain) }
    }

    /// Returns the items of its own metadata whose names end with `end`, each with its name without
    /// `end`.
    #[must_use]
    pub fn metadata_items(&self, end: &str) -> Vec<(String, String)> {
        let lines = self.list(c"");
        let items = lines.iter().filter_map(|line| line.split_once('='));
        let items = items.filter_map(|(name, value)| {
            Some((name.strip_suffix(end)?.to_owned(), value.to_owned()))
        });
        items.collect()
    }

    /// Returns the rasters in a file of several; each can be opened by its name.
    #[must_use]
    pub fn subdatasets(&self) -> Vec<Subdataset> {
        let lines = self.list(c"SUBDATASETS");
        let value = |key: &str| {
            let mut lines = lines.iter().filter_map(|line| line.split_once('='));
            lines.find(|(name, _)| *name == key).map(|(_, value)| value)
        };
        let numbered = (1..=lines.len()).map_while(|number| {
            Some(Subdataset {
                name: value(&format!("SUBDATASET_{number}_NAME"))?.to_owned(),
                title: value(&format!("SUBDATASET_{number}_DESC"))
                    .unwrap_or_default()
                    .to_owned(),
            })
        });
        numbered.collect()
    }

    fn list(&self, domain: &CStr) -> Vec<String> {
        let functions = &self.libgdal.functions;
        // SAFETY: the dataset is open; the list is copied.
        unsafe { list_from_c((functions.GDALGetMetadata)(self.handle, domain.as_ptr())) }
    }
}

fn mounted_in(path: &Path) -> Option<Arc<Mounted>> {
    mount::at(&path.to_string_lossy()).map(|(mounted, _)| mounted)
}

impl Drop for Dataset {
    fn drop(&mut self) {
        // SAFETY: opened once, and closed once; bands borrow the dataset. The result is ignored,
        // because nothing was written.
        unsafe { (self.libgdal.functions.GDALClose)(self.handle) };
    }
}

impl fmt::Debug for Dataset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {} bands", self.driver(), self.bands())
    }
}
