//! The end of the program. The chip resets itself, and QEMU ends then (`-no-reboot`). A failure is
//! reported on UART2 before; a normal end reports nothing.
//!
//! Semihosting could also end the program, with an exit code. But it could read and write every
//! file of the host, so QEMU runs without it.

use core::fmt::{self, Write};

use cortex_m::peripheral::SCB;

use crate::registers::{Uart, report_uart};

/// Ends the program: the host closed the session.
pub(crate) fn done() -> ! {
    SCB::sys_reset()
}

/// Ends the program and reports why.
pub(crate) fn failed(why: fmt::Arguments<'_>) -> ! {
    let uart = report_uart();
    uart.enable(Uart::ENABLE);
    // Without a reader, the program also ends.
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
