//! Commands as voltages of the chip's own converters.

use embassy_stm32::pac::dac::Dac;
use embassy_stm32::pac::dac::vals::Mode;
use embassy_stm32::peripherals::{DAC1, DAC2, PA4, PA5, PA6};
use embassy_stm32::{Peri, pac, rcc};
use hapterra_firmware::amplifier::{CURRENT_LOOP_US, CurrentOutputs, offset_code};

/// The image's name.
pub(crate) const BOARD: &str = "nucleo-g474re";
/// From the beginning of a tick until the motors have its current, at most, µs: 80 to the
/// outputs (docs/hardware.md), and the amplifiers' own time.
pub(crate) const LATENCY_US: u16 = 80 + CURRENT_LOOP_US;

/// Three converters, buffered, each behind an offset stage: the middle of the range is no
/// current.
pub(crate) struct Outputs(());

/// MCR.HFSEL: how long a channel waits for a bus faster than 160 MHz.
const FASTEST_BUS: u8 = 0b10;

/// Takes the converters and their pins, which are analogue since the reset. A channel is
/// switched on only when it holds the code for no current: it would begin with 0 V, which is
/// beyond full scale. embassy's own way switches a channel on before it takes a code.
pub(crate) fn new(
    _: Peri<'static, DAC1>,
    _: Peri<'static, PA4>,
    _: Peri<'static, PA5>,
    _: Peri<'static, DAC2>,
    _: Peri<'static, PA6>,
) -> Outputs {
    rcc::enable_and_reset::<DAC1>();
    rcc::enable_and_reset::<DAC2>();
    let mut outputs = Outputs(());
    outputs.set([0.0; 3]);
    switch_on(pac::DAC1, &[0, 1]);
    switch_on(pac::DAC2, &[0]);
    outputs
}

/// Gives channels of a converter to their pins, buffered.
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
    /// Writes the registers: embassy's own way asserts the channel's number at each
    /// write, and nothing in a tick may panic.
    fn set(&mut self, fractions: [f32; 3]) {
        let [first, second, third] = fractions.map(offset_code);
        pac::DAC1.dhr12r(0).write(|w| w.set_dhr(first));
        pac::DAC1.dhr12r(1).write(|w| w.set_dhr(second));
        pac::DAC2.dhr12r(0).write(|w| w.set_dhr(third));
    }
}

/// Whether the outputs have failed: a converter on the chip cannot tell.
pub(crate) const fn failed() -> bool {
    false
}

/// Whether the outputs are not as they were set: a converter on the chip cannot tell.
pub(crate) const fn not_as_set() -> bool {
    false
}
