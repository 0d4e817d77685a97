//! All of GDAL's own settings.

use std::ffi::c_void;
use std::hash::{BuildHasher, Hasher, RandomState};

use crate::error::Error;
use crate::functions::Functions;
use crate::text::to_c;

/// Drivers that contact a server or a database themselves.
const SKIPPED: &str = "HTTP WMS WMTS WCS EEDA EEDAI PLMOSAIC PLScenes NGW OGCAPI DAAS \
                       PostGISRaster GeoRaster";

/// Setting for the URLs that GDAL may fetch, by their endings.
const FETCHED_EXTENSIONS: &str = "CPL_VSIL_CURL_ALLOWED_EXTENSIONS";

/// Settings of GDAL. They apply to the whole process: those of the first load are used.
///
/// | GDAL setting | value | effect |
/// |---|---|---|
/// | `GDAL_CACHEMAX` | [`cache_bytes`](Self::cache_bytes) | its cache is bounded |
/// | `GDAL_MAX_DATASET_POOL_SIZE` | 64 | a VRT opens few files at once |
/// | `GDAL_NUM_THREADS` | 1 | it decodes on the caller's thread |
/// | `GDAL_VRT_ENABLE_PYTHON` | `NO` | a VRT runs no program |
/// | `GDAL_SKIP` | drivers of servers and databases | a file causes no network access |
/// | `CPL_VSIL_CURL_ALLOWED_EXTENSIONS` | none, unless set in the environment | the same |
/// | `CPL_VSIL_GZIP_WRITE_PROPERTIES` | `NO` | no file is written beside an archive |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Max size of GDAL's block cache, bytes.
    pub cache_bytes: u64,
}

impl Default for Settings {
    /// Returns 64 MiB for the cache.
    fn default() -> Self {
        Self {
            cache_bytes: 64 << 20,
        }
    }
}

/// Returns true if the user's environment defines which URLs may be fetched.
pub(crate) fn is_fetching_allowed() -> bool {
    std::env::var_os(FETCHED_EXTENSIONS).is_some()
}

impl Settings {
    /// Sets the options, before drivers are registered.
    pub(crate) fn apply(self, functions: &Functions) -> Result<(), Error> {
        // The number is random, so no URL ends like this.
        let number = RandomState::new().build_hasher().finish();
        let unused = format!(".nothing-is-fetched-{number:016x}");
        let cache = format!("{}MB", (self.cache_bytes >> 20).max(1));
        let mut options = vec![
            ("GDAL_CACHEMAX", cache.as_str()),
            ("GDAL_MAX_DATASET_POOL_SIZE", "64"),
            ("GDAL_NUM_THREADS", "1"),
            ("GDAL_VRT_ENABLE_PYTHON", "NO"),
            ("GDAL_SKIP", SKIPPED),
            ("CPL_VSIL_GZIP_WRITE_PROPERTIES", "NO"),
        ];
        if !is_fetching_allowed() {
            options.push((FETCHED_EXTENSIONS, unused.as_str()));
        }
        for (name, value) in options {
            let (name, value) = (to_c(name)?, to_c(value)?);
            // SAFETY: GDAL copies both.
            unsafe { (functions.CPLSetConfigOption)(name.as_ptr(), value.as_ptr()) };
        }
        let quiet = functions.CPLQuietErrorHandler as *const c_void;
        // SAFETY: GDAL's own handler, which prints nothing.
        unsafe { (functions.CPLSetErrorHandler)(quiet) };
        Ok(())
    }
}
