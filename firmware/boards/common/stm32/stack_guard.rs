//! The guard at the stack's end.
//!
//! The stack grows down to the first address of a RAM, so an overrun cannot write to a variable.
//! Below that RAM, the memory protection unit forbids every access: an overrun is a hard fault at
//! its first write, whatever is at those addresses.

use cortex_m::peripheral::MPU;

/// First forbidden address. The chips' system memory ends below it.
const FIRST: u32 = 0x1FFF_8000;
/// Forbidden bytes, up to the stack's end: more than any frame has, so that no frame reaches over
/// them.
const BYTES: u32 = 32 * 1024;
/// MPU_RBAR: the region's number, 0, is in this register.
const VALID: u32 = 1 << 4;
/// MPU_RASR: no access at all, no code, `2 ^ (field + 1)` bytes, on.
const NO_ACCESS: u32 = 1 << 28 | (BYTES.ilog2() - 1) << 1 | 1;
/// MPU_CTRL: on, with the default map for addresses outside all regions. Handlers of hard faults
/// run without the unit.
const ON_OVER_DEFAULT: u32 = 1 << 2 | 1;

/// Forbids the addresses below the stack.
pub(crate) fn set_up(mpu: &MPU) {
    // SAFETY: no memory of the program is in the region.
    unsafe {
        mpu.rbar.write(FIRST | VALID);
        mpu.rasr.write(NO_ACCESS);
        mpu.ctrl.write(ON_OVER_DEFAULT);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}

/// Returns true if an address is in the guard.
pub(crate) fn has(address: u32) -> bool {
    (FIRST..FIRST + BYTES).contains(&address)
}
