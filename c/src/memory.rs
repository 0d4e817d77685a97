//! Memory for a caller that shares the library's own, such as the page around a WebAssembly module.

use std::alloc::{Layout, alloc, dealloc};
use std::ffi::c_void;
use std::ptr::null_mut;

/// Aligned for every type of the header.
const ALIGNMENT: usize = 16;

/// Returns memory of `bytes` bytes, aligned to 16, that the caller owns until `hapterra_free`; null
/// for no bytes, and if there is no memory. For WebAssembly; C has `malloc`.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub extern "C" fn hapterra_alloc(bytes: usize) -> *mut c_void {
    match Layout::from_size_align(bytes, ALIGNMENT) {
        // SAFETY: the size is not zero.
        Ok(layout) if bytes > 0 => unsafe { alloc(layout) }.cast(),
        _ => null_mut(),
    }
}

/// Frees memory that `hapterra_alloc` returned for the same number of bytes. Null is ignored.
///
/// # Safety
/// `pointer` is null, or a result of `hapterra_alloc(bytes)` that was not freed.
#[unsafe(no_mangle)] // SAFETY: no other symbol begins with `hapterra_`.
pub unsafe extern "C" fn hapterra_free(pointer: *mut c_void, bytes: usize) {
    if let Ok(layout) = Layout::from_size_align(bytes, ALIGNMENT)
        && !pointer.is_null()
    {
        // SAFETY: by this function's contract it was allocated with this layout.
        unsafe { dealloc(pointer.cast(), layout) }
    }
}
