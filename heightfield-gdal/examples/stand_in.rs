//! A fake libgdal for tests: a shared library with the functions that this crate calls.
//!
//! It opens any file as one band of 2048 × 2048 heights in blocks of 256 × 256. Environment
//! variables inject faults:
//!
//! - `STAND_IN_VERSION`: its version number;
//! - `STAND_IN_SLEEP_MS`: the time for reading a block;
//! - `STAND_IN_CRASH`: a file; if it exists, the next read causes a SIGSEGV.

#![allow(non_snake_case)]

use std::ffi::{CString, c_char, c_double, c_int, c_uint, c_void};
use std::path::Path;
use std::ptr;
use std::time::Duration;

/// Columns and rows of the band, and of a block.
const SIDE: c_int = 2048;
const BLOCK: c_int = 256;
/// `GDT_Float32`.
const FLOAT: c_int = 6;
const FINE: c_int = 0;
const FAILED: c_int = 3;

/// Represents driver, dataset and band, whose content is never read.
static HANDLE: u8 = 0;

fn handle() -> *mut c_void {
    ptr::from_ref(&HANDLE).cast_mut().cast()
}

/// Returns a text that is never freed, like some of GDAL's.
fn text(of: &str) -> *const c_char {
    CString::new(of).map_or(ptr::null(), |text| text.into_raw().cast_const())
}

fn variable(name: &str) -> Option<String> {
    std::env::var(name).ok()
}

/// Returns a height; each square of 1024 × 1024 is a hill.
fn height(column: c_int, row: c_int) -> f32 {
    let part = |at: c_int| (at % 1024) as f32 / 1024.0;
    let bump = |at: f32| 4.0 * at * (1.0 - at);
    200.0 * bump(part(column)) * bump(part(row))
}

/// Declares functions without effect, with their arguments and result.
macro_rules! silent {
    ($($name:ident($($argument:ty),*) -> $result:ty = $value:expr;)*) => {
        $(
            #[unsafe(no_mangle)]
            extern "C" fn $name($(_: $argument),*) -> $result {
                $value
            }
        )*
    };
}

