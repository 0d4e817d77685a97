//! The memories without wait states: the tick's code in ITCM, the constants in DTCM.
//!
//! From flash, the tick's code would be loaded through the instruction cache, where the tasks
//! between two ticks evict it. `memory/nucleo-h743zi2.x` lists the content of these memories.

use core::arch::global_asm;

use cortex_m::peripheral::MPU;

/// MPU_RBAR: all of ITCM, from address 0 on, as region 1. Region 0 is the stack's guard.
const REGION: u32 = 1 << 4 | 1;
/// Bytes of ITCM.
const ITCM_BYTES: u32 = 64 * 1024;
/// MPU_RASR: loads and code but no stores, normal memory, 64 KiB, on.
const READ_ONLY: u32 = 0b110 << 24 | 1 << 17 | (ITCM_BYTES.ilog2() - 1) << 1 | 1;

// Copies both before any Rust code runs: any function may call the copy routine, which is in these
// memories itself. Their check bits are over eight bytes (RM0433, 2.4), so eight bytes are written
// at once. The rest of ITCM is set to zero, because the core prefetches beyond the executed code,
// and a word whose check bits were never written is a double error, which ends the duty cycles.
global_asm!(
    ".section .text.hapterra_fill_tick_memory, \"ax\", %progbits",
    ".thumb",
    ".global hapterra_fill_tick_memory",
    ".type hapterra_fill_tick_memory, %function",
    ".thumb_func",
    "hapterra_fill_tick_memory:",
    "ldr r0, =_tick_start",
    "ldr r1, =_tick_end",
    "ldr r2, =_tick_loaded",
    "1:",
    "ldrd r3, r12, [r2], #8",
    "strd r3, r12, [r0], #8",
    "cmp r0, r1",
    "blo 1b",
    "ldr r1, =_tick_memory_end",
    "movs r3, #0",
    "2:",
    "strd r3, r3, [r0], #8",
    "cmp r0, r1",
    "blo 2b",
    "ldr r0, =_constants_start",
    "ldr r1, =_constants_end",
    "ldr r2, =_constants_loaded",
    "3:",
    "ldrd r3, r12, [r2], #8",
    "strd r3, r12, [r0], #8",
    "cmp r0, r1",
    "blo 3b",
    "dsb",
    "isb",
    "bx lr",
    ".ltorg",
    ".size hapterra_fill_tick_memory, . - hapterra_fill_tick_memory",
);

unsafe extern "C" {
    /// Fills both memories. Needs no stack.
    #[link_name = "hapterra_fill_tick_memory"]
    pub(crate) fn fill();
}

/// Forbids stores to ITCM, which is filled by now: a store through a null pointer is a hard fault
/// instead of a change of the tick's code. The memory protection unit is on.
pub(crate) fn protect(mpu: &MPU) {
    // SAFETY: the program stores nothing there after `fill`, which runs before any Rust code.
    unsafe {
        mpu.rbar.write(REGION);
        mpu.rasr.write(READ_ONLY);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
