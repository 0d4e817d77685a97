//! Finds libgdal, and loads it once.

use std::cell::Cell;
use std::ffi::{OsString, c_char};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use crate::error::Error;
use crate::functions::{Functions, Handle, silence_hdf5};
use crate::settings::Settings;
use crate::text::{from_c, to_c};
use crate::version::Version;

/// Environment variable with the library's path, which has priority over all other places.
const NAMED_BY: &str = "GDAL_LIBRARY";
/// Numbers of the library's interface on Linux: 30 for GDAL 3.4, and one more for each minor
/// version.
const SONAMES: std::ops::RangeInclusive<u32> = 30..=60;

/// A loaded libgdal with its functions.
pub(crate) struct Libgdal {
    pub(crate) functions: Functions,
    pub(crate) path: PathBuf,
    pub(crate) version: Version,
    // Last, because the functions belong to it.
    library: libloading::Library,
}

thread_local! {
    /// True if HDF5 is silenced on this thread.
    static IS_SILENT: Cell<bool> = const { Cell::new(false) };
}

impl Libgdal {
    /// Loads the library, or returns the loaded one.
    pub(crate) fn load(settings: Settings) -> Result<Arc<Self>, Error> {
        static LOADED: Mutex<Option<Arc<Libgdal>>> = Mutex::new(None);
        let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(library) = &*loaded {
            return Ok(library.clone());
        }
        let (library, path) = found(std::env::var_os(NAMED_BY))?;
        let library = Arc::new(Self::of(library, path, settings)?);
        *loaded = Some(library.clone());
        Ok(library)
    }

    fn of(library: libloading::Library, path: PathBuf, settings: Settings) -> Result<Self, Error> {
        let incomplete = |function| Error::Incomplete {
            path: path.clone(),
            function,
        };
        // SAFETY: the library is libgdal by its file name, or by the user's statement.
        let number = unsafe { version_number(&library) }.map_err(incomplete)?;
        let version = number.parse().map(Version::of);
        let version = match version {
            Ok(version) if version >= Version::OLDEST => version,
            _ => {
                let version = version.map_or(number, |version| version.to_string());
                return Err(Error::Version { path, version });
            }
        };
        // SAFETY: as above; it is stored beside the functions.
        let functions = unsafe { Functions::of(&library) }.map_err(incomplete)?;
        settings.apply(&functions)?;
        // SAFETY: called once, before anything is opened.
        unsafe { (functions.GDALAllRegister)() };
        Ok(Self {
            functions,
            path,
            version,
            library,
        })
    }

    /// Prepares the current thread for calls that open or read.
    pub(crate) fn prepare_thread(&self) {
        if !IS_SILENT.replace(true) {
            // SAFETY: the library is GDAL's.
            unsafe { silence_hdf5(&self.library) };
        }
    }

    /// Returns an error with GDAL's last message on this thread.
    pub(crate) fn refused(&self, otherwise: &str) -> Error {
        // SAFETY: the text is valid until the next call on this thread, and is copied.
        let message = unsafe { from_c((self.functions.CPLGetLastErrorMsg)()) };
        let message = message.unwrap_or_else(|| otherwise.to_owned());
        // The text may quote the file, and must not control a terminal.
        let plain = |c: char| match c {
            '\n' | '\t' => ' ',
            c if c.is_control() => '\u{fffd}',
            c => c,
        };
        Error::Refused(message.trim().chars().map(plain).collect())
    }

    /// Returns an item of the metadata of a dataset or band.
    ///
    /// # Safety
    /// The handle belongs to an open dataset.
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
        // SAFETY: the texts are valid during the call; the result is copied.
        Ok(unsafe {
            from_c((self.functions.GDALGetMetadataItem)(
                of,
                name.as_ptr(),
                domain,
            ))
        })
    }
}

/// Returns GDAL's version number, as 3060200.
///
/// # Safety
/// The library is GDAL's.
unsafe fn version_number(library: &libloading::Library) -> Result<String, &'static str> {
    type VersionInfo = unsafe extern "C" fn(*const c_char) -> *const c_char;
    const NAME: &str = "GDALVersionInfo";
    // SAFETY: the type is that of GDAL's headers; the returned text is static, and is copied.
    unsafe {
        let info: libloading::Symbol<'_, VersionInfo> = library.get(NAME).map_err(|_| NAME)?;
        Ok(from_c(info(c"VERSION_NUM".as_ptr())).unwrap_or_default())
    }
}

/// Loads the named library, or the first that exists.
fn found(named: Option<OsString>) -> Result<(libloading::Library, PathBuf), Error> {
    let candidates = match named {
        Some(named) => vec![PathBuf::from(named)],
        None => candidates(std::env::var_os("CONDA_PREFIX")),
    };
    let mut tried = String::new();
    for path in candidates {
        // SAFETY: during loading, libgdal only registers itself.
        match unsafe { libloading::Library::new(&path) } {
            Ok(library) => return Ok((library, path)),
            Err(error) => tried = error.to_string(),
        }
    }
    Err(Error::NotFound { tried })
}

/// Returns the possible paths of libgdal, in search order.
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
