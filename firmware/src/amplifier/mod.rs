//! Amplifiers made of three current outputs and an enable pin, on
//! embedded-hal's traits, so that a board only names its pins.
//!
//! | output | code |
//! | --- | --- |
//! | a converter on the chip, behind an offset stage | [`offset_code`] |
//! | a duty cycle of 10 to 90 % | [`duty_code`] |
//! | a quad converter on SPI, ±10 V ([`Ad5754`]) | [`bipolar_code`] |

mod ad5754;

use embedded_hal::digital::OutputPin;

pub use ad5754::{Ad5754, FrameBus, bipolar_code};

use crate::board::{Amplifiers, EnabledAmplifiers};

/// The outputs that command the currents of all three axes.
pub trait CurrentOutputs {
    /// Makes the outputs ready, with no current commanded: at start-up, and each
    /// time before the power stages are switched on.
    fn prepare(&mut self) {}

    /// Commands these fractions of the full-scale current, each in -1..=1.
    fn set(&mut self, fractions: [f32; 3]);
}

/// The compare count for `fraction` of full scale, -1..=1, of a timer whose duty cycle
/// is 100 % at `max` counts: for an amplifier that reads 10 % as the largest negative
/// current and 90 % as the largest positive one (Maxon ESCON). Anything outside that
/// range is a broken wire to it. Rounded to the nearest count: cut off, full scale
/// would fall below 10 %.
#[must_use]
pub fn duty_code(fraction: f32, max: u16) -> u16 {
    (f32::from(max) * (0.5 + 0.4 * fraction) + 0.5) as u16
}

/// The converter code for `fraction` of full scale, -1..=1, where the middle of
/// `0..=max` is no current. Rounded to the nearest code, at most half a code off.
#[must_use]
pub fn offset_code(fraction: f32, max: u16) -> u16 {
    let middle = f32::from(max) / 2.0;
    // The cast saturates; the half makes truncation into rounding.
    (middle + middle * fraction + 0.5) as u16
}

/// Three outputs and the pin that switches the power stages, off.
pub struct Off<O, E> {
    outputs: O,
    enable: E,
    full_scale_a: f32,
}

/// Three outputs and the pin that switches the power stages, on.
pub struct On<O, E>(Off<O, E>);

impl<O: CurrentOutputs, E: OutputPin> Off<O, E> {
    /// Takes the outputs for axes 1 to 3, the enable pin (high: on), and the
    /// current in amperes that full scale stands for. Switches off first.
    pub fn new(outputs: O, enable: E, full_scale_a: f32) -> Self {
        let mut off = Self {
            outputs,
            enable,
            full_scale_a,
        };
        let _ = off.enable.set_low();
        off.outputs.prepare();
        off.command([0.0; 3]);
        off
    }

    fn command(&mut self, currents_a: [f32; 3]) {
        self.outputs.set(currents_a.map(|current_a| {
            let fraction = (current_a / self.full_scale_a).clamp(-1.0, 1.0);
            if fraction.is_nan() { 0.0 } else { fraction }
        }));
    }

    fn switch_off(&mut self) {
        // A pin of this chip cannot fail to be written.
        let _ = self.enable.set_low();
        self.command([0.0; 3]);
    }
}

impl<O: CurrentOutputs, E: OutputPin> Amplifiers for Off<O, E> {
    type Enabled = On<O, E>;

    fn enable(mut self) -> On<O, E> {
        self.outputs.prepare();
        self.command([0.0; 3]);
        let _ = self.enable.set_high();
        On(self)
    }
}

impl<O: CurrentOutputs, E: OutputPin> EnabledAmplifiers for On<O, E> {
    type Disabled = Off<O, E>;

    fn write(&mut self, currents_a: [f32; 3]) {
        self.0.command(currents_a);
    }

    fn disable(mut self) -> Off<O, E> {
        self.0.switch_off();
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::RefCell;
    use core::convert::Infallible;
    use embedded_hal::digital;
    use std::rc::Rc;
    use std::string::String;
    use std::vec::Vec;

    /// What was written, in order: "on" and "off" for the pin, numbers for duties.
    type Log = Rc<RefCell<Vec<String>>>;

    struct Fake(Log);

    impl digital::ErrorType for Fake {
        type Error = Infallible;
    }

    impl OutputPin for Fake {
        fn set_low(&mut self) -> Result<(), Infallible> {
            self.0.borrow_mut().push("off".into());
            Ok(())
        }

        fn set_high(&mut self) -> Result<(), Infallible> {
            self.0.borrow_mut().push("on".into());
            Ok(())
        }
    }

    /// Outputs that are duty cycles of 1,000 counts.
    struct Duties(Log);

    impl CurrentOutputs for Duties {
        fn set(&mut self, fractions: [f32; 3]) {
            let codes = fractions.map(|fraction| duty_code(fraction, 1000).to_string());
            self.0.borrow_mut().extend(codes);
        }
    }

    fn amplifiers() -> (Off<Duties, Fake>, Log) {
        let log = Log::default();
        let off = Off::new(Duties(log.clone()), Fake(log.clone()), 5.0);
        assert_eq!(log.take(), ["off", "500", "500", "500"]);
        (off, log)
    }

    #[test]
    fn zero_is_commanded_before_switching_on_and_off_comes_first_after() {
        let (off, log) = amplifiers();
        let mut on = off.enable();
        assert_eq!(log.take(), ["500", "500", "500", "on"]);
        on.write([1.0, -2.5, 0.0]);
        assert_eq!(log.take(), ["580", "300", "500"]);
        let _off = on.disable();
        assert_eq!(log.take(), ["off", "500", "500", "500"]);
    }

    #[test]
    fn the_command_stays_within_10_and_90_percent_whatever_is_asked() {
        let (off, log) = amplifiers();
        let mut on = off.enable();
        log.take();
        on.write([1e30, f32::NEG_INFINITY, f32::NAN]);
        assert_eq!(log.take(), ["900", "100", "500"]);
    }

    #[test]
    fn converter_codes_span_the_range_and_are_nearest() {
        assert_eq!(offset_code(-1.0, 4095), 0);
        assert_eq!(offset_code(0.0, 4095), 2048);
        assert_eq!(offset_code(1.0, 4095), 4095);
        assert_eq!(offset_code(0.25, 4095), 2559);
    }
}
