//! The functions of GDAL's C interface that this crate calls, with the types of its headers
//! (`gdal.h`, `ogr_srs_api.h`, `cpl_error.h`, `cpl_conv.h`, `cpl_minixml.h`, `cpl_vsi.h`),
//! unchanged since 3.4.

use std::ffi::{c_char, c_double, c_int, c_uint, c_void};

/// A `GDALDatasetH`, `GDALRasterBandH` or `GDALDriverH`; GDAL's common type is `GDALMajorObjectH`.
pub(crate) type Handle = *mut c_void;

/// Stops HDF5 from printing its errors on this thread: GDAL also reports the important ones. It has
/// no effect if libgdal has no HDF5, or hides it.
///
/// # Safety
/// The library is GDAL's.
pub(crate) unsafe fn silence_hdf5(library: &libloading::Library) {
    type SetAuto = unsafe extern "C" fn(i64, *const c_void, *const c_void) -> c_int;
    // SAFETY: the type is that of HDF5's headers since 1.10; 0 is the default error stack.
    unsafe {
        if let Ok(set) = library.get::<SetAuto>("H5Eset_auto2") {
            set(0, std::ptr::null(), std::ptr::null());
        }
    }
}

/// A node of XML, from `cpl_minixml.h`.
#[repr(C)]
pub(crate) struct XmlNode {
    /// `CXT_Element` and so on.
    pub(crate) kind: c_int,
    /// An element's or attribute's name, or a text.
    pub(crate) value: *const c_char,
    pub(crate) next: *const XmlNode,
    pub(crate) child: *const XmlNode,
}

/// A file's kind and size, as `VSIStatBufL`.
#[cfg(any(target_os = "linux", target_os = "android"))]
pub(crate) type Stat = libc::stat64;
/// A file's kind and size, as `VSIStatBufL`.
#[cfg(not(any(target_os = "linux", target_os = "android")))]
pub(crate) type Stat = libc::stat;

/// The first fields of `VSIFilesystemPluginCallbacksStruct` of `cpl_vsi.h`. Newer versions add
/// fields at the end, so GDAL itself allocates it, with zeroed fields.
#[repr(C)]
pub(crate) struct Callbacks {
    pub(crate) user_data: *mut c_void,
    pub(crate) stat:
        Option<unsafe extern "C" fn(*mut c_void, *const c_char, *mut Stat, c_int) -> c_int>,
    /// `unlink`, `rename`, `mkdir`, `rmdir`, `read_dir`: files are read-only, and folders are not
    /// listed.
    of_folders: [*const c_void; 5],
    pub(crate) open:
        Option<unsafe extern "C" fn(*mut c_void, *const c_char, *const c_char) -> *mut c_void>,
    pub(crate) tell: Option<unsafe extern "C" fn(*mut c_void) -> u64>,
    pub(crate) seek: Option<unsafe extern "C" fn(*mut c_void, u64, c_int) -> c_int>,
    pub(crate) read: Option<unsafe extern "C" fn(*mut c_void, *mut c_void, usize, usize) -> usize>,
    /// `read_multi_range`, `get_range_status`.
    of_ranges: [*const c_void; 2],
    pub(crate) eof: Option<unsafe extern "C" fn(*mut c_void) -> c_int>,
    /// `write`, `flush`, `truncate`.
    of_writing: [*const c_void; 3],
    pub(crate) close: Option<unsafe extern "C" fn(*mut c_void) -> c_int>,
    /// `nBufferSize`, `nCacheSize`: GDAL does not cache the files.
    of_caching: [usize; 2],
    pub(crate) sibling_files:
        Option<unsafe extern "C" fn(*mut c_void, *const c_char) -> *mut *mut c_char>,
}

