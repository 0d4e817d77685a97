//! Interrupt-driven serial ports as `embedded-io-async` streams.
//!
//! QEMU delivers the next byte only after the one-byte receive register was read. While the ring is
//! full, the byte stays in the register and the receive interrupt is off, so QEMU delays the
//! sender: nothing is lost.

use core::convert::Infallible;

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embassy_sync::signal::Signal;
use embedded_io_async::{ErrorType, Read, Write};

use crate::registers::Uart;

/// State that an interrupt handler and the two halves of one port share.
pub(crate) struct Serial {
    uart: fn() -> &'static Uart,
    received: Pipe<CriticalSectionRawMutex, 512>,
    sent: Signal<CriticalSectionRawMutex, ()>,
}

impl Serial {
    pub(crate) const fn new(uart: fn() -> &'static Uart) -> Self {
        Self {
            uart,
            received: Pipe::new(),
            sent: Signal::new(),
        }
    }

    /// Enables the port and returns its two halves.
    pub(crate) fn open(&'static self) -> (Receiver, Sender) {
        let uart = (self.uart)();
        uart.enable(Uart::ENABLE | Uart::TX_INTERRUPT | Uart::RX_INTERRUPT);
        (Receiver(self), Sender(self))
    }

    /// Handles the receive interrupt: reads the byte if the ring has room.
    pub(crate) fn on_received(&self) {
        let uart = (self.uart)();
        uart.pending.set(Uart::RECEIVED);
        while uart.state.get() & Uart::RX_FULL != 0 {
            if self.received.is_full() {
                self.listen(false);
                return;
            }
            let byte = uart.data.get() as u8;
            // There is room: only this handler writes.
            let _ = self.received.try_write(&[byte]);
        }
    }

    /// Handles the transmit interrupt: the register is free again.
    pub(crate) fn on_sent(&self) {
        (self.uart)().pending.set(Uart::SENT);
        self.sent.signal(());
    }

    /// Enables or disables the receive interrupt.
    fn listen(&self, on: bool) {
        let control = &(self.uart)().control;
        let others = control.get() & !Uart::RX_INTERRUPT;
        control.set(others | if on { Uart::RX_INTERRUPT } else { 0 });
    }
}

/// The receiving half.
pub(crate) struct Receiver(&'static Serial);

impl ErrorType for Receiver {
    type Error = Infallible;
}

impl Read for Receiver {
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
        let n = self.0.received.read(bytes).await;
        critical_section::with(|_| {
            // A byte may have waited in the register since the ring was full.
            self.0.on_received();
            self.0.listen(!self.0.received.is_full());
        });
        Ok(n)
    }
}

/// The sending half.
pub(crate) struct Sender(&'static Serial);

impl ErrorType for Sender {
    type Error = Infallible;
}

impl Write for Sender {
    /// Sends at least one byte: as many as the register takes without waiting.
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let uart = (self.0.uart)();
        while uart.state.get() & Uart::TX_FULL != 0 {
            self.0.sent.wait().await;
        }
        let mut sent = 0;
        for byte in bytes {
            if uart.state.get() & Uart::TX_FULL != 0 {
                break;
            }
            uart.data.set(u32::from(*byte));
            sent += 1;
        }
        Ok(sent)
    }

    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
