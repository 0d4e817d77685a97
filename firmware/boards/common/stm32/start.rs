//! Starts a board: sets up its parts, assembles the application, and starts its tasks and then its
//! tick.

use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_stm32::interrupt;
use embassy_stm32::pac::Interrupt;
use embassy_stm32::wdg::IndependentWatchdog;
use hapterra_core::wire::hello::SerialNumber;
use hapterra_core::wire::status::BootReport;
use hapterra_firmware::app::Hardware;
use hapterra_firmware::usb::{DescriptorBuffers, device};
use static_cell::ConstStaticCell;

use super::calibration_memory::CalibrationMemory;
use super::{
    clock, failure, heartbeat, mark_pin, motor_memory, priorities, stack_guard, supervisor, supply,
    tasks,
};
use crate::application::{self, Loop, TICK_DONE};
use crate::chip::{self, Clock};
use crate::outputs::{BOARD, LATENCY_US};

/// Current in amperes at the ends of an output's range.
pub(crate) const FULL_SCALE_A: f32 = 5.5;
/// Time after which the watchdog resets the chip, microseconds, by an oscillator of 32 kHz. That
/// oscillator has 29.4 to 34 kHz by the chips' data sheets, so the time is 42 to 49 ms: less than
/// the 50 ms in the documentation, and more than the 40 ms after which the tick switches off.
const WATCHDOG_US: u32 = 45_000;

static DESCRIPTORS: ConstStaticCell<DescriptorBuffers> =
    ConstStaticCell::new(DescriptorBuffers::EMPTY);

/// Runs the haptic interrupt, which owns `slot`.
pub(crate) fn on_haptic_interrupt(slot: &mut Option<&'static mut Loop>) {
    if let Some((haptic_loop, drive)) = application::tick(slot) {
        heartbeat::beat(&drive);
        mark_pin::update(haptic_loop);
        if let Some(copy) = haptic_loop.due_motor_copy() {
            motor_memory::store_copy(copy);
        }
        // Waking a task needs a critical section, so an interrupt of lower priority does it.
        cortex_m::peripheral::NVIC::pend(Interrupt::TIM6_DAC);
    }
}

/// Handles the interrupt that the haptic one raises at the end of a tick; TIM6 itself is not used.
#[interrupt]
fn TIM6_DAC() {
    failure::count_tick();
    TICK_DONE.signal(());
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let mut core = cortex_m::Peripherals::take().expect("taken once");
    stack_guard::set_up(&core.MPU);
    priorities::lower_all(&mut core);
    chip::prepare(&mut core);
    // Outputs may wait by this counter.
    clock::count_cycles(&mut core);
    // Commands no current, before any slow step.
    let parts = chip::take(embassy_stm32::init(chip::configuration()));
    let boot = BootReport {
        cause: chip::take_reset_cause(),
        crash: failure::take_record(),
        resets_below_mv: chip::resets_below_mv(),
    };
    failure::log(boot.crash.as_ref());
    let mut led = parts.led;
    supply::wait_and_monitor(&mut led);
    heartbeat::set_up(parts.heartbeat);
    mark_pin::set_up(parts.mark);
    let (memory, calibration) = CalibrationMemory::open(parts.flash);
    let hardware = Hardware {
        encoders: parts.encoders,
        amplifiers: parts.amplifiers,
        clock: Clock::new(parts.timer),
        full_scale_a: FULL_SCALE_A,
        latency_us: LATENCY_US,
        calibration,
        motors: motor_memory::begin(boot.cause),
        serial: SerialNumber::new(embassy_stm32::uid::uid()),
        boot,
    };
    let (link, monitor) = application::assemble(hardware, BOARD);
    link.offer_loader();

    // The same number that the link reports.
    let serial_number = embassy_stm32::uid::uid_hex();
    let (usb, rx, tx) = device(parts.usb, serial_number, DESCRIPTORS.take());
    spawner.spawn(tasks::serve_usb(usb, monitor).expect("started once"));
    spawner.spawn(tasks::serve_link(link, rx, tx, memory).expect("started once"));

    priorities::start_tick(chip::HAPTIC_INTERRUPT, Interrupt::TIM6_DAC);
    let mut watchdog = IndependentWatchdog::new(parts.watchdog, WATCHDOG_US);
    watchdog.unleash();
    spawner.spawn(supervisor::supervise(monitor, watchdog, led).expect("started once"));
    defmt::info!("{} is up", BOARD);
}
