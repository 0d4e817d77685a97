//! USB's interrupt, whose work a task does.
//!
//! embassy's handlers check what they find with panics: an endpoint's number that the
//! peripheral says, a packet longer than its buffer. No interrupt of ours is to reach a panic
//! (`cargo xtask panics`), so the vector only closes its own line and wakes a task, which runs
//! embassy's handler and opens the line again. A peripheral that waits answers NAK, as it does
//! whenever a task is slow.

use cortex_m::peripheral::NVIC;
use embassy_stm32::interrupt::typelevel::Handler;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

use crate::chip::{USB_INTERRUPT, UsbInterrupt, UsbWork};

/// The line is closed, and the task has something to do.
static RAISED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Runs the interrupt's vector.
pub(crate) fn raised() {
    NVIC::mask(USB_INTERRUPT);
    RAISED.signal(());
}

/// Does the work of each interrupt, for ever.
pub(crate) async fn serve() {
    loop {
        RAISED.wait().await;
        // SAFETY: the interrupt that this is the handler of cannot come while its line is
        // closed, and no other task is in the driver while this one runs.
        unsafe { <UsbWork as Handler<UsbInterrupt>>::on_interrupt() };
        // SAFETY: critical sections hold it back as before, by its priority.
        unsafe { NVIC::unmask(USB_INTERRUPT) };
    }
}
