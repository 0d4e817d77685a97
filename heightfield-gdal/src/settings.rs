//! GDAL's own settings, all of them in one place.

use std::ffi::c_void;
use std::hash::{BuildHasher, Hasher, RandomState};

use crate::error::Error;
use crate::functions::Functions;
use crate::text::to_c;

/// Drivers that ask a server or a data base by themselves.
const SKIPPED: &str = "HTTP WMS WMTS WCS EEDA EEDAI PLMOSAIC PLScenes NGW OGCAPI DAAS \
                       PostGISRaster GeoRaster";

/// Which addresses GDAL may fetch, by how they end.
const FETCHED: &str = "CPL_VSIL_CURL_ALLOWED_EXTENSIONS";

/// Settings of GDAL. They are one for the process: those of the first that loads it hold.
///
/// | of GDAL | set to | so that |
/// |---|---|---|
/// | `GDAL_CACHEMAX` | [`cache_bytes`](Self::cache_bytes) | its cache is bounded |
/// | `GDAL_MAX_DATASET_POOL_SIZE` | 64 | a VRT opens few files at once |
/// | `GDAL_NUM_THREADS` | 1 | it decodes on the caller's thread |
/// | `GDAL_VRT_ENABLE_PYTHON` | `NO` | a VRT runs no program |
/// | `GDAL_SKIP` | drivers of servers and data bases | a file leads to no network |
/// | `CPL_VSIL_CURL_ALLOWED_EXTENSIONS` | none, unless the environment has it | the same |
/// | `CPL_VSIL_GZIP_WRITE_PROPERTIES` | `NO` | nothing is written beside an archive |
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Settings {
    /// Bytes of blocks that GDAL keeps.
    pub cache_bytes: u64,
}

impl Default for Settings {
    /// 64 MiB.
    fn default() -> Self {
        Self {
            cache_bytes: 64 << 20,
        }
    }
}

/// Returns true if the user's environment says what may be fetched.
pub(crate) fn is_fetching_allowed() -> bool {
    std::env::var_os(FETCHED).is_some()
}

impl Settings {
    /// Sets them, before drivers are registered.
    pub(crate) fn apply(self, functions: &Functions) -> Result<(), Error> {
        // No address ends so: the number is random.
        let number = RandomState::new().build_hasher().finish();
        let nothing = format!(".nothing-is-fetched-{number:016x}");
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
            options.push((FETCHED, nothing.as_str()));
        }
        for (name, value) in options {
            let (name, value) = (to_c(name)?, to_c(value)?);
            // SAFETY: both are copied by GDAL.
            unsafe { (functions.CPLSetConfigOption)(name.as_ptr(), value.as_ptr()) };
        }
        let quiet = functions.CPLQuietErrorHandler as *const c_void;
        // SAFETY: GDAL's own handler, which says nothing on standard error.
        unsafe { (functions.CPLSetErrorHandler)(quiet) };
        Ok(())
    }
}
