//! The interface to C: arrays that a caller owns, and calls that must not panic.

use std::mem::MaybeUninit;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::slice;

use crate::status::{Failure, HapterraStatus};

/// Checks that a pointer can be that of an array.
fn check_pointer<T>(pointer: *const T, count: usize) -> Result<(), HapterraStatus> {
    let bytes = count.checked_mul(size_of::<T>());
    match pointer {
        pointer if pointer.is_null() => Err(HapterraStatus::NullPointer),
        pointer if !pointer.is_aligned() => Err(HapterraStatus::Pointer),
        _ if bytes.is_none_or(|bytes| bytes > isize::MAX as usize) => Err(HapterraStatus::Pointer),
        _ => Ok(()),
    }
}

/// Returns a caller's array.
///
/// # Safety
/// At `pointer` are `count` values that no other thread changes during the call.
pub(crate) unsafe fn array<'a, T>(
    pointer: *const T,
    count: usize,
) -> Result<&'a [T], HapterraStatus> {
    check_pointer(pointer, count)?;
    // SAFETY: not null, aligned, no larger than memory; the contract of the header, which every
    // caller of this function repeats, guarantees the values.
    Ok(unsafe { slice::from_raw_parts(pointer, count) })
}

/// Returns a caller's memory for an array, with any content.
///
/// # Safety
/// At `pointer` is room for `count` values that no other thread uses during the call.
pub(crate) unsafe fn output_array<'a, T>(
    pointer: *mut T,
    count: usize,
) -> Result<&'a mut [MaybeUninit<T>], HapterraStatus> {
    check_pointer(pointer, count)?;
    // SAFETY: as above, and the type allows any content, also uninitialised.
    Ok(unsafe { slice::from_raw_parts_mut(pointer.cast(), count) })
}

/// Runs a call and returns a panic as a failure.
pub(crate) fn catch_panic<R>(call: impl FnOnce() -> Result<R, Failure>) -> Result<R, Failure> {
    catch_unwind(AssertUnwindSafe(call)).unwrap_or_else(|_| Err(HapterraStatus::Internal.into()))
}
