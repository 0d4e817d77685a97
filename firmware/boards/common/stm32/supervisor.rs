//! The supervisor: feeds the watchdog while all tasks run, and shows the LED's pattern.

use core::cell::Cell;

use embassy_stm32::gpio::Output;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use embassy_time::{Duration, Ticker};
use hapterra_firmware::led::LedPattern;
use hapterra_firmware::monitor::{Monitor, WatchedPart};

use super::{stack, usb_clock};
use crate::chip::{self, WatchdogTimer};

/// Interval of check-ins and of the supervisor, milliseconds.
pub(super) const CHECK_MS: u32 = 10;
/// Interval of the measurements of the stack and of USB's oscillator, milliseconds.
const MEASURE_MS: u32 = 1_000;

/// Pattern of the LED: the link sets it, the supervisor shows it.
pub(super) static LED: CriticalSectionMutex<Cell<LedPattern>> =
    CriticalSectionMutex::new(Cell::new(LedPattern::Disarmed));

/// Feeds the watchdog while all parts run, measures the stack, and shows the LED's pattern,
/// forever. Restores the settings for a halted core, which a debugger may have changed.
#[embassy_executor::task]
pub(crate) async fn supervise(
    monitor: &'static Monitor,
    mut watchdog: IndependentWatchdog<'static, WatchdogTimer>,
    mut led: Output<'static>,
) {
    let mut ticker = Ticker::every(Duration::from_millis(CHECK_MS.into()));
    let mut ms = 0_u32;
    loop {
        ticker.next().await;
        chip::set_debug_freeze();
        if monitor.may_feed_watchdog(&[WatchedPart::Tick, WatchedPart::Link, WatchedPart::Usb]) {
            watchdog.pet();
        }
        if ms.is_multiple_of(MEASURE_MS) {
            monitor.measure_stack(stack::figures());
            // In the first second a host may not be connected yet.
            let usb_clock = usb_clock::measure();
            if ms > 0 {
                monitor.measure_usb_clock(usb_clock);
            }
        }
        ms = ms.wrapping_add(CHECK_MS);
        led.set_level(LED.lock(Cell::get).is_lit(ms).into());
    }
}
