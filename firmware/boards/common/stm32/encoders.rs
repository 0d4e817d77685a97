//! The Phantom's encoders on three encoder timers, the safety inputs, and the amplifiers' feedback.
//!
//! A count that a disturbance adds is an undetected drift, so each channel has a digital filter: a
//! level counts after eight equal samples in a row, one every 64 clocks of the timer. At the
//! fastest motion that is not a fault, 128,000 counts a second, a channel keeps its level for 15.6
//! µs, and the other channel's edge follows after 7.8 µs.
//!
//! | | G474, 168 MHz | H743, 228 MHz |
//! | --- | --- | --- |
//! | between samples | 0.38 µs | 0.28 µs |
//! | a pulse up to this is never counted (7 samples) | 2.6 µs | 1.9 µs |
//! | a level of this is always counted (8 samples) | 3.1 µs | 2.3 µs |
//! | counts a second beyond which counts are lost | 650,000 | 850,000 |
//!
//! This is the longest filter that leaves a margin of five for the fastest motion: an excessive
//! speed is still counted correctly and is reported as that fault. Both channels have the same
//! delay, so their order is kept.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Input, Pull};
use embassy_stm32::pac::timer::TimGp16;
use embassy_stm32::pac::timer::vals::{Ckd, FilterValue};
use embassy_stm32::timer::GeneralInstance4Channel as Timer;
use embassy_stm32::timer::qei::{Config, Qei};
use embassy_stm32::timer::{Ch1, Ch2, TimerPin};
use hapterra_firmware::board::{Encoders, GuardInputs};
use hapterra_firmware::encoder::EndlessCount;

use super::feedback::Feedback;
use crate::{chip, outputs};

/// The emergency stop's input.
pub(crate) trait Stop {
    /// Returns true if the stop is pressed or its wire is broken, or if either was the case
    /// briefly.
    fn is_pressed(&mut self) -> bool;
}

/// Normally closed, with a pull-up: high when pressed, and when the wire is broken.
impl Stop for Input<'static> {
    fn is_pressed(&mut self) -> bool {
        self.is_high()
    }
}

/// Switches that close to ground, with pull-ups.
pub(crate) struct SafetyInputs<S> {
    pub(crate) emergency_stop: S,
    /// Closed while held: high when released, and when the wire is broken.
    pub(crate) dead_man: Input<'static>,
    /// Closed while held: high when released, and when the wire is broken.
    pub(crate) clutch: Input<'static>,
}

/// Counts the quadrature pulses at two pins, filtered. The pull-ups hold a constant level if a wire
/// is broken or a level shifter has no supply, so that noise is not counted. A level shifter can
/// drive against their 40 kΩ.
pub(crate) fn quadrature<T: Timer>(
    timer: Peri<'static, T>,
    a: Peri<'static, impl TimerPin<T, Ch1>>,
    b: Peri<'static, impl TimerPin<T, Ch2>>,
) -> Qei<'static, T> {
    let pulled_up = Config {
        ch1_pull: Pull::Up,
        ch2_pull: Pull::Up,
        ..Config::default()
    };
    let counter = Qei::new(timer, a, b, pulled_up);
    // SAFETY: the registers of a timer with four channels begin with these, `counter` owns the
    // timer, and no other access is in progress.
    let registers = unsafe { TimGp16::from_ptr(T::regs().cast()) };
    registers.cr1().modify(|w| w.set_ckd(Ckd::DIV2));
    registers.ccmr_input(0).modify(|w| {
        // Every 32nd clock after the division by CKD, eight times.
        w.set_icf(0, FilterValue::FDTS_DIV32_N8);
        w.set_icf(1, FilterValue::FDTS_DIV32_N8);
    });
    counter
}

/// The encoders of axes 1 to 3, each on a timer of its own.
pub(crate) struct TimerEncoders<A: Timer, B: Timer, C: Timer, S> {
    pub(crate) counters: (Qei<'static, A>, Qei<'static, B>, Qei<'static, C>),
    pub(crate) counts: [EndlessCount; 3],
    pub(crate) inputs: SafetyInputs<S>,
    pub(crate) feedback: Feedback,
}

impl<A: Timer, B: Timer, C: Timer, S: Stop> Encoders for TimerEncoders<A, B, C, S> {
    fn sense(&mut self) -> GuardInputs {
        let (a, b, c) = &self.counters;
        let [x, y, z] = &mut self.counts;
        let measured = self.feedback.measure_ma();
        GuardInputs {
            counts: [
                x.update(a.count()),
                y.update(b.count()),
                z.update(c.count()),
            ],
            dead_man: self.inputs.dead_man.is_low(),
            emergency_stop: self.inputs.emergency_stop.is_pressed(),
            hardware_failed: outputs::failed() || measured.is_err(),
            outputs_not_as_set: outputs::not_as_set() | chip::enable_pin_differs(),
            amplifier_not_ready: self.feedback.is_unready(),
            measured_ma: measured.unwrap_or_default(),
            clutch: self.inputs.clutch.is_low(),
        }
    }
}
