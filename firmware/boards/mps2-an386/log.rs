//! Log lines (defmt) on UART3, for `defmt-print`; QEMU drops them without a fourth `-serial`.

use core::convert::Infallible;

use embedded_io::{ErrorType, Write};
use static_cell::ConstStaticCell;

use crate::registers::{Uart, log_uart};

static LOG: ConstStaticCell<LogUart> = ConstStaticCell::new(LogUart);

/// Sends log lines to UART3 from now on.
pub(crate) fn start() {
    log_uart().enable(Uart::ENABLE);
    defmt_serial::defmt_serial(LOG.take());
}

struct LogUart;

impl ErrorType for LogUart {
    type Error = Infallible;
}

impl Write for LogUart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        bytes.iter().for_each(|byte| log_uart().send(*byte));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
