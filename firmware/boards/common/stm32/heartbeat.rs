//! The heartbeat: a pin that changes its level in each tick that leaves the amplifiers on.
//!
//! It triggers a one-shot outside the board, which passes the enable line only while the pin
//! changes. So the amplifiers are switched off if the tick stops for any reason, including a halted
//! core. The board's wiring page shows the circuit.

use embassy_stm32::gpio::Output;
use hapterra_core::guard::GuardOutputs;

use crate::chip;

/// Configures the pin as an output permanently. The tick writes its register directly.
pub(crate) fn set_up(pin: Output<'static>) {
    core::mem::forget(pin);
}

/// Toggles the pin if the outputs of a tick leave the amplifiers on.
pub(crate) fn beat(drive: &GuardOutputs) {
    if drive.enabled {
        chip::toggle_heartbeat();
    }
}
