//! The end of a program that failed: amplifiers off, a report, then the reset
//! that the starved watchdog brings.

use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, exception};

use crate::amplifiers_off;

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    stop();
    defmt::error!("{}", defmt::Display2Format(info));
    rest()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    stop();
    defmt::error!("hard fault: {}", defmt::Debug2Format(frame));
    rest()
}

#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    stop();
    defmt::error!("interrupt {} has no handler", number);
    rest()
}

/// Amplifiers off before anything else, and no interrupt that could turn them
/// on again.
fn stop() {
    cortex_m::interrupt::disable();
    amplifiers_off();
}

fn rest() -> ! {
    loop {
        cortex_m::asm::nop();
    }
}
