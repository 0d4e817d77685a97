//! Maximum use of the stack.
//!
//! cortex-m-rt paints the stack before `main` (feature `paint-stack`). Words that are still painted
//! were never used.

use core::ptr;

use cortex_m_rt::STACK_PAINT_VALUE;

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// Returns the size of the stack and its high-water mark, in bytes. Reads the unused part once.
pub(crate) fn figures() -> (u32, u32) {
    let (top, bottom) = (&raw const _stack_start, &raw const _stack_end);
    let mut unused = bottom;
    // SAFETY: the linker's addresses are those of the stack: whole words in RAM. The part that is
    // read is below the stack pointer, so only an interrupt can write it meanwhile, and its words
    // then count as used.
    while unused < top && unsafe { ptr::read_volatile(unused) } == STACK_PAINT_VALUE {
        unused = unused.wrapping_add(1);
    }
    let bytes = |from: *const u32, to: *const u32| (to as u32).saturating_sub(from as u32);
    (bytes(bottom, top), bytes(unused, top))
}
