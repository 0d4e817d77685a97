//! The mark pin, for an EEG or an eye tracker: goes high at the end of a marked tick.

use embassy_stm32::gpio::Output;

use crate::application::Loop;
use crate::chip;

/// Configures the pin as an output permanently. The tick writes its register directly.
pub(crate) fn set_up(pin: Output<'static>) {
    core::mem::forget(pin);
}

/// Sets the pin's level if it changes after a tick.
pub(crate) fn update(haptic_loop: &Loop) {
    if let Some(is_high) = haptic_loop.mark_edge() {
        chip::set_mark(is_high);
    }
}
