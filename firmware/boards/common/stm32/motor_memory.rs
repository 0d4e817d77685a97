//! The motors' temperatures in a RAM that survives a reset.

use core::mem::MaybeUninit;
use core::ptr;

use hapterra_core::guard::thermal::Temperatures;
use hapterra_core::wire::status::ResetCause;
use hapterra_firmware::motor_memory::{self, Copies, Words};

use crate::chip::write_back;

/// A copy is a line of the data cache, so that it reaches the RAM as a whole.
#[repr(C, align(32))]
struct Lines(Copies);

/// Start-up code leaves this section as it is.
#[unsafe(link_section = ".uninit.motors")]
static mut COPIES: MaybeUninit<Lines> = MaybeUninit::uninit();

/// Returns what the motors are to be taken for, once, before any interrupt is enabled.
pub(crate) fn begin(cause: ResetCause) -> Temperatures {
    // SAFETY: nothing writes it now, and any bits are words. Their check sums say
    // whether they are temperatures.
    let found = unsafe { ptr::read_volatile((&raw const COPIES).cast::<Copies>()) };
    let (temperatures, copies) = motor_memory::begin(cause, &found);
    copies.into_iter().enumerate().for_each(keep);
    temperatures
}

/// Keeps a copy: called by [`begin`], and then by the haptic interrupt alone.
pub(crate) fn keep((copy, words): (usize, Words)) {
    // There are two of them.
    let place = (&raw mut COPIES).cast::<Words>().wrapping_add(copy & 1);
    // SAFETY: the place is one of the two copies. `begin` has ended before the
    // interrupt is enabled, and the interrupt does not interrupt itself.
    unsafe { ptr::write_volatile(place, words) };
    write_back(place as usize, size_of::<Words>());
}
