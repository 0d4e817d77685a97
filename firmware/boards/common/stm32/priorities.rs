//! Interrupt priorities.

use cortex_m::Peripherals;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::Interrupt;

use super::clock;

/// The priority of all interrupts except the haptic one. embassy leaves interrupts at priority 0,
/// which critical sections by BASEPRI would not mask.
pub(crate) const OTHERS: Priority = Priority::P6;

/// The priority of the supply's interrupt, which ends the program. It is above the tick, which
/// could switch the amplifiers on again.
const SUPPLY: Priority = Priority::P0;
/// The priority of the haptic interrupt, above the ceiling of critical sections.
const HAPTIC: Priority = Priority::P1;

/// Sets every interrupt below the ceiling of critical sections, before any is enabled.
/// [`start_tick`] raises the haptic one above it afterwards.
pub(crate) fn lower_all(core: &mut Peripherals) {
    // All possible ones; a chip ignores those that it does not have.
    for priority in core.NVIC.ipr.iter().take(240) {
        // SAFETY: no interrupt is enabled yet, so no critical section and no handler depends on the
        // previous priorities.
        unsafe { priority.write(OTHERS as u8) };
    }
}

/// Enables the interrupt that ends the program when the supply falls, above all others.
pub(crate) fn start_supply_watch(supply: Interrupt) {
    supply.set_priority(SUPPLY);
    // SAFETY: its handler enters no critical section and does not return.
    unsafe { supply.enable() };
}

/// Enables the haptic interrupt, above the ceiling of critical sections, and `done`, which the
/// haptic one raises, below it. Then starts the timer.
pub(crate) fn start_tick(haptic: Interrupt, done: Interrupt) {
    haptic.set_priority(HAPTIC);
    haptic.pend();
    for interrupt in [done, haptic] {
        // SAFETY: their handlers are ready. Critical sections do not mask the haptic one, which
        // enters none after its first call.
        unsafe { interrupt.enable() };
    }
    clock::start();
}
