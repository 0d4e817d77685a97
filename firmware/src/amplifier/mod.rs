//! Amplifiers made of three current outputs and an enable pin, on
//! embedded-hal's traits, so that a board only names its pins.
//!
//! | output | code |
//! | --- | --- |
//! | a converter on the chip, behind an offset stage | [`offset_code`] |
//! | a duty cycle of 15 to 85 % | [`duty_code`] |
//! | a quad converter on SPI, ±10 V ([`Ad5754`]) | [`bipolar_code`] |
//!
//! [`monitor_ma`] is the inverse: from a current monitor to milliamperes.

mod ad5754;
mod duty;
mod offset;

use embedded_hal::digital::OutputPin;

pub use ad5754::{Ad5754, FrameBus, bipolar_code};
pub use duty::{DUTY_HZ, duty_code};
pub use offset::{monitor_ma, offset_code};

use crate::board::{Amplifiers, EnabledAmplifiers};

/// Lag of an amplifier's current loop, µs: a choice, the electrical time constant of a
/// Premium 1.5's motor, 0.238 mH / 2.18 Ω. A well-tuned loop is faster.
pub const CURRENT_LOOP_US: u16 = 110;

/// The outputs that command the currents of all three axes.
pub trait CurrentOutputs {
    /// Prepares the outputs at start-up, with no current commanded. May take some tens of
    /// microseconds.
    fn prepare(&mut self) {}

    /// Keeps the outputs ready in a tick with the power stages off.
    fn maintain(&mut self) {}

    /// Returns true if the outputs are as they were set, as far as they can be read. The power
    /// stages are not switched on before.
    fn are_as_set(&self) -> bool {
        true
    }

    /// Commands fractions of the full-scale current, each in -1..=1.
    fn set(&mut self, fractions: [f32; 3]);
}

/// Three outputs and the enable pin of the power stages, which are off.
pub struct Off<O, E> {
    outputs: O,
    enable: E,
    full_scale_a: f32,
}

/// Three outputs and the enable pin of the power stages, which are on.
pub struct On<O, E>(Off<O, E>);

impl<O: CurrentOutputs, E: OutputPin> Off<O, E> {
    /// Creates the amplifiers from the outputs for axes 1 to 3, the enable pin (high: on), and the
    /// current in amperes at full scale. Switches off first.
    pub fn new(outputs: O, enable: E, full_scale_a: f32) -> Self {
        let mut off = Self {
            outputs,
            enable,
            full_scale_a,
        };
        let _ = off.enable.set_low();
        off.outputs.prepare();
        off.set([0.0; 3]);
        off
    }

    /// Commands fractions of full scale, clamped to -1..=1; NaN commands zero.
    fn set(&mut self, fractions: [f32; 3]) {
        self.outputs.set(fractions.map(|fraction| {
            if fraction.is_nan() {
                0.0
            } else {
                fraction.clamp(-1.0, 1.0)
            }
        }));
    }

    fn command(&mut self, currents_a: [f32; 3]) {
        self.set(currents_a.map(|current_a| current_a / self.full_scale_a));
    }

    fn switch_off(&mut self) {
        // Writing a pin of this chip cannot fail.
        let _ = self.enable.set_low();
        self.set([0.0; 3]);
    }
}

impl<O: CurrentOutputs, E: OutputPin> Amplifiers for Off<O, E> {
    type Enabled = On<O, E>;

    fn enable(mut self) -> On<O, E> {
        self.set([0.0; 3]);
        if self.outputs.are_as_set() {
            let _ = self.enable.set_high();
        }
        On(self)
    }

    fn set_held_outputs(&mut self, held: [f32; 3]) {
        self.set(held);
        self.outputs.maintain();
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
mod tests;
