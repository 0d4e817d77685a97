//! The end of the program. The chip resets itself, and QEMU ends there (`-no-reboot`).
//! A failure is reported on UART2 before; a good end reports nothing.
//!
//! Semihosting could end the program, too, with an exit code. It could as well read and
//! write every file of the host, so QEMU runs without it.

use core::fmt::{self, Write};

use cortex_m::peripheral::SCB;

use crate::registers::{Uart, report_uart};

/// Ends the program: the host closed the session.
pub(crate) fn done() -> ! {
    SCB::sys_reset()
}

/// Ends the program and tells why.
pub(crate) fn failed(why: fmt::Arguments<'_>) -> ! {
    let uart = report_uart();
    uart.enable(Uart::ENABLE);
    // Without a reader the program ends all the same.
    let _ = writeln!(Report(uart), "{why}");
    SCB::sys_reset()
}

struct Report(&'static Uart);

impl Write for Report {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        text.bytes().for_each(|byte| self.0.send(byte));
        Ok(())
    }
}
