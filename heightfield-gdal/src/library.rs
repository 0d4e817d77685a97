//! Finds libgdal, loads it once, and lists its drivers.

use std::cell::Cell;
use std::ffi::{OsString, c_char};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use crate::beforehand;
use crate::dataset::Dataset;
use crate::error::Error;
use crate::file_system::PREFIX;
use crate::functions::{Functions, Handle, silence_hdf5};
use crate::in_time;
use crate::settings::Settings;
use crate::srs::SpatialReference;
use crate::text::{from_c, to_c};

/// Names the library itself, before all places where it is looked for.
const NAMED_BY: &str = "GDAL_LIBRARY";
/// Numbers of the library's interface on Linux, newest first: 3.4 has 30, and each minor version
/// one more.
const SONAMES: std::ops::RangeInclusive<u32> = 30..=60;
/// A version of GDAL.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Version {
    /// 3 of 3.6.2.
    pub major: u32,
    /// 6 of 3.6.2.
    pub minor: u32,
    /// 2 of 3.6.2.
    pub patch: u32,
}

impl Version {
    /// The oldest that is read.
    pub const OLDEST: Self = Self {
        major: 3,
        minor: 4,
        patch: 0,
    };

    /// GDAL's number, as 3060200.
    fn of(number: u32) -> Self {
        Self {
            major: number / 1_000_000,
            minor: number / 10_000 % 100,
            patch: number / 100 % 100,
        }
    }
}

impl fmt::Display for Version {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}.{}", self.major, self.minor, self.patch)
    }
}

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

/// The loaded library.
pub(crate) struct Loaded {
    pub(crate) functions: Functions,
    path: PathBuf,
    version: Version,
    // Last: the functions are its.
    library: libloading::Library,
}

impl Library {
    /// Loads libgdal: the one that the environment variable `GDAL_LIBRARY` names, else that of an
    /// active conda environment, else the newest that the system finds. Once it is loaded the same
    /// one is given again.
    ///
    /// # Errors
    /// [`Error::NotFound`], [`Error::Version`], [`Error::Incomplete`]. The next call tries again.
    pub fn load(settings: Settings) -> Result<Self, Error> {
        static LOADED: Mutex<Option<Library>> = Mutex::new(None);
        let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(library) = &*loaded {
            return Ok(library.clone());
        }
        let (library, path) = found(std::env::var_os(NAMED_BY))?;
        let library = Self::of(library, path, settings)?;
        *loaded = Some(library.clone());
        Ok(library)
    }

