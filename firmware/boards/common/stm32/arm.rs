//! The Phantom's encoders on three encoder timers, and the safety inputs.

use embassy_stm32::gpio::Input;
use embassy_stm32::timer::GeneralInstance4Channel;
use embassy_stm32::timer::qei::Qei;
use hapterra_firmware::board::{Encoders, Sense};
use hapterra_firmware::encoder::Unwrapped;

/// A timer in encoder mode, as its 16-bit count.
pub(crate) trait Counter: Send {
    fn count(&self) -> u16;
}

impl<T: GeneralInstance4Channel> Counter for Qei<'static, T>
where
    Self: Send,
{
    fn count(&self) -> u16 {
        Qei::count(self)
    }
}

/// Switches that close to ground, with pull-ups.
pub(crate) struct SafetyInputs {
    /// Normally closed: high when pressed, and when the wire is broken.
    pub(crate) emergency_stop: Input<'static>,
    /// Closed while held: high when released, and when the wire is broken.
    pub(crate) dead_man: Input<'static>,
}

/// Axes 1 to 3, each on its own timer.
pub(crate) struct Arm<A, B, C> {
    counters: (A, B, C),
    unwrapped: [Unwrapped; 3],
    inputs: SafetyInputs,
}

impl<A: Counter, B: Counter, C: Counter> Arm<A, B, C> {
    pub(crate) fn new(counters: (A, B, C), inputs: SafetyInputs) -> Self {
        Self {
            counters,
            unwrapped: Default::default(),
            inputs,
        }
    }
}

impl<A: Counter, B: Counter, C: Counter> Encoders for Arm<A, B, C> {
    fn sense(&mut self) -> Sense {
        let (a, b, c) = &self.counters;
        let [x, y, z] = &mut self.unwrapped;
        Sense {
            counts: [
                x.follow(a.count()),
                y.follow(b.count()),
                z.follow(c.count()),
            ],
            dead_man: self.inputs.dead_man.is_low(),
            emergency_stop: self.inputs.emergency_stop.is_high(),
            hardware_failed: crate::hardware_failed(),
        }
    }
}
