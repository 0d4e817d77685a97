//! Commands through a quad converter on SPI4.

use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m::peripheral::DWT;
use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, Pull, Speed};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::SPI4 as REGISTERS;
use embassy_stm32::peripherals::{PE11, PE12, PE13, PE14, SPI4};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Config, MODE_1, Spi};
use embassy_stm32::time::Hertz;
use hapterra_firmware::amplifier::{Ad5754, CURRENT_LOOP_US, FrameBus};

/// The image's name.
pub(crate) const BOARD: &str = "nucleo-h743zi2-spi";
/// Maximum time from the beginning of a tick until the motors have its current, µs: 125 to the
/// outputs (docs/reference/hardware.md), 15 until the converter has all frames, 10 until it
/// settles, and the amplifiers' own time.
pub(crate) const LATENCY_US: u16 = 125 + 15 + 10 + CURRENT_LOOP_US;
/// Requested clock; the bus's 114 MHz divide to 7.1 MHz, half a clock is 70 ns. The converter's
/// output is valid 40 ns after the rising edge and is read at the falling one, through wires of a
/// hand's length. A frame is 3.4 µs long.
const SPI_HZ: u32 = 7_500_000;
/// A frame's bytes, which the FIFOs can hold.
const FRAME: usize = 3;
/// Max readings of the status until a frame is sent. Each takes at least four cycles of the bus'
/// 114 MHz, so this is 35 µs, ten frames.
const TIMEOUT: u32 = 1_000;
/// Core cycles in a microsecond.
const CYCLES_PER_US: u32 = 456;
/// Core cycles for which SYNC stays high at least: 250 ns, including the pin's rise time.
const SYNC_HIGH: u32 = CYCLES_PER_US / 4;

/// Set permanently when a frame was not sent: the converter's state is then unknown, and the tick
/// switches off.
static FAILED: AtomicBool = AtomicBool::new(false);
/// True if the converter's registers did not read back as they were set.
static NOT_AS_SET: AtomicBool = AtomicBool::new(true);

pub(crate) type Outputs = Ad5754<Bus>;

/// Moves the outputs' parts out of the chip's peripherals. A macro, because a function would need
/// all of them.
macro_rules! take_outputs {
    ($p:ident) => {
        crate::outputs::new($p.SPI4, $p.PE12, $p.PE14, $p.PE13, $p.PE11)
    };
}
pub(crate) use take_outputs;

pub(crate) fn new(
    spi: Peri<'static, SPI4>,
    clock: Peri<'static, PE12>,
    to_converter: Peri<'static, PE14>,
    from_converter: Peri<'static, PE13>,
    sync: Peri<'static, PE11>,
) -> Outputs {
    let mut config = Config::default();
    config.mode = MODE_1;
    config.frequency = Hertz(SPI_HZ);
    config.gpio_speed = Speed::High;
    // A broken wire reads as ones, a value that no register of the converter has.
    config.miso_pull = Pull::Up;
    let spi = Spi::new_blocking(spi, clock, to_converter, from_converter, config);
    REGISTERS.cr1().modify(|w| w.set_spe(false));
    REGISTERS.cr2().write(|w| w.set_tsize(FRAME as u16));
    Ad5754::new(Bus {
        sync: Output::new(sync, Level::High, Speed::High),
        rose: DWT::cycle_count(),
        _spi: spi,
    })
}

/// Returns true if a frame was not sent.
pub(crate) fn failed() -> bool {
    FAILED.load(Ordering::Relaxed)
}

/// Returns true if the converter's registers do not read back as they were set.
pub(crate) fn not_as_set() -> bool {
    NOT_AS_SET.load(Ordering::Relaxed)
}

/// SPI4, frame by frame.
///
/// embassy sets up the bus but does not send, because its waiting has no bound. Here a frame is
/// sent by the procedure in the reference manual (RM0433, 50.4.9) for a known number of bytes, with
/// at most [`TIMEOUT`] readings of the status.
pub(crate) struct Bus {
    sync: Output<'static>,
    /// The cycle in which SYNC rose.
    rose: u32,
    /// Keeps the configuration of clock and pins.
    _spi: Spi<'static, Blocking, Master>,
}

/// Waits until `cycles` cycles have passed since `from`, for at most as many readings of the
/// counter: a reading takes at least a cycle.
fn wait(from: u32, cycles: u32) {
    let _ = (0..cycles).any(|_| DWT::cycle_count().wrapping_sub(from) >= cycles);
}

impl FrameBus for Bus {
    fn send(&mut self, frame: [u8; FRAME]) -> [u8; FRAME] {
        if failed() {
            return [u8::MAX; FRAME];
        }
        wait(self.rose, SYNC_HIGH);
        self.sync.set_low();
        REGISTERS.cr1().modify(|w| w.set_spe(true));
        REGISTERS.cr1().modify(|w| w.set_cstart(true));
        for byte in frame {
            REGISTERS.txdr8().write_value(byte);
        }
        let sent = (0..TIMEOUT).any(|_| REGISTERS.sr().read().eot());
        let back = frame.map(|_| REGISTERS.rxdr8().read());
        REGISTERS.ifcr().write(|w| {
            w.set_eotc(true);
            w.set_txtfc(true);
        });
        REGISTERS.cr1().modify(|w| w.set_spe(false));
        self.sync.set_high();
        self.rose = DWT::cycle_count();
        if !sent {
            FAILED.store(true, Ordering::Relaxed);
        }
        back
    }

    fn pause_us(&mut self, us: u32) {
        wait(DWT::cycle_count(), us.saturating_mul(CYCLES_PER_US));
    }

    fn report_state(&mut self, as_set: bool) {
        NOT_AS_SET.store(!as_set, Ordering::Relaxed);
    }
}
