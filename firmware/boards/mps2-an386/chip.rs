//! The parts of the ARM MPS2 with the AN386 image that this board uses, as the
//! manual of the CMSDK (ARM DDI 0479) lays out their registers: no package
//! ships a register crate for it.

use cortex_m::interrupt::InterruptNumber;
use vcell::VolatileCell;

/// Counts a second of both timers: the board's 25 MHz clock.
pub(crate) const TIMER_HZ: u32 = 25_000_000;

/// A CMSDK APB timer: counts down, reloads after zero.
#[repr(C)]
pub(crate) struct Timer {
    /// [`Timer::RUN`] and [`Timer::INTERRUPT`].
    pub(crate) control: VolatileCell<u32>,
    pub(crate) value: VolatileCell<u32>,
    pub(crate) reload: VolatileCell<u32>,
    /// Reads 1 while the interrupt is pending; writing 1 clears it.
    pub(crate) pending: VolatileCell<u32>,
}

impl Timer {
    pub(crate) const RUN: u32 = 1 << 0;
    pub(crate) const INTERRUPT: u32 = 1 << 3;
}

/// A CMSDK APB UART, one byte deep in either direction.
#[repr(C)]
pub(crate) struct Uart {
    pub(crate) data: VolatileCell<u32>,
    /// [`Uart::TX_FULL`] and [`Uart::RX_FULL`].
    pub(crate) state: VolatileCell<u32>,
    /// Bit 0 transmitter, bit 1 receiver, bits 2 and 3 their interrupts.
    pub(crate) control: VolatileCell<u32>,
    /// Pending interrupts in bits 0 (sent) and 1 (received); writing 1 clears.
    pub(crate) pending: VolatileCell<u32>,
    pub(crate) divider: VolatileCell<u32>,
}

impl Uart {
    pub(crate) const TX_FULL: u32 = 1 << 0;
    pub(crate) const RX_FULL: u32 = 1 << 1;
    pub(crate) const ENABLE: u32 = 0b0011;
    pub(crate) const TX_INTERRUPT: u32 = 1 << 2;
    pub(crate) const RX_INTERRUPT: u32 = 1 << 3;
    pub(crate) const SENT: u32 = 1 << 0;
    pub(crate) const RECEIVED: u32 = 1 << 1;
}

/// The timer of the haptic tick.
pub(crate) fn tick_timer() -> &'static Timer {
    // SAFETY: TIMER0 of the memory map, four words, always there and only ever
    // accessed through volatile cells. `VolatileCell` is not `Sync`, so the
    // reference itself cannot leave the context that asked for it.
    unsafe { &*(0x4000_0000 as *const Timer) }
}

/// The free-running timer that the cost of a tick is measured with.
pub(crate) fn clock_timer() -> &'static Timer {
    // SAFETY: TIMER1 of the memory map; as for `tick_timer`.
    unsafe { &*(0x4000_1000 as *const Timer) }
}

/// The UART of the link to the host.
pub(crate) fn link_uart() -> &'static Uart {
    // SAFETY: UART0 of the memory map, five words; as for `tick_timer`.
    unsafe { &*(0x4000_4000 as *const Uart) }
}

/// The UART of the virtual Phantom: encoder counts in, currents out.
pub(crate) fn plant_uart() -> &'static Uart {
    // SAFETY: UART1 of the memory map, five words; as for `tick_timer`.
    unsafe { &*(0x4000_5000 as *const Uart) }
}

/// The interrupts in use. `Executor` and `TickDone` have no part behind them:
/// they are raised by software.
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

// SAFETY: they are handlers that `#[interrupt]` and cortex-m-rt define under
// these names, with this signature, for the vector table to name.
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
// SAFETY: the section and the name are the ones cortex-m-rt's `device` feature
// asks for, and the table holds functions only.
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
