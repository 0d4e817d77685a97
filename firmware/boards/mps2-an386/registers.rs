//! Registers of the ARM MPS2 with the AN386 image, by the manual of the CMSDK (ARM DDI 0479): no
//! package contains a register crate for it.

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
    /// Max register reads for a byte; after that, no reader is assumed.
    const TIMEOUT: u32 = 1_000_000;

    /// Enables the port; `control` selects its halves and interrupts.
    pub(crate) fn enable(&self, control: u32) {
        // The minimum divider of the part; QEMU sends at once anyway.
        self.divider.set(16);
        self.control.set(control);
    }

    /// Sends a byte without any interrupt, or drops it after a time-out.
    pub(crate) fn send(&self, byte: u8) {
        for _ in 0..Self::TIMEOUT {
            if self.state.get() & Self::TX_FULL == 0 {
                return self.data.set(u32::from(byte));
            }
        }
    }
}

/// Returns TIMER0: the timer of the haptic tick.
pub(crate) fn tick_timer() -> &'static Timer {
    // SAFETY: TIMER0 of the memory map, four words, always present and only accessed through
    // volatile cells. `VolatileCell` is not `Sync`, so the reference cannot leave its caller's
    // context.
    unsafe { &*(0x4000_0000 as *const Timer) }
}

/// Returns TIMER1: the free-running timer that measures the cost of a tick.
pub(crate) fn clock_timer() -> &'static Timer {
    // SAFETY: TIMER1 of the memory map; as for `tick_timer`.
    unsafe { &*(0x4000_1000 as *const Timer) }
}

/// Returns UART0: the link to the host.
pub(crate) fn link_uart() -> &'static Uart {
    // SAFETY: UART0 of the memory map, five words; as for `tick_timer`.
    unsafe { &*(0x4000_4000 as *const Uart) }
}

/// Returns UART1: the virtual Phantom, encoder counts in and currents out.
pub(crate) fn plant_uart() -> &'static Uart {
    // SAFETY: UART1 of the memory map, five words; as for `tick_timer`.
    unsafe { &*(0x4000_5000 as *const Uart) }
}

/// Returns UART2: the reason of a failure.
pub(crate) fn report_uart() -> &'static Uart {
    // SAFETY: UART2 of the memory map, five words; as for `tick_timer`.
    unsafe { &*(0x4000_6000 as *const Uart) }
}

/// Returns UART3: log lines.
pub(crate) fn log_uart() -> &'static Uart {
    // SAFETY: UART3 of the memory map, five words; as for `tick_timer`.
    unsafe { &*(0x4000_7000 as *const Uart) }
}
