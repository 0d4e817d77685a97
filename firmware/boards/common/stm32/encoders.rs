//! The Phantom's encoders on three encoder timers, and the safety inputs.

use embassy_stm32::gpio::Input;
use embassy_stm32::timer::GeneralInstance4Channel as Timer;
use embassy_stm32::timer::qei::Qei;
use hapterra_firmware::board::{Encoders, Sense};
use hapterra_firmware::encoder::EndlessCount;

use crate::outputs;

/// Switches that close to ground, with pull-ups.
pub(crate) struct SafetyInputs {
    /// Normally closed: high when pressed, and when the wire is broken.
    pub(crate) emergency_stop: Input<'static>,
    /// Closed while held: high when released, and when the wire is broken.
    pub(crate) dead_man: Input<'static>,
}

/// The encoders of axes 1 to 3, each on a timer of its own.
pub(crate) struct TimerEncoders<A: Timer, B: Timer, C: Timer> {
    pub(crate) counters: (Qei<'static, A>, Qei<'static, B>, Qei<'static, C>),
    pub(crate) counts: [EndlessCount; 3],
    pub(crate) inputs: SafetyInputs,
}

impl<A: Timer, B: Timer, C: Timer> Encoders for TimerEncoders<A, B, C> {
    fn sense(&mut self) -> Sense {
        let (a, b, c) = &self.counters;
        let [x, y, z] = &mut self.counts;
        Sense {
            counts: [
                x.follow(a.count()),
                y.follow(b.count()),
                z.follow(c.count()),
            ],
            dead_man: self.inputs.dead_man.is_low(),
            emergency_stop: self.inputs.emergency_stop.is_high(),
            hardware_failed: outputs::failed(),
        }
    }
}
