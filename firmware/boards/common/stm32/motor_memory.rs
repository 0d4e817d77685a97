//! The motors' temperatures in RAM that survives a reset.

use core::mem::MaybeUninit;
use core::ptr;

use hapterra_core::guard::thermal::Temperatures;
use hapterra_core::wire::status::ResetCause;
use hapterra_firmware::motor_memory::{self, Copies, Words};

use crate::chip::write_back;

/// A copy is one line of the data cache, so that it is written to RAM as a whole.
#[repr(C, align(32))]
struct Lines(Copies);

/// Start-up code does not initialise this section.
#[unsafe(link_section = ".uninit.motors")]
static mut COPIES: MaybeUninit<Lines> = MaybeUninit::uninit();

/// Returns the assumed temperatures of the motors. Called once, before any interrupt is enabled.
pub(crate) fn begin(cause: ResetCause) -> Temperatures {
    // SAFETY: nothing writes it now, and any bits are valid words. Their checksums show if they are
    // temperatures.
    let found = unsafe { ptr::read_volatile((&raw const COPIES).cast::<Copies>()) };
    let (temperatures, copies) = motor_memory::begin(cause, &found);
    copies.into_iter().enumerate().for_each(store_copy);
    temperatures
}

/// Stores a copy. Called by [`begin`], and then by the haptic interrupt only.
pub(crate) fn store_copy((copy, words): (usize, Words)) {
    // There are two copies.
    let place = (&raw mut COPIES).cast::<Words>().wrapping_add(copy & 1);
    // SAFETY: the place is one of the two copies. `begin` ends before the interrupt is enabled, and
    // the interrupt does not interrupt itself.
    unsafe { ptr::write_volatile(place, words) };
    write_back(place as usize, size_of::<Words>());
}
