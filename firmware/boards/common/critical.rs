//! A critical section that cannot delay the haptic interrupt.
//!
//! The usual one for a single core masks everything through PRIMASK. This one raises BASEPRI to
//! [`ABSOLUTE_LIMIT`], the priority just below the haptic interrupt's: all other interrupts wait, the
//! haptic one does not. So the haptic interrupt must never enter a critical section nor share data
//! that one protects. It exchanges data with the rest of the program through single-producer queues
//! only.

use core::sync::atomic::{Ordering, compiler_fence};

use cortex_m::register::{basepri, basepri_max};

/// Priority of the haptic interrupt. Only faults are above it and, where a board monitors its
/// supply, the interrupt that ends the program.
#[allow(dead_code)] // Only where priorities are set by number.
pub(crate) const HAPTIC: u8 = 0x10;
/// Highest priority that critical sections mask: level 2 of the sixteen of an STM32 (and of the 256
/// of the emulated core).
pub(crate) const ABSOLUTE_LIMIT: u8 = 0x20;

struct Ceiling;
critical_section::set_impl!(Ceiling);

// SAFETY: between `acquire` and the matching `release`, no interrupt of priority `ABSOLUTE_LIMIT` or below
// runs on the only core. Only `acquire` raises BASEPRI, and `release` restores its previous value,
// so sections nest. The fences prevent the compiler from moving memory accesses out.
unsafe impl critical_section::Impl for Ceiling {
    unsafe fn acquire() -> critical_section::RawRestoreState {
        let before = basepri::read();
        basepri_max::write(ABSOLUTE_LIMIT);
        compiler_fence(Ordering::SeqCst);
        before
    }

    unsafe fn release(before: critical_section::RawRestoreState) {
        compiler_fence(Ordering::SeqCst);
        // SAFETY: `before` is the value that `acquire` read; see above.
        unsafe { basepri::write(before) };
    }
}
