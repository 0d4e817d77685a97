//! The end of a program that failed: amplifiers off, then a report.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m_rt::{ExceptionFrame, exception};
use hapterra_core::wire::frame::encode;
use hapterra_core::wire::plant::Currents;

use crate::ending;
use crate::registers::plant_uart;

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    amplifiers_off();
    ending::failed(format_args!("{info}"))
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    amplifiers_off();
    ending::failed(format_args!("hard fault: {frame:?}"))
}

#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    amplifiers_off();
    ending::failed(format_args!("interrupt {number} has no handler"))
}

/// Reports to the plant that there is no current. Needs no interrupt, task or queue, because any of
/// them may have failed.
fn amplifiers_off() {
    static ONCE: AtomicBool = AtomicBool::new(false);
    cortex_m::interrupt::disable();
    if ONCE.swap(true, Ordering::Relaxed) {
        return;
    }
    let off = Currents {
        tick: u32::MAX,
        currents_a: [0.0; 3],
        enabled: false,
        tick_ns: 0,
    };
    let mut frame = [0; 64];
    let uart = plant_uart();
    // A zero first, to end a frame that may have been in progress.
    uart.send(0);
    for byte in encode(&off, &mut frame).unwrap_or(&[]) {
        uart.send(*byte);
    }
}
