//! Reads flash that may be unreadable: a word that was being written at a power cut.
//!
//! Loading such a word raises a bus fault. Only one load may do so: after its fault the program
//! continues behind it. Any other bus fault becomes a hard fault.

use core::arch::global_asm;

use cortex_m::Peripherals;
use cortex_m::peripheral::scb::{Exception, SystemHandler};
use embassy_stm32::pac;

use crate::stm32::priorities::OTHERS;

unsafe extern "C" {
    /// Loads a word; returns true if it could be read.
    fn hapterra_peek(address: *const u32, into: &mut u32) -> bool;
}

// The exception's frame, with the return address, is on the main stack, the only one.
global_asm!(
    ".section .text.hapterra_peek, \"ax\", %progbits",
    ".thumb",
    ".global hapterra_peek",
    ".type hapterra_peek, %function",
    ".thumb_func",
    "hapterra_peek:",
    ".Lload:",
    "ldr r2, [r0]",
    "str r2, [r1]",
    "movs r0, #1",
    "bx lr",
    ".Lfailed:",
    "movs r0, #0",
    "bx lr",
    ".global BusFault",
    ".type BusFault, %function",
    ".thumb_func",
    "BusFault:",
    "ldr r0, [sp, #24]", // Address of the fault.
    "adr.w r1, .Lload",
    "cmp r0, r1",
    "bne.w HardFault",
    "adr.w r1, .Lfailed",
    "str r1, [sp, #24]",
    "movw r1, #0xED28", // CFSR: flags are cleared by writing ones.
    "movt r1, #0xE000",
    "ldr r0, [r1]",
    "str r0, [r1]",
    "dsb",
    "bx lr",
);

/// Enables the handler of bus faults, below the tick: a bus fault in the tick or in a critical
/// section remains a hard fault.
pub(crate) fn enable_bus_fault(core: &mut Peripherals) {
    // SAFETY: no critical section depends on a fault's priority.
    unsafe {
        core.SCB.set_priority(SystemHandler::BusFault, OTHERS as u8);
    }
    core.SCB.enable(Exception::BusFault);
}

/// Copies `into.len()` bytes of flash from `address`, both multiples of four, and returns true if
/// all of them could be read.
pub(crate) fn read(address: usize, into: &mut [u8]) -> bool {
    let mut words = (address..).step_by(4).zip(into.chunks_exact_mut(4));
    let is_read = words.all(|(at, four)| {
        let mut word = 0;
        // SAFETY: the caller passes words of flash; a fault of the load is handled.
        let is_read = unsafe { hapterra_peek(at as *const u32, &mut word) };
        four.copy_from_slice(&word.to_le_bytes());
        is_read
    });
    // Flags that stay set would look like a failure of the next write or erase.
    pac::FLASH.bank(1).ccr().write(|w| {
        w.set_clr_sneccerr(true);
        w.set_clr_dbeccerr(true);
    });
    is_read
}