silent! {
    CPLSetConfigOption(*const c_char, *const c_char) -> () = ();
    CPLSetErrorHandler(*const c_void) -> *const c_void = ptr::null();
    CPLQuietErrorHandler(c_int, c_int, *const c_char) -> () = ();
    CPLErrorReset() -> () = ();
    CPLGetLastErrorMsg() -> *const c_char = ptr::null();
    GDALAllRegister() -> () = ();
    GDALGetDriverCount() -> c_int = 1;
    GDALGetDriver(c_int) -> *mut c_void = handle();
    GDALGetDriverShortName(*mut c_void) -> *const c_char = text("StandIn");
    GDALGetDriverLongName(*mut c_void) -> *const c_char = text("A stand-in for tests");
    GDALGetMetadataItem(*mut c_void, *const c_char, *const c_char) -> *const c_char = ptr::null();
    GDALGetMetadata(*mut c_void, *const c_char) -> *const *const c_char = ptr::null();
    GDALGetDescription(*mut c_void) -> *const c_char = ptr::null();
    GDALClose(*mut c_void) -> c_int = FINE;
    GDALGetDatasetDriver(*mut c_void) -> *mut c_void = handle();
    GDALGetRasterCount(*mut c_void) -> c_int = 1;
    GDALGetGeoTransform(*mut c_void, *mut c_double) -> c_int = FAILED;
    GDALGetProjectionRef(*mut c_void) -> *const c_char = ptr::null();
    GDALGetRasterBand(*mut c_void, c_int) -> *mut c_void = handle();
    GDALGetRasterBandXSize(*mut c_void) -> c_int = SIDE;
    GDALGetRasterBandYSize(*mut c_void) -> c_int = SIDE;
    GDALGetRasterDataType(*mut c_void) -> c_int = FLOAT;
    GDALGetDataTypeName(c_int) -> *const c_char = text("Float32");
    GDALGetRasterNoDataValue(*mut c_void, *mut c_int) -> c_double = 0.0;
    GDALGetRasterScale(*mut c_void, *mut c_int) -> c_double = 1.0;
    GDALGetRasterOffset(*mut c_void, *mut c_int) -> c_double = 0.0;
    GDALGetRasterUnitType(*mut c_void) -> *const c_char = text("m");
    GDALGetOverviewCount(*mut c_void) -> c_int = 0;
    GDALGetOverview(*mut c_void, c_int) -> *mut c_void = ptr::null_mut();
    GDALGetMaskFlags(*mut c_void) -> c_int = 1;
    GDALGetMaskBand(*mut c_void) -> *mut c_void = ptr::null_mut();
    GDALGetFileList(*mut c_void) -> *mut *mut c_char = ptr::null_mut();
    CSLDestroy(*mut *mut c_char) -> () = ();
    CPLParseXMLString(*const c_char) -> *mut c_void = ptr::null_mut();
    CPLDestroyXMLNode(*mut c_void) -> () = ();
    VSIReadDirRecursive(*const c_char) -> *mut *mut c_char = ptr::null_mut();
    VSIAllocFilesystemPluginCallbacksStruct() -> *mut c_void = ptr::null_mut();
    VSIInstallPluginHandler(*const c_char, *const c_void) -> c_int = -1;
    VSIFreeFilesystemPluginCallbacksStruct(*mut c_void) -> () = ();
    CSLAddString(*mut *mut c_char, *const c_char) -> *mut *mut c_char = ptr::null_mut();
    VSIFOpenL(*const c_char, *const c_char) -> *mut c_void = ptr::null_mut();
    VSIFSeekL(*mut c_void, u64, c_int) -> c_int = -1;
    VSIFTellL(*mut c_void) -> u64 = 0;
    VSIFCloseL(*mut c_void) -> c_int = 0;
    GDALDatasetGetRootGroup(*mut c_void) -> *mut c_void = ptr::null_mut();
    GDALGroupOpenMDArray(*mut c_void, *const c_char, *const *const c_char) -> *mut c_void = ptr::null_mut();
    GDALGroupRelease(*mut c_void) -> () = ();
    GDALMDArrayGetDimensions(*mut c_void, *mut usize) -> *mut *mut c_void = ptr::null_mut();
    GDALMDArrayRelease(*mut c_void) -> () = ();
    GDALDimensionGetType(*mut c_void) -> *const c_char = ptr::null();
    GDALReleaseDimensions(*mut *mut c_void, usize) -> () = ();
    OSRNewSpatialReference(*const c_char) -> *mut c_void = ptr::null_mut();
    OSRDestroySpatialReference(*mut c_void) -> () = ();
    OSRImportFromWkt(*mut c_void, *mut *mut c_char) -> c_int = FAILED;
    OSRImportFromEPSG(*mut c_void, c_int) -> c_int = FAILED;
    OSRCloneGeogCS(*mut c_void) -> *mut c_void = ptr::null_mut();
    OSRFindMatches(
        *mut c_void, *const *const c_char, *mut c_int, *mut *mut c_int
    ) -> *mut *mut c_void = ptr::null_mut();
    OSRFreeSRSArray(*mut *mut c_void) -> () = ();
    OSRExportToProj4(*mut c_void, *mut *mut c_char) -> c_int = FAILED;
    OSRGetName(*mut c_void) -> *const c_char = ptr::null();
    OSRGetAttrValue(*mut c_void, *const c_char, c_int) -> *const c_char = ptr::null();
    OSRGetAuthorityName(*mut c_void, *const c_char) -> *const c_char = ptr::null();
    OSRGetAuthorityCode(*mut c_void, *const c_char) -> *const c_char = ptr::null();
    OSRIsGeographic(*mut c_void) -> c_int = 0;
    OSRIsProjected(*mut c_void) -> c_int = 0;
    OSRGetLinearUnits(*mut c_void, *mut *mut c_char) -> c_double = 1.0;
    OSRGetAngularUnits(*mut c_void, *mut *mut c_char) -> c_double = 1.0;
    OSRGetPrimeMeridian(*mut c_void, *mut *mut c_char) -> c_double = 0.0;
    OSRGetSemiMajor(*mut c_void, *mut c_int) -> c_double = 0.0;
    OSRGetInvFlattening(*mut c_void, *mut c_int) -> c_double = 0.0;
    OSRGetTOWGS84(*mut c_void, *mut c_double, c_int) -> c_int = FAILED;
    VSIFree(*mut c_void) -> () = ();
    GDALOpenEx(
        *const c_char, c_uint, *const *const c_char, *const *const c_char, *const *const c_char
    ) -> *mut c_void = handle();
}

#[unsafe(no_mangle)]
extern "C" fn GDALVersionInfo(_: *const c_char) -> *const c_char {
    text(&variable("STAND_IN_VERSION").unwrap_or_else(|| "3090000".into()))
}

/// # Safety
/// Both pointers are valid for a write.
#[unsafe(no_mangle)]
unsafe extern "C" fn GDALGetBlockSize(_: *mut c_void, columns: *mut c_int, rows: *mut c_int) {
    // SAFETY: guaranteed by the caller.
    unsafe {
        *columns = BLOCK;
        *rows = BLOCK;
    }
}

/// # Safety
/// The buffer has space for a window of `f32`.
#[unsafe(no_mangle)]
unsafe extern "C" fn GDALRasterIO(
    _: *mut c_void,
    _: c_int,
    column: c_int,
    row: c_int,
    columns: c_int,
    rows: c_int,
    buffer: *mut c_void,
    _: c_int,
    _: c_int,
    kind: c_int,
    _: c_int,
    _: c_int,
) -> c_int {
    if variable("STAND_IN_CRASH").is_some_and(|file| Path::new(&file).exists()) {
        // SAFETY: none; this write crashes the process on purpose.
        unsafe { ptr::null_mut::<u8>().write_volatile(1) };
    }
    let pause = variable("STAND_IN_SLEEP_MS").and_then(|pause| pause.parse().ok());
    std::thread::sleep(Duration::from_millis(pause.unwrap_or(0)));
    if kind != FLOAT {
        return FAILED;
    }
    let places =
        (row..row + rows).flat_map(|row| (column..column + columns).map(move |at| (at, row)));
    for (at, (column, row)) in places.enumerate() {
        // SAFETY: guaranteed by the caller.
        unsafe { buffer.cast::<f32>().add(at).write(height(column, row)) };
    }
    FINE
}
