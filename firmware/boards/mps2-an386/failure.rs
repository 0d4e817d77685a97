//! The end of a program that failed: amplifiers off, a report, exit code 1.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m_rt::{ExceptionFrame, exception};
use hapterra_core::wire::frame::encode;
use hapterra_core::wire::plant::Currents;

use crate::registers::{Uart, plant_uart};

/// Register reads that a byte may take; then nobody is listening.
const PATIENCE: u32 = 1_000_000;

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    amplifiers_off();
    semihosting::eprintln!("{info}");
    semihosting::process::exit(1)
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    amplifiers_off();
    semihosting::eprintln!("hard fault: {frame:?}");
    semihosting::process::exit(1)
}

#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    amplifiers_off();
    semihosting::eprintln!("interrupt {number} has no handler");
    semihosting::process::exit(1)
}

/// Tells the plant that there is no current, past everything that may be broken: without
/// interrupt, task or queue.
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
    // A zero first, to end the frame that may have been under way.
    send(uart, 0);
    for byte in encode(&off, &mut frame).unwrap_or(&[]) {
        send(uart, *byte);
    }
}

fn send(uart: &Uart, byte: u8) {
    for _ in 0..PATIENCE {
        if uart.state.get() & Uart::TX_FULL == 0 {
            return uart.data.set(u32::from(byte));
        }
    }
}