macro_rules! functions {
    ($($name:ident: ($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// Each function by its C name.
        #[allow(non_snake_case)]
        pub(crate) struct Functions {
            $(pub(crate) $name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
        }

        impl Functions {
            /// Loads all functions.
            ///
            /// # Errors
            /// The name of the first missing one.
            ///
            /// # Safety
            /// The library is GDAL's, and stays loaded while the functions are used.
            pub(crate) unsafe fn of(library: &libloading::Library) -> Result<Self, &'static str> {
                Ok(Self {
                    // SAFETY: the types are those of GDAL's headers.
                    $($name: unsafe {
                        *library.get(stringify!($name)).map_err(|_| stringify!($name))?
                    },)*
                })
            }
        }
    };
}

functions! {
    CPLSetConfigOption: (*const c_char, *const c_char);
    CPLSetErrorHandler: (*const c_void) -> *const c_void;
    CPLQuietErrorHandler: (c_int, c_int, *const c_char);
    CPLErrorReset: ();
    CPLGetLastErrorMsg: () -> *const c_char;
    GDALAllRegister: ();
    GDALGetDriverCount: () -> c_int;
    GDALGetDriver: (c_int) -> Handle;
    GDALGetDriverShortName: (Handle) -> *const c_char;
    GDALGetDriverLongName: (Handle) -> *const c_char;
    GDALGetMetadataItem: (Handle, *const c_char, *const c_char) -> *const c_char;
    GDALGetMetadata: (Handle, *const c_char) -> *const *const c_char;
    GDALGetDescription: (Handle) -> *const c_char;
    GDALOpenEx: (*const c_char, c_uint, *const *const c_char, *const *const c_char, *const *const c_char) -> Handle;
    GDALClose: (Handle) -> c_int;
    GDALGetDatasetDriver: (Handle) -> Handle;
    GDALGetRasterCount: (Handle) -> c_int;
    GDALGetGeoTransform: (Handle, *mut c_double) -> c_int;
    GDALGetProjectionRef: (Handle) -> *const c_char;
    GDALGetRasterBand: (Handle, c_int) -> Handle;
    GDALGetRasterBandXSize: (Handle) -> c_int;
    GDALGetRasterBandYSize: (Handle) -> c_int;
    GDALGetBlockSize: (Handle, *mut c_int, *mut c_int);
    GDALGetRasterDataType: (Handle) -> c_int;
    GDALGetDataTypeName: (c_int) -> *const c_char;
    GDALGetRasterNoDataValue: (Handle, *mut c_int) -> c_double;
    GDALGetRasterScale: (Handle, *mut c_int) -> c_double;
    GDALGetRasterOffset: (Handle, *mut c_int) -> c_double;
    GDALGetRasterUnitType: (Handle) -> *const c_char;
    GDALGetOverviewCount: (Handle) -> c_int;
    GDALGetOverview: (Handle, c_int) -> Handle;
    GDALGetMaskFlags: (Handle) -> c_int;
    GDALGetMaskBand: (Handle) -> Handle;
    OSRNewSpatialReference: (*const c_char) -> Handle;
    OSRDestroySpatialReference: (Handle);
    OSRImportFromWkt: (Handle, *mut *mut c_char) -> c_int;
    OSRImportFromEPSG: (Handle, c_int) -> c_int;
    OSRCloneGeogCS: (Handle) -> Handle;
    OSRFindMatches: (Handle, *const *const c_char, *mut c_int, *mut *mut c_int) -> *mut Handle;
    OSRFreeSRSArray: (*mut Handle);
    OSRExportToProj4: (Handle, *mut *mut c_char) -> c_int;
    OSRGetName: (Handle) -> *const c_char;
    OSRGetAttrValue: (Handle, *const c_char, c_int) -> *const c_char;
    OSRGetAuthorityName: (Handle, *const c_char) -> *const c_char;
    OSRGetAuthorityCode: (Handle, *const c_char) -> *const c_char;
    OSRIsGeographic: (Handle) -> c_int;
    OSRIsProjected: (Handle) -> c_int;
    OSRGetLinearUnits: (Handle, *mut *mut c_char) -> c_double;
    OSRGetAngularUnits: (Handle, *mut *mut c_char) -> c_double;
    OSRGetPrimeMeridian: (Handle, *mut *mut c_char) -> c_double;
    OSRGetSemiMajor: (Handle, *mut c_int) -> c_double;
    OSRGetInvFlattening: (Handle, *mut c_int) -> c_double;
    OSRGetTOWGS84: (Handle, *mut c_double, c_int) -> c_int;
    VSIFree: (*mut c_void);
    GDALRasterIO: (Handle, c_int, c_int, c_int, c_int, c_int, *mut c_void, c_int, c_int, c_int, c_int, c_int) -> c_int;
    GDALGetFileList: (Handle) -> *mut *mut c_char;
    CSLDestroy: (*mut *mut c_char);
    CPLParseXMLString: (*const c_char) -> *mut XmlNode;
    CPLDestroyXMLNode: (*mut XmlNode);
    VSIReadDirRecursive: (*const c_char) -> *mut *mut c_char;
    VSIAllocFilesystemPluginCallbacksStruct: () -> *mut Callbacks;
    VSIInstallPluginHandler: (*const c_char, *const Callbacks) -> c_int;
    VSIFreeFilesystemPluginCallbacksStruct: (*mut Callbacks);
    CSLAddString: (*mut *mut c_char, *const c_char) -> *mut *mut c_char;
    VSIFOpenL: (*const c_char, *const c_char) -> Handle;
    VSIFSeekL: (Handle, u64, c_int) -> c_int;
    VSIFTellL: (Handle) -> u64;
    VSIFCloseL: (Handle) -> c_int;
    GDALDatasetGetRootGroup: (Handle) -> Handle;
    GDALGroupOpenMDArray: (Handle, *const c_char, *const *const c_char) -> Handle;
    GDALGroupRelease: (Handle);
    GDALMDArrayGetDimensions: (Handle, *mut usize) -> *mut Handle;
    GDALMDArrayRelease: (Handle);
    GDALDimensionGetType: (Handle) -> *const c_char;
    GDALReleaseDimensions: (*mut Handle, usize);
}
