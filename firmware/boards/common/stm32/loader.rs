//! The entry into the USB loader in the chip's ROM: an update without a debug probe.
//!
//! The loader expects the chip in its reset state. So the program writes a mark to RAM and resets
//! the chip, and the next start jumps to the loader before anything is configured. From the reset
//! to the start of the new program, no instruction of this firmware drives the enable pin: the
//! pull-down outside keeps the amplifiers off, as at every reset.
//!
//! The loader starts a program without a reset. Such a start resets the chip again, so that a
//! program always begins with the registers of a reset.

use core::arch::global_asm;
use core::mem::MaybeUninit;
use core::ptr;

use cortex_m::peripheral::SCB;

use crate::chip::{amplifiers_off, fill_memories, write_back};
use crate::usb::{LOADER, USB_OSCILLATOR};

/// Mark that requests the loader; its complement follows it. After a power-up, RAM contains both by
/// chance once in 2⁶⁴ starts; the loader would then wait, with the amplifiers off, for the next
/// reset.
const LOADER_REQUEST: u32 = 0x6F4C_6164;

/// Start-up code does not initialise this section.
#[unsafe(link_section = ".uninit.loader")]
static mut MARK: MaybeUninit<[u32; 2]> = MaybeUninit::uninit();

/// Switches the amplifiers off and resets the chip into its loader.
pub(crate) fn enter() -> ! {
    cortex_m::interrupt::disable();
    amplifiers_off();
    let mark = (&raw mut MARK).cast::<[u32; 2]>();
    // SAFETY: nothing else reads or writes it before the reset that follows.
    unsafe { ptr::write_volatile(mark, [LOADER_REQUEST, !LOADER_REQUEST]) };
    // A reset discards data that is only in the data cache.
    write_back(mark as usize, size_of::<[u32; 2]>());
    SCB::sys_reset()
}

// Selects the loader or the application at a start. The start-up code calls this before it
// initialises memory, when Rust code must not run. The mark is valid for one start.
global_asm!(
    ".section .text.hapterra_choose_program, \"ax\", %progbits",
    ".thumb",
    ".global __pre_init",
    ".type __pre_init, %function",
    ".thumb_func",
    "__pre_init:",
    "ldr r0, ={mark}",
    "ldr r1, [r0]",
    "ldr r2, [r0, #4]",
    "movs r3, #0",
    "str r3, [r0]",
    "str r3, [r0, #4]",
    "ldr r3, ={request}",
    "cmp r1, r3",
    "bne 1f",
    "mvns r3, r3",
    "cmp r2, r3",
    "bne 1f",
    "bl hapterra_show_loader",
    "ldr r0, ={loader}",
    "ldr r1, =0xE000ED08", // VTOR
    "str r0, [r1]",
    "dsb",
    "ldr r1, [r0]",
    "ldr r2, [r0, #4]",
    "msr msp, r1",
    "bx r2",
    "1:",
    "ldr r0, ={oscillator}", // Off after a reset, and the loader needs it.
    "ldr r0, [r0]",
    "tst r0, #{is_on}",
    "beq 2f",
    "ldr r0, =0xE000ED0C", // AIRCR: SYSRESETREQ
    "ldr r1, =0x05FA0004",
    "dsb",
    "str r1, [r0]",
    "dsb",
    "b .",
    "2:",
    "b {fill}", // Returns for it.
    ".ltorg",
    mark = sym MARK,
    fill = sym fill_memories,
    request = const LOADER_REQUEST,
    loader = const LOADER,
    oscillator = const USB_OSCILLATOR.0,
    is_on = const USB_OSCILLATOR.1,
);
