//! The interrupts of the emulated board and their vector table.

use cortex_m::interrupt::InterruptNumber;

/// The interrupts in use. Software raises `Executor` and `TickDone`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub(crate) enum Interrupt {
    LinkReceived = 0,
    LinkSent = 1,
    PlantReceived = 2,
    PlantSent = 3,
    HapticTick = 8,
    Executor = 30,
    TickDone = 31,
}

// SAFETY: each number is the position of that interrupt in `__INTERRUPTS`.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

// SAFETY: they are handlers that `#[interrupt]` and cortex-m-rt define under these names, with this
// signature, for the vector table.
unsafe extern "C" {
    safe fn LinkReceived();
    safe fn LinkSent();
    safe fn PlantReceived();
    safe fn PlantSent();
    safe fn HapticTick();
    safe fn Executor();
    safe fn TickDone();
    safe fn DefaultHandler();
}

/// The vector table behind the core's own sixteen entries.
// SAFETY: cortex-m-rt's `device` feature requires this section and this name, and the table
// contains only functions.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [extern "C" fn(); 32] = vectors();

const fn vectors() -> [extern "C" fn(); 32] {
    let mut table: [extern "C" fn(); 32] = [DefaultHandler; 32];
    table[Interrupt::LinkReceived as usize] = LinkReceived;
    table[Interrupt::LinkSent as usize] = LinkSent;
    table[Interrupt::PlantReceived as usize] = PlantReceived;
    table[Interrupt::PlantSent as usize] = PlantSent;
    table[Interrupt::HapticTick as usize] = HapticTick;
    table[Interrupt::Executor as usize] = Executor;
    table[Interrupt::TickDone as usize] = TickDone;
    table
}
