//! Commands as voltages of the chip's own converters, which ADC2 reads back at their pins.

use core::sync::atomic::{AtomicU8, Ordering};

use embassy_stm32::adc::Adc;
use embassy_stm32::pac::adc::regs::{Smpr, Smpr2};
use embassy_stm32::pac::dac::Dac;
use embassy_stm32::pac::dac::vals::Mode;
use embassy_stm32::peripherals::{ADC2, DAC1, DAC2, PA4, PA5, PA6};
use embassy_stm32::{Peri, pac, rcc};
use hapterra_firmware::amplifier::{CURRENT_LOOP_US, CurrentOutputs, offset_code};

use crate::stm32::injected::Injected;

/// The image's name.
pub(crate) const BOARD: &str = "nucleo-g474re";
/// Maximum time from the beginning of a tick until the motors have its current, µs: 197 to the
/// outputs (docs/reference/hardware.md), 3 until they settle, and the amplifiers' own time.
pub(crate) const LATENCY_US: u16 = 197 + 3 + CURRENT_LOOP_US;

/// Three converters, buffered, each before an offset stage: the middle of the range is no current.
pub(crate) struct Outputs {
    /// Keeps the converter's configuration.
    _read_back: Adc<'static, ADC2>,
}

/// ADC2's channels at PA4, PA5 and PA6 (data sheet, table of pins).
const READ_BACK: [u8; 3] = [17, 13, 3];
/// Max difference between a pin's reading and its command, codes: 50 mV, twice the sum of the
/// errors of a buffered output and of the converter, and 3.6 % of full scale.
const MAX_DIFFERENCE: u16 = 64;
/// Ticks in a row in which a pin differs until this is a failure: the conversion of one tick may
/// coincide with the next command.
const MAX_TICKS: u8 = 3;

/// Ticks in a row in which a pin differed, or was not measured.
static DIFFERING: AtomicU8 = AtomicU8::new(0);

/// The sequence that reads the pins. [`new`] sets it up.
const SEQUENCE: Injected = Injected(pac::ADC2);

/// MCR.HFSEL: a channel's wait on a bus faster than 160 MHz.
const FASTEST_BUS: u8 = 0b10;

/// Claims the converters and their pins, which are analogue since the reset. A channel is switched
/// on only after it has the code for no current: its initial 0 V would be beyond full scale.
/// embassy's own function switches a channel on before it sets a code.
pub(crate) fn new(
    _: Peri<'static, DAC1>,
    _: Peri<'static, PA4>,
    _: Peri<'static, PA5>,
    _: Peri<'static, DAC2>,
    _: Peri<'static, PA6>,
    read_back: Adc<'static, ADC2>,
) -> Outputs {
    rcc::enable_and_reset::<DAC1>();
    rcc::enable_and_reset::<DAC2>();
    pac::ADC2.smpr().write_value(Smpr(0o6_666_666_666));
    pac::ADC2.smpr2().write_value(Smpr2(0o666_666_666));
    SEQUENCE.set_up(READ_BACK);
    let mut outputs = Outputs {
        _read_back: read_back,
    };
    outputs.set([0.0; 3]);
    switch_on(pac::DAC1, &[0, 1]);
    switch_on(pac::DAC2, &[0]);
    outputs
}

/// Connects channels of a converter to their pins, buffered.
fn switch_on(converter: Dac, channels: &[usize]) {
    converter.mcr().write(|w| {
        w.set_hfsel(FASTEST_BUS);
        for channel in channels {
            w.set_mode(*channel, Mode::NORMAL_EXT_BUFEN);
        }
    });
    converter.cr().write(|w| {
        for channel in channels {
            w.set_en(*channel, true);
        }
    });
}

impl CurrentOutputs for Outputs {
    /// Writes the registers directly: embassy's own function asserts the channel's number at each
    /// write, and a tick must not panic.
    fn set(&mut self, fractions: [f32; 3]) {
        let [first, second, third] = fractions.map(offset_code);
        pac::DAC1.dhr12r(0).write(|w| w.set_dhr(first));
        pac::DAC1.dhr12r(1).write(|w| w.set_dhr(second));
        pac::DAC2.dhr12r(0).write(|w| w.set_dhr(third));
        // The first conversion is not read; the outputs have settled at the next one.
        SEQUENCE.start();
    }
}

/// Returns true if the pins read the last command, within [`MAX_DIFFERENCE`].
fn reads_back() -> bool {
    let set = [
        pac::DAC1.dhr12r(0).read().dhr(),
        pac::DAC1.dhr12r(1).read().dhr(),
        pac::DAC2.dhr12r(0).read().dhr(),
    ];
    let read = SEQUENCE.read();
    read.is_some_and(|read| {
        let mut pairs = set.into_iter().zip(read);
        pairs.all(|(set, read)| set.abs_diff(read) <= MAX_DIFFERENCE)
    })
}

/// Returns true if the outputs have failed: a converter on the chip does not report that.
pub(crate) const fn failed() -> bool {
    false
}

/// Returns true if a pin has differed from its command in [`MAX_TICKS`] ticks in a row. Called once
/// in a tick, before the next command.
pub(crate) fn not_as_set() -> bool {
    let ticks = match reads_back() {
        true => 0,
        false => DIFFERING.load(Ordering::Relaxed).saturating_add(1),
    };
    DIFFERING.store(ticks, Ordering::Relaxed);
    ticks >= MAX_TICKS
}