    fn of(library: libloading::Library, path: PathBuf, settings: Settings) -> Result<Self, Error> {
        let incomplete = |function| Error::Incomplete {
            path: path.clone(),
            function,
        };
        // SAFETY: it calls itself libgdal, or the user does.
        let number = unsafe { version_number(&library) }.map_err(incomplete)?;
        let version = number.parse().map(Version::of);
        let version = match version {
            Ok(version) if version >= Version::OLDEST => version,
            _ => {
                let version = version.map_or(number, |version| version.to_string());
                return Err(Error::Version { path, version });
            }
        };
        // SAFETY: as above; it is kept beside the functions.
        let functions = unsafe { Functions::of(&library) }.map_err(incomplete)?;
        settings.apply(&functions)?;
        // SAFETY: once, before anything is opened.
        unsafe { (functions.GDALAllRegister)() };
        Ok(Self {
            loaded: Arc::new(Loaded {
                functions,
                path,
                version,
                library,
            }),
        })
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
        beforehand::check(self, path)?;
        in_time::open(&self.loaded, path, options)
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
        let dataset = in_time::open(&self.loaded, Path::new(name), options)?;
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

thread_local! {
    /// True if HDF5 is silent on this thread.
    static IS_SILENT: Cell<bool> = const { Cell::new(false) };
}

impl Loaded {
    /// Prepares the present thread for calls that open or read.
    pub(crate) fn prepare_thread(&self) {
        if !IS_SILENT.replace(true) {
            // SAFETY: the library is GDAL's.
            unsafe { silence_hdf5(&self.library) };
        }
    }

    /// An error in the words that GDAL said last on this thread.
    pub(crate) fn refused(&self, otherwise: &str) -> Error {
        // SAFETY: the text stays until the next call on this thread, and is copied.
        let said = unsafe { from_c((self.functions.CPLGetLastErrorMsg)()) };
        let said = said.unwrap_or_else(|| otherwise.to_owned());
        // What a file says comes along: it must not steer a terminal.
        let plain = |c: char| match c {
            '\n' | '\t' => ' ',
            c if c.is_control() => '\u{fffd}',
            c => c,
        };
        Error::Refused(said.trim().chars().map(plain).collect())
    }

    /// An item of the metadata of a dataset or band.
    ///
    /// # Safety
    /// The handle is of an open dataset.
    pub(crate) unsafe fn metadata(
        &self,
        of: Handle,
        name: &str,
        domain: Option<&str>,
    ) -> Result<Option<String>, Error> {
        let (name, domain) = (to_c(name)?, domain.map(to_c).transpose()?);
        let domain = domain
            .as_ref()
            .map_or(std::ptr::null(), |domain| domain.as_ptr());
        // SAFETY: the texts stay for the call; what is given is copied.
        Ok(unsafe {
            from_c((self.functions.GDALGetMetadataItem)(
                of,
                name.as_ptr(),
                domain,
            ))
        })
    }
}

/// GDAL's number of its version, as 3060200.
///
/// # Safety
/// The library is GDAL's.
unsafe fn version_number(library: &libloading::Library) -> Result<String, &'static str> {
    type VersionInfo = unsafe extern "C" fn(*const c_char) -> *const c_char;
    const NAME: &str = "GDALVersionInfo";
    // SAFETY: the type is that of GDAL's headers; the text that GDAL gives stays, and is copied.
    unsafe {
        let info: libloading::Symbol<'_, VersionInfo> = library.get(NAME).map_err(|_| NAME)?;
        Ok(from_c(info(c"VERSION_NUM".as_ptr())).unwrap_or_default())
    }
}

/// The library that is named, or the first that is there.
fn found(named: Option<OsString>) -> Result<(libloading::Library, PathBuf), Error> {
    let candidates = match named {
        Some(named) => vec![PathBuf::from(named)],
        None => candidates(std::env::var_os("CONDA_PREFIX")),
    };
    let mut tried = String::new();
    for path in candidates {
        // SAFETY: what libgdal does while it is loaded is registering itself.
        match unsafe { libloading::Library::new(&path) } {
            Ok(library) => return Ok((library, path)),
            Err(error) => tried = error.to_string(),
        }
    }
    Err(Error::NotFound { tried })
}

/// Returns the possible paths of libgdal, in the order of attempts.
fn candidates(conda: Option<OsString>) -> Vec<PathBuf> {
    let conda = conda.map(PathBuf::from);
    let mut paths = Vec::new();
    if cfg!(windows) {
        paths.extend(conda.map(|home| home.join("Library").join("bin").join("gdal.dll")));
        paths.extend(["gdal.dll", r"C:\OSGeo4W\bin\gdal.dll"].map(PathBuf::from));
        let numbered = (304..=340).rev().map(|of| format!("gdal{of}.dll"));
        paths.extend(numbered.map(PathBuf::from));
    } else if cfg!(target_os = "macos") {
        paths.extend(conda.map(|home| home.join("lib/libgdal.dylib")));
        let homes = ["/opt/homebrew/lib", "/usr/local/lib", "/opt/local/lib"];
        paths.push("libgdal.dylib".into());
        paths.extend(homes.map(|home| Path::new(home).join("libgdal.dylib")));
    } else {
        paths.extend(conda.map(|home| home.join("lib/libgdal.so")));
        let numbered = SONAMES.rev().map(|of| format!("libgdal.so.{of}"));
        paths.extend(numbered.map(PathBuf::from));
        paths.push("libgdal.so".into());
    }
    paths
}
