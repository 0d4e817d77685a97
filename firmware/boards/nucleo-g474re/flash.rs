//! Reads flash that may not be readable: a word that was being written when the power
//! went.
//!
//! The chip then loads anything and raises its NMI. The calibrations have bank 2 for
//! themselves, so an NMI about that bank is about them.

use core::slice;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::asm::{dsb, isb};
use cortex_m_rt::exception;
use embassy_stm32::pac;

use crate::stm32::failure;

/// True if a word could not be read since this was last cleared.
static FAILED: AtomicBool = AtomicBool::new(false);
/// The NMI, as an exception's number.
const NMI: i16 = -14;

#[exception]
unsafe fn NonMaskableInt() {
    let found = pac::FLASH.eccr().read();
    if !(found.eccd() || found.eccd2()) || !found.bk_ecc() {
        failure::unhandled(NMI);
    }
    // What is set is cleared by writing it.
    pac::FLASH.eccr().write_value(found);
    FAILED.store(true, Ordering::SeqCst);
    dsb();
}

/// Copies `into.len()` bytes of flash from `address` on and returns whether all of them
/// could be read.
pub(crate) fn read(address: usize, into: &mut [u8]) -> bool {
    FAILED.store(false, Ordering::SeqCst);
    // SAFETY: the caller names bytes of flash, where any bits are bytes.
    into.copy_from_slice(unsafe { slice::from_raw_parts(address as *const u8, into.len()) });
    // The NMI of the last load has come.
    dsb();
    isb();
    !FAILED.load(Ordering::SeqCst)
}
