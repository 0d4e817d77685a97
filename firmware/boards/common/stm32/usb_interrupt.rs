//! USB's interrupt, whose work a task does.
//!
//! embassy's handlers check their input with panics: an endpoint number that the peripheral
//! reports, a packet longer than its buffer. No interrupt of this firmware may reach a panic
//! (`cargo xtask panics`), so the vector only masks its own line and wakes a task, which runs
//! embassy's handler and unmasks the line. Meanwhile the peripheral answers NAK, as with any slow
//! task.

use cortex_m::peripheral::NVIC;
use embassy_stm32::interrupt::typelevel::Handler;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

use crate::chip::{USB_INTERRUPT, UsbInterrupt, UsbWork};

/// Raised when the line is masked and the task has work.
static RAISED: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Runs the interrupt's vector.
pub(crate) fn raised() {
    NVIC::mask(USB_INTERRUPT);
    RAISED.signal(());
}

/// Does the work of each interrupt, forever.
pub(crate) async fn serve() {
    loop {
        RAISED.wait().await;
        // SAFETY: this handler's interrupt cannot occur while its line is masked, and no other task
        // uses the driver while this one runs.
        unsafe { <UsbWork as Handler<UsbInterrupt>>::on_interrupt() };
        // SAFETY: critical sections mask it by its priority, as before.
        unsafe { NVIC::unmask(USB_INTERRUPT) };
    }
}
