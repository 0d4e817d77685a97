//! The heartbeat: a pin that changes its level in each tick that leaves the amplifiers on.
//!
//! It feeds a retriggerable one-shot outside of the board, which keeps the enable line only
//! while the pin changes. A tick that has stopped for whatever reason, a halted core
//! included, then switches off, and the board's wiring page says how.

use embassy_stm32::gpio::Output;
use hapterra_core::guard::GuardOutputs;

use crate::chip;

/// Keeps the pin as an output for good. The tick writes its register itself.
pub(crate) fn set_up(pin: Output<'static>) {
    core::mem::forget(pin);
}

/// Takes what a tick left the amplifiers with.
pub(crate) fn beat(drive: &GuardOutputs) {
    if drive.enabled {
        chip::toggle_heartbeat();
    }
}
