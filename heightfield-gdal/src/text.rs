//! Texts that cross the border to C.

use std::ffi::{CStr, CString, c_char};
use std::path::Path;

use crate::error::Error;

/// A text for C.
pub(crate) fn to_c(text: &str) -> Result<CString, Error> {
    CString::new(text).map_err(|_| Error::ZeroByte(text.to_owned()))
}

/// A path for GDAL, which takes UTF-8 on every system and any bytes on Unix.
pub(crate) fn path_to_c(path: &Path) -> Result<CString, Error> {
    let bytes = path.as_os_str().as_encoded_bytes();
    CString::new(bytes).map_err(|_| Error::ZeroByte(path.display().to_string()))
}

/// A copy of a text of GDAL's; none where there is none, or an empty one.
///
/// # Safety
/// `text` is null, or ends with a zero byte and stays for the call.
pub(crate) unsafe fn from_c(text: *const c_char) -> Option<String> {
    if text.is_null() {
        return None;
    }
    // SAFETY: not null; the caller vouches for the rest.
    let text = unsafe { CStr::from_ptr(text) }.to_string_lossy();
    (!text.is_empty()).then(|| text.into_owned())
}

/// Copies of a list of texts that ends with a null pointer.
///
/// # Safety
/// `list` is null, or such a list, and stays for the call.
pub(crate) unsafe fn list_from_c(list: *const *const c_char) -> Vec<String> {
    let mut texts = Vec::new();
    if list.is_null() {
        return texts;
    }
    for at in 0.. {
        // SAFETY: the list continues until the null pointer, which was not reached yet.
        let text = unsafe { *list.add(at) };
        if text.is_null() {
            break;
        }
        // SAFETY: an entry of the list is a text, by the caller.
        texts.extend(unsafe { from_c(text) });
    }
    texts
}
