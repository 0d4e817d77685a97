//! Feedback of the amplifiers: a ready line of each, and a current monitor of each if they have
//! one.

use embassy_stm32::adc::{Adc, AnyAdcChannel};
use embassy_stm32::gpio::Input;
use embassy_stm32::pac::ADC1 as REGISTERS;
use embassy_stm32::peripherals::ADC1;
use hapterra_firmware::amplifier::monitor_ma;

use super::clock::TICK_HZ;
use super::injected::Injected;
use super::start::FULL_SCALE_A;
use crate::chip::{SEQUENCE_US, sample_slowly};

// Conversions that a tick starts end before the next one, with a margin of a tenth of the period.
const _: () = assert!(SEQUENCE_US * TICK_HZ <= 900_000);

/// The amplifiers' ready lines and current monitors, axes 1 to 3.
pub(crate) struct Feedback {
    /// Pulled low by an amplifier that is ready: high if one is not ready, and if its wire is
    /// broken.
    pub(crate) ready: [Input<'static>; 3],
    /// Closed to ground if the monitors are wired.
    pub(crate) monitors_fitted: Input<'static>,
    pub(crate) monitors: Monitors,
}

impl Feedback {
    /// Returns true if an amplifier is not ready.
    pub(crate) fn is_unready(&self) -> bool {
        self.ready.iter().any(Input::is_high)
    }

    /// Returns the currents in mA as of the previous tick, if there are monitors, or an error if
    /// the conversions have not ended. Starts the next ones.
    pub(crate) fn measure_ma(&self) -> Result<Option<[i16; 3]>, NotConverted> {
        let codes = self.monitors.read();
        if self.monitors_fitted.is_high() {
            return Ok(None);
        }
        let of = |code| monitor_ma(code, FULL_SCALE_A);
        codes.map(|codes| Some(codes.map(of))).ok_or(NotConverted)
    }
}

/// Error: the converter has not completed the conversions of the previous tick.
pub(crate) struct NotConverted;

/// The sequence that reads the monitors.
const SEQUENCE: Injected = Injected(REGISTERS);

/// The three monitors on ADC1.
pub(crate) struct Monitors {
    /// Keeps the converter's configuration.
    _adc: Adc<'static, ADC1>,
}

impl Monitors {
    /// Claims the converter and the channels of axes 1 to 3. Starts the first sequence.
    pub(crate) fn new(
        adc: Adc<'static, ADC1>,
        channels: [AnyAdcChannel<'static, ADC1>; 3],
    ) -> Self {
        let channels = channels.map(|channel| channel.get_hw_channel());
        sample_slowly(channels);
        SEQUENCE.set_up(channels);
        SEQUENCE.start();
        Self { _adc: adc }
    }

    /// Returns the conversions since the last call if all are complete, and starts the next ones.
    fn read(&self) -> Option<[u16; 3]> {
        let codes = SEQUENCE.read();
        SEQUENCE.start();
        codes
    }
}
