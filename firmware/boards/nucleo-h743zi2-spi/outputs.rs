//! Commands through a quad converter on SPI4.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::SPI4 as REGISTERS;
use embassy_stm32::pac::spi::vals::Comm;
use embassy_stm32::peripherals::{PE11, PE12, PE14, SPI4};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Config, MODE_1, Spi};
use embassy_stm32::time::Hertz;
use hapterra_firmware::amplifier::{Ad5754, FrameBus};

/// The image's name.
pub(crate) const BOARD: &str = "nucleo-h743zi2-spi";
/// Half of what the converter takes, for wires of a hand's length: a frame is
/// 1.6 µs long.
const SPI_HZ: u32 = 15_000_000;
/// A frame's bytes, which is also what the transmit FIFO surely holds.
const FRAME: usize = 3;
/// Looks at the status until a frame is sent. Each takes four cycles of the
/// bus' 120 MHz at least, so this is 33 µs, twenty frames.
const PATIENCE: u32 = 1_000;

/// Set for good when a frame did not go out: what the converter holds is then unknown,
/// and the tick switches off.
static FAILED: AtomicBool = AtomicBool::new(false);

pub(crate) type Outputs = Ad5754<Bus>;

/// Takes what is needed out of the chip's peripherals. A macro, because a function
/// would have to take all of them.
macro_rules! take_outputs {
    ($p:ident) => {
        crate::outputs::new($p.SPI4, $p.PE12, $p.PE14, $p.PE11)
    };
}
pub(crate) use take_outputs;

pub(crate) fn new(
    spi: Peri<'static, SPI4>,
    clock: Peri<'static, PE12>,
    data: Peri<'static, PE14>,
    sync: Peri<'static, PE11>,
) -> Outputs {
    let mut config = Config::default();
    config.mode = MODE_1;
    config.frequency = Hertz(SPI_HZ);
    config.gpio_speed = Speed::High;
    let spi = Spi::new_blocking_txonly(spi, clock, data, config);
    REGISTERS.cr1().modify(|w| w.set_spe(false));
    // Nothing comes back, so nothing can overrun.
    REGISTERS.cfg2().modify(|w| w.set_comm(Comm::TRANSMITTER));
    REGISTERS.cr2().write(|w| w.set_tsize(FRAME as u16));
    Ad5754(Bus {
        sync: Output::new(sync, Level::High, Speed::High),
        _spi: spi,
    })
}

/// Whether a frame did not go out.
pub(crate) fn failed() -> bool {
    FAILED.load(Ordering::Relaxed)
}

/// SPI4, frame by frame.
///
/// embassy sets the bus up but does not send, because its waiting has no bound. Here a
/// frame is sent as the reference manual (RM0433, 50.4.9) has it for a known number of
/// bytes, and waited for at most [`PATIENCE`] looks.
pub(crate) struct Bus {
    sync: Output<'static>,
    /// Keeps clock and pins as they were set up.
    _spi: Spi<'static, Blocking, Master>,
}

impl FrameBus for Bus {
    fn send(&mut self, frame: [u8; FRAME]) {
        self.sync.set_low();
        REGISTERS.cr1().modify(|w| w.set_spe(true));
        REGISTERS.cr1().modify(|w| w.set_cstart(true));
        for byte in frame {
            REGISTERS.txdr8().write_value(byte);
        }
        let sent = (0..PATIENCE).any(|_| REGISTERS.sr().read().eot());
        REGISTERS.ifcr().write(|w| {
            w.set_eotc(true);
            w.set_txtfc(true);
        });
        REGISTERS.cr1().modify(|w| w.set_spe(false));
        self.sync.set_high();
        if !sent {
            FAILED.store(true, Ordering::Relaxed);
        }
    }
}
