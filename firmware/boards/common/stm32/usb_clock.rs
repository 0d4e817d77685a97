//! Check that the oscillator of USB follows the host's start-of-frames, as the chip's clock
//! recovery tells it. Full speed allows 0.25 % of error; alone the oscillator has 1 % at 30 °C
//! and 3.5 % over all temperatures, and only some hosts put up with that.

use embassy_stm32::pac::CRS;
use hapterra_core::wire::status::UsbClock;

/// Returns what has happened since the last call: locked if there was a start-of-frame and
/// none that was missed or too far off.
pub(crate) fn measure() -> UsbClock {
    let found = CRS.isr().read();
    CRS.icr().write(|w| {
        w.set_syncokc(true);
        w.set_syncwarnc(true);
        w.set_errc(true);
        w.set_esyncc(true);
    });
    match found.syncokf() && !found.errf() {
        true => UsbClock::Locked,
        false => UsbClock::Unlocked,
    }
}
