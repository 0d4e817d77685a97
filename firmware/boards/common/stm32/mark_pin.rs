//! The mark pin: high from the end of a tick that was marked, for an EEG or an eye tracker.

use embassy_stm32::gpio::Output;

use crate::application::Loop;
use crate::chip;

/// Keeps the pin as an output for good. The tick writes its register itself.
pub(crate) fn set_up(pin: Output<'static>) {
    core::mem::forget(pin);
}

/// Puts the pin's level out where it changes after a tick.
pub(crate) fn follow(haptic_loop: &Loop) {
    if let Some(is_high) = haptic_loop.mark_edge() {
        chip::set_mark(is_high);
    }
}
