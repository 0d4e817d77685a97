//! Conversion of texts to and from C.

use std::ffi::{CStr, CString, c_char};
use std::path::Path;

use crate::error::Error;

/// Converts a text for C.
pub(crate) fn to_c(text: &str) -> Result<CString, Error> {
    CString::new(text).map_err(|_| Error::ZeroByte(text.to_owned()))
}

/// Converts a path for GDAL, which accepts UTF-8 on every system, and any bytes on Unix.
pub(crate) fn path_to_c(path: &Path) -> Result<CString, Error> {
    let bytes = path.as_os_str().as_encoded_bytes();
    CString::new(bytes).map_err(|_| Error::ZeroByte(path.display().to_string()))
}

/// Copies a text of GDAL; `None` if it is null or empty.
///
/// # Safety
/// `text` is null, or ends with a zero byte and is valid during the call.
pub(crate) unsafe fn from_c(text: *const c_char) -> Option<String> {
    if text.is_null() {
        return None;
    }
    // SAFETY: not null; the rest is guaranteed by the caller.
    let text = unsafe { CStr::from_ptr(text) }.to_string_lossy();
    (!text.is_empty()).then(|| text.into_owned())
}

/// Copies a list of texts that ends with a null pointer.
///
/// # Safety
/// `list` is null, or such a list, and is valid during the call.
pub(crate) unsafe fn list_from_c(list: *const *const c_char) -> Vec<String> {
    let mut texts = Vec::new();
    if list.is_null() {
        return texts;
    }
    for at in 0.. {
        // SAFETY: the list continues until the null pointer, which has not been reached.
        let text = unsafe { *list.add(at) };
        if text.is_null() {
            break;
        }
        // SAFETY: entries of the list are texts, guaranteed by the caller.
        texts.extend(unsafe { from_c(text) });
    }
    texts
}
