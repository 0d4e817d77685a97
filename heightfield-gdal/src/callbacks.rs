//! The callbacks by which GDAL reads files through this crate's user. A panic is not passed to C:
//! the callback then fails, as for a file that cannot be read.

use std::ffi::{CStr, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;
use std::sync::{Arc, Mutex, PoisonError};

use crate::error::Error;
use crate::file_system::{PREFIX, ReadAt};
use crate::functions::Stat;
use crate::libgdal::Libgdal;
use crate::mount::{Mounted, at};
use crate::text::{from_c, to_c};

/// [`PREFIX`] for GDAL, which stores the pointer.
const PREFIX_FOR_C: &CStr = c"/vsiheightfield/";
/// The result of `stat`, `seek` and `close` on failure.
const FAILED: c_int = -1;

/// A file that GDAL has open, and its read position.
struct OpenFile {
    mounted: Arc<Mounted>,
    file: Box<dyn ReadAt>,
    at: u64,
    is_at_end: bool,
}

/// Registers the callbacks below for all names that begin with [`PREFIX`].
///
/// # Errors
/// [`Error::Refused`].
pub(crate) fn install(libgdal: &Libgdal) -> Result<(), Error> {
    static IS_INSTALLED: Mutex<bool> = Mutex::new(false);
    let mut is_installed = IS_INSTALLED.lock().unwrap_or_else(PoisonError::into_inner);
    if *is_installed {
        return Ok(());
    }
    let refused = || libgdal.refused("it accepts no files from its caller");
    let functions = &libgdal.functions;
    // SAFETY: GDAL's own structure, whose fields set here are the same in all versions; GDAL copies
    // it. Prefix and functions exist as long as the process.
    unsafe {
        let callbacks = (functions.VSIAllocFilesystemPluginCallbacksStruct)();
        let own = callbacks.as_mut().ok_or_else(refused)?;
        own.stat = Some(stat);
        own.open = Some(open);
        own.tell = Some(tell);
        own.seek = Some(seek);
        own.read = Some(read);
        own.eof = Some(eof);
        own.close = Some(close);
        own.sibling_files = Some(sibling_files);
        *is_installed = (functions.VSIInstallPluginHandler)(PREFIX_FOR_C.as_ptr(), callbacks) == 0;
        (functions.VSIFreeFilesystemPluginCallbacksStruct)(callbacks);
    }
    is_installed.then_some(()).ok_or_else(refused)
}

/// Returns the value of `call`, or `otherwise` if it has none or panics.
fn caught<T>(otherwise: T, call: impl FnOnce() -> Option<T>) -> T {
    let called = catch_unwind(AssertUnwindSafe(call));
    called.ok().flatten().unwrap_or(otherwise)
}

/// Returns the file system, and the name in it, of a request by GDAL.
///
/// # Safety
/// `name` is null or a text that is valid during the call.
unsafe fn parse_name(name: *const c_char) -> Option<(Arc<Mounted>, String)> {
    // SAFETY: guaranteed by the caller. GDAL omits the prefix.
    let name = format!("{PREFIX}{}", unsafe { from_c(name) }?);
    let (mounted, name) = at(&name)?;
    Some((mounted, name.to_owned()))
}

unsafe extern "C" fn open(
    _: *mut c_void,
    name: *const c_char,
    access: *const c_char,
) -> *mut c_void {
    caught(ptr::null_mut(), || {
        // SAFETY: GDAL's texts, which are valid during the call.
        let ((mounted, name), access) = unsafe { (parse_name(name)?, from_c(access)?) };
        if access.contains(['w', 'a', '+']) {
            return None;
        }
        let Some(file) = mounted.open(&name) else {
            set_not_found();
            return None;
        };
        Some(Box::into_raw(Box::new(OpenFile {
            mounted,
            file,
            at: 0,
            is_at_end: false,
        })))
    })
    .cast()
}

/// Sets the error number from which GDAL makes its message for a failed opening.
fn set_not_found() {
    // SAFETY: the pointer is to this thread's own error number.
    #[cfg(target_os = "linux")]
    unsafe {
        *libc::__errno_location() = libc::ENOENT;
    }
    // SAFETY: as above.
    #[cfg(target_os = "macos")]
    unsafe {
        *libc::__error() = libc::ENOENT;
    }
}

unsafe extern "C" fn stat(_: *mut c_void, name: *const c_char, stat: *mut Stat, _: c_int) -> c_int {
    caught(FAILED, || {
        // SAFETY: GDAL's text, and its structure, which is zeroed.
        let ((mounted, name), stat) = unsafe { (parse_name(name)?, stat.as_mut()?) };
        let bytes = mounted.open(&name)?.bytes();
        stat.st_mode = libc::S_IFREG as _;
        stat.st_size = bytes.try_into().ok()?;
        Some(0)
    })
}

/// Returns a list of texts owned by GDAL: the file itself and those beside it; null if they are
/// unknown.
unsafe extern "C" fn sibling_files(_: *mut c_void, name: *const c_char) -> *mut *mut c_char {
    caught(ptr::null_mut(), || {
        // SAFETY: GDAL's text.
        let (mounted, name) = unsafe { parse_name(name)? };
        let own = name.rsplit('/').next().map(str::to_owned);
        let neighbours = mounted.neighbours(&name)?;
        let mut list = ptr::null_mut();
        for name in own.into_iter().chain(neighbours) {
            let name = to_c(&name).ok()?;
            // SAFETY: the text is valid during the call, which copies it.
            list = unsafe { (mounted.library().functions.CSLAddString)(list, name.as_ptr()) };
        }
        Some(list)
    })
}

/// Returns the file that GDAL has open.
///
/// # Safety
/// `file` is from [`open`] and not closed; GDAL uses it on one thread at a time.
unsafe fn opened<'f>(file: *mut c_void) -> Option<&'f mut OpenFile> {
    // SAFETY: guaranteed by the caller.
    unsafe { file.cast::<OpenFile>().as_mut() }
}

unsafe extern "C" fn tell(file: *mut c_void) -> u64 {
    // SAFETY: GDAL has it open.
    unsafe { opened(file) }.map_or(0, |file| file.at)
}

unsafe extern "C" fn seek(file: *mut c_void, offset: u64, from: c_int) -> c_int {
    caught(FAILED, || {
        // SAFETY: GDAL has it open.
        let file = unsafe { opened(file)? };
        let from = match from {
            libc::SEEK_SET => 0,
            libc::SEEK_CUR => file.at,
            libc::SEEK_END => file.file.bytes(),
            _ => return None,
        };
        // A negative offset is a wrapped number.
        file.at = from.wrapping_add(offset);
        file.is_at_end = false;
        Some(0)
    })
}

unsafe extern "C" fn read(
    file: *mut c_void,
    buffer: *mut c_void,
    size: usize,
    count: usize,
) -> usize {
    caught(0, || {
        // SAFETY: GDAL has it open.
        let file = unsafe { opened(file)? };
        let requested = size.checked_mul(count).filter(|requested| *requested > 0)?;
        let remaining = file.file.bytes().saturating_sub(file.at);
        let bytes =
            usize::try_from(remaining).map_or(requested, |remaining| requested.min(remaining));
        let read = file.mounted.read_at(&*file.file, file.at, bytes)?;
        // SAFETY: GDAL's buffer has space for all requested bytes, and `read` has no more.
        unsafe { ptr::copy_nonoverlapping(read.as_ptr(), buffer.cast(), bytes) };
        file.at += bytes as u64;
        file.is_at_end = bytes < requested;
        Some(bytes / size)
    })
}

unsafe extern "C" fn eof(file: *mut c_void) -> c_int {
    // SAFETY: GDAL has it open.
    unsafe { opened(file) }.map_or(1, |file| file.is_at_end.into())
}

unsafe extern "C" fn close(file: *mut c_void) -> c_int {
    caught(FAILED, || {
        if file.is_null() {
            return None;
        }
        // SAFETY: from `open`, and GDAL closes it once.
        drop(unsafe { Box::from_raw(file.cast::<OpenFile>()) });
        Some(0)
    })
}
