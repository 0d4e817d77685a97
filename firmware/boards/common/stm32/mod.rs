//! What the two STM32 boards share: everything but pins, clocks and outputs.

pub(crate) mod arm;
pub(crate) mod clock;
pub(crate) mod failure;
pub(crate) mod nvic;

use embassy_stm32::peripherals;
use embassy_stm32::wdg::{IndependentWatchdog, Instance};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Ticker};
use hapterra_firmware::board::Watchdog;
use hapterra_firmware::link::Link;
use hapterra_firmware::link::task::LinkHost;
use hapterra_firmware::supervisor::Supervisor;

/// Time after which the watchdog resets the chip, microseconds.
pub(crate) const WATCHDOG_US: u32 = 50_000;
/// How often the signs of life are looked at, milliseconds.
const CHECK_MS: u64 = 10;

/// Raised, by an interrupt below the haptic one, when a tick has ended.
pub(crate) static TICK_DONE: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// A real board goes on ticking whatever the link does.
pub(crate) struct Board;

impl LinkHost for Board {
    async fn tick_done(&self) {
        TICK_DONE.wait().await;
    }

    fn after_turn<const D: usize>(&self, _link: &Link<'_, D>) {}
}

/// The independent watchdog.
pub(crate) struct Dog<T: Instance + 'static>(pub(crate) IndependentWatchdog<'static, T>);

impl<T: Instance> Watchdog for Dog<T> {
    fn feed(&mut self) {
        self.0.pet();
    }
}

/// Looks at the signs of life for ever.
pub(crate) async fn supervise<T: Instance>(mut supervisor: Supervisor<'static, Dog<T>>) {
    let mut ticker = Ticker::every(Duration::from_millis(CHECK_MS));
    loop {
        ticker.next().await;
        supervisor.check();
    }
}

/// The timer of the haptic tick, on both boards.
pub(crate) type TickTimer = peripherals::TIM7;
