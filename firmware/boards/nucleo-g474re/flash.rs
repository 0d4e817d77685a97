//! Reads flash that may be unreadable: a word that was being written at a power cut.
//!
//! The chip then loads a random value and raises its NMI. Bank 2 contains only the calibrations, so
//! an NMI for that bank belongs to them.

use core::slice;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::asm::{dsb, isb};
use cortex_m_rt::exception;
use embassy_stm32::pac;

use crate::stm32::failure;

/// True if a word could not be read since this was last cleared.
static FAILED: AtomicBool = AtomicBool::new(false);
/// The exception number of the NMI.
const NMI: i16 = -14;

#[exception]
unsafe fn NonMaskableInt() {
    let found = pac::FLASH.eccr().read();
    if !(found.eccd() || found.eccd2()) || !found.bk_ecc() {
        failure::unhandled(NMI);
    }
    // Flags are cleared by writing ones.
    pac::FLASH.eccr().write_value(found);
    FAILED.store(true, Ordering::SeqCst);
    dsb();
}

/// Copies `into.len()` bytes of flash from `address` and returns true if all of them could be read.
pub(crate) fn read(address: usize, into: &mut [u8]) -> bool {
    FAILED.store(false, Ordering::SeqCst);
    // SAFETY: the caller passes bytes of flash, where any bits are valid bytes.
    into.copy_from_slice(unsafe { slice::from_raw_parts(address as *const u8, into.len()) });
    // Waits for the NMI of the last load.
    dsb();
    isb();
    !FAILED.load(Ordering::SeqCst)
}
