//! What the two STM32 boards share: everything but pins, clocks and outputs.

pub(crate) mod arm;
pub(crate) mod clock;
pub(crate) mod failure;
pub(crate) mod memory;
pub(crate) mod nvic;
#[path = "../stack.rs"]
mod stack;

use core::sync::atomic::{AtomicU8, Ordering};

use embassy_futures::join::join;
use embassy_stm32::gpio::Output;
use embassy_stm32::peripherals;
use embassy_stm32::wdg::{IndependentWatchdog, Instance};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Ticker};
use embassy_usb::UsbDevice;
use embassy_usb::driver::Driver;
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::status::{BootReport, Refusal, ResetCause};
use hapterra_firmware::board::Watchdog;
use hapterra_firmware::led::Signal as LedSignal;
use hapterra_firmware::link::Link;
use hapterra_firmware::link::task::LinkHost;
use hapterra_firmware::supervisor::Supervisor;
use hapterra_firmware::vitals::{Part, Vitals};
use memory::Memory;

/// Time after which the watchdog resets the chip, microseconds.
pub(crate) const WATCHDOG_US: u32 = 50_000;
/// How often the signs of life are looked at, milliseconds.
const CHECK_MS: u64 = 10;
/// How often the stack is measured, milliseconds.
const STACK_MS: u32 = 1_000;

/// Raised, by an interrupt below the haptic one, when a tick has ended.
pub(crate) static TICK_DONE: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// What the LED says: the link knows, the supervisor shows.
static SIGNAL: AtomicU8 = AtomicU8::new(0);

/// A real board goes on ticking whatever the link does.
pub(crate) struct Board(pub(crate) Memory);

impl LinkHost for Board {
    async fn tick_done(&self) {
        TICK_DONE.wait().await;
    }

    fn after_turn<const D: usize>(&self, link: &Link<'_, D>) {
        SIGNAL.store(link.signal().to_bits(), Ordering::Relaxed);
    }

    async fn store(&self, calibration: &Calibration) -> Result<(), Refusal> {
        self.0.save(calibration)
    }
}

/// For the interrupt that the tick raises when it has ended.
pub(crate) fn tick_done() {
    failure::TICKS.fetch_add(1, Ordering::Relaxed);
    TICK_DONE.signal(());
}

/// Runs the USB stack for ever, and says that it does.
pub(crate) async fn serve_usb<D: Driver<'static>>(
    mut device: UsbDevice<'static, D>,
    vitals: &'static Vitals,
) {
    let checking_in = async {
        let mut ticker = Ticker::every(Duration::from_millis(CHECK_MS));
        loop {
            vitals.check_in(Part::Usb);
            ticker.next().await;
        }
    };
    join(device.run(), checking_in).await;
}

/// The independent watchdog.
pub(crate) struct Dog<T: Instance + 'static>(pub(crate) IndependentWatchdog<'static, T>);

impl<T: Instance> Watchdog for Dog<T> {
    fn feed(&mut self) {
        self.0.pet();
    }
}

/// Looks at the signs of life for ever, measures the stack, and shows where
/// the board stands.
pub(crate) async fn supervise<T: Instance>(
    vitals: &'static Vitals,
    watchdog: IndependentWatchdog<'static, T>,
    mut led: Output<'static>,
) {
    let parts = &[Part::Tick, Part::Link, Part::Usb];
    let mut supervisor = Supervisor::new(vitals, Dog(watchdog), parts);
    let mut ticker = Ticker::every(Duration::from_millis(CHECK_MS));
    let mut ms = 0_u32;
    loop {
        ticker.next().await;
        supervisor.check();
        if ms.is_multiple_of(STACK_MS) {
            let (size, high_water) = stack::figures();
            vitals.measure_stack(size, high_water);
        }
        ms = ms.wrapping_add(CHECK_MS as u32);
        let signal = LedSignal::from_bits(SIGNAL.load(Ordering::Relaxed));
        led.set_level(signal.is_lit(ms).into());
    }
}

/// What the chip says about its last reset, and what the program before left.
pub(crate) fn boot_report(flags: ResetFlags) -> BootReport {
    let cause = match flags {
        ResetFlags { watchdog: true, .. } => ResetCause::Watchdog,
        ResetFlags { software: true, .. } => ResetCause::Software,
        ResetFlags { power: true, .. } => ResetCause::PowerOn,
        ResetFlags { pin: true, .. } => ResetCause::Pin,
        _ => ResetCause::Unknown,
    };
    let crash = failure::take_record();
    BootReport { cause, crash }
}

/// The chip's reset flags; several can be set.
pub(crate) struct ResetFlags {
    pub(crate) watchdog: bool,
    pub(crate) software: bool,
    pub(crate) power: bool,
    pub(crate) pin: bool,
}

/// The timer of the haptic tick, on both boards.
pub(crate) type TickTimer = peripherals::TIM7;
