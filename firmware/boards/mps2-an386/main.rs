//! The emulated board: an ARM MPS2 with the AN386 image (Cortex-M4F), as QEMU
//! models it.
//!
//! ```text
//! qemu-system-arm -M mps2-an386 -nographic -monitor none \
//!     -icount shift=3,sleep=off -no-reboot \
//!     -serial LINK -serial PLANT -serial REPORT -serial LOG -kernel mps2-an386
//! ```
//!
//! UART0 is the link, UART1 the virtual Phantom's line. Time is emulated time, which sometimes
//! stands still ([`time`]). The program ends with a reset when the host closes the session; a panic
//! or a fault is first reported on UART2 ([`ending`]).
//!
//! Log lines (defmt, on UART3) are written by tasks only, never by the haptic
//! interrupt.
#![no_std]
#![no_main]
// Interrupt handlers have the names of the vectors.
#![allow(non_snake_case)]

#[path = "../common/application.rs"]
mod application;
mod chip;
#[path = "../common/critical.rs"]
mod critical;
mod ending;
mod failure;
mod log;
mod plant;
mod registers;
mod serial;
#[path = "../common/stack.rs"]
mod stack;
mod time;
mod vectors;

use core::cell::Cell;

use cortex_m::peripheral::NVIC;
use cortex_m_rt::{entry, interrupt};
use embassy_executor::{InterruptExecutor, Spawner};
use hapterra_core::guard::thermal::Temperatures;
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::hello::SerialNumber;
use hapterra_core::wire::status::BootReport;
use hapterra_firmware::amplifier::CURRENT_LOOP_US;
use hapterra_firmware::app::Hardware;
use hapterra_firmware::link::Link;
use hapterra_firmware::link::task::{LinkBoard, run};
use hapterra_firmware::monitor::{Monitor, WatchedPart};
use hapterra_firmware::native::{FULL_SCALE_A, VirtualAmplifiersOff};
use hapterra_firmware::store::Stored;

use application::{Loop, TICK_DONE};
use chip::WINDOW;
use plant::PlantPort;
use serial::Serial;
use time::Reason;
use vectors::Interrupt;
use vectors::Interrupt as interrupt;

static LINK: Serial = Serial::new(registers::link_uart);
static PLANT: Serial = Serial::new(registers::plant_uart);
static EXECUTOR: InterruptExecutor = InterruptExecutor::new();

/// Runs the haptic tick, above all other interrupts.
#[interrupt]
fn HapticTick() {
    static mut LOOP: Option<&'static mut Loop> = None;
    if let Some((haptic_loop, drive)) = application::tick(LOOP) {
        haptic_loop.encoders_mut().answer(drive);
        // Waking a task needs a critical section, so an interrupt of lower priority does it.
        NVIC::pend(Interrupt::TickDone);
    }
}

#[interrupt]
fn TickDone() {
    TICK_DONE.signal(());
    plant::ANSWERED.signal(());
}

#[interrupt]
fn LinkReceived() {
    LINK.on_received();
}

#[interrupt]
fn LinkSent() {
    LINK.on_sent();
}

#[interrupt]
fn PlantReceived() {
    PLANT.on_received();
}

#[interrupt]
fn PlantSent() {
    PLANT.on_sent();
}

#[interrupt]
fn Executor() {
    // SAFETY: this is the interrupt passed to `start`, which enables it.
    unsafe { EXECUTOR.on_interrupt() };
}

/// Polls of the link between two measurements of the stack.
const STACK_POLLS: u32 = 1_000;

/// Board for the link's task.
struct Emulated {
    monitor: &'static Monitor,
    polls: Cell<u32>,
    is_arm_in_use: Cell<bool>,
}

impl Emulated {
    fn new(monitor: &'static Monitor) -> Self {
        Self {
            monitor,
            polls: Cell::new(0),
            is_arm_in_use: Cell::new(false),
        }
    }

    fn measure_stack(&self) {
        let polls = self.polls.get().wrapping_add(1);
        self.polls.set(polls);
        if polls.is_multiple_of(STACK_POLLS) {
            self.monitor.measure_stack(stack::figures());
        }
    }
}

impl LinkBoard for Emulated {
    async fn tick_done(&self) {
        TICK_DONE.wait().await;
    }

    fn after_poll<const D: usize>(&self, link: &Link<'_, D>) {
        if link.has_ended() {
            defmt::info!("the host closed the session");
            ending::done();
        }
        // There is no watchdog here, but the tick expects one to be fed.
        let _ = self
            .monitor
            .may_feed_watchdog(&[WatchedPart::Tick, WatchedPart::Link]);
        self.measure_stack();
        let is_arm_in_use = link.is_arm_in_use();
        if self.is_arm_in_use.replace(is_arm_in_use) != is_arm_in_use {
            plant::expect(is_arm_in_use);
        }
        if link.may_stop_clock() {
            time::hold(Reason::Link);
        } else {
            time::release(Reason::Link);
        }
    }
}

#[embassy_executor::task]
async fn serve_link(link: &'static mut Link<'static, WINDOW>, monitor: &'static Monitor) {
    let (rx, tx) = LINK.open();
    run(link, rx, tx, &Emulated::new(monitor)).await;
}

#[embassy_executor::task]
async fn serve_plant(port: PlantPort) {
    let (rx, tx) = PLANT.open();
    port.run(rx, tx).await;
}

/// Starts the other tasks. Their futures are not `Send`, so they are started from this executor.
#[embassy_executor::task]
async fn start(
    link: &'static mut Link<'static, WINDOW>,
    monitor: &'static Monitor,
    port: PlantPort,
) {
    // SAFETY: called from a task of this executor.
    let spawner = unsafe { Spawner::for_current_executor().await };
    spawner.spawn(serve_link(link, monitor).expect("started once"));
    spawner.spawn(serve_plant(port).expect("started once"));
}

#[entry]
fn main() -> ! {
    set_up();
    loop {
        cortex_m::asm::wfi();
    }
}

/// Sets up the board. Not inlined, so that its stack is free when it returns.
#[inline(never)]
fn set_up() {
    log::start();
    let (encoders, port) = plant::open();
    let hardware = Hardware {
        encoders,
        amplifiers: VirtualAmplifiersOff,
        clock: time::start(),
        full_scale_a: FULL_SCALE_A,
        latency_us: CURRENT_LOOP_US,
        // There is no memory; the virtual Phantom is a Premium 1.5.
        calibration: Stored::Found(Calibration::PREMIUM_1_5),
        // The motors start with the board, so they are cold.
        motors: Temperatures::AIR,
        serial: SerialNumber::NONE,
        boot: BootReport::default(),
    };
    let (link, monitor) = application::assemble(hardware, "mps2-an386");
    enable_interrupts();
    let spawner = EXECUTOR.start(Interrupt::Executor);
    spawner.spawn(start(link, monitor, port).expect("started once"));
    defmt::info!("mps2-an386 is up");
}

/// Enables the haptic tick above the ceiling of critical sections, the others below.
fn enable_interrupts() {
    let mut core = cortex_m::Peripherals::take().expect("taken once");
    let map = [
        (Interrupt::HapticTick, critical::HAPTIC),
        (Interrupt::LinkReceived, 0x40),
        (Interrupt::LinkSent, 0x40),
        (Interrupt::PlantReceived, 0x40),
        (Interrupt::PlantSent, 0x40),
        (Interrupt::TickDone, 0x60),
        (Interrupt::Executor, 0xC0),
    ];
    for (interrupt, priority) in map {
        // SAFETY: no critical section is active, and only the haptic interrupt, which enters none,
        // is above the ceiling.
        unsafe { core.NVIC.set_priority(interrupt, priority) };
    }
    for (interrupt, _) in map.iter().filter(|(i, _)| *i != Interrupt::Executor) {
        // SAFETY: their handlers are ready; the executor enables its own.
        unsafe { NVIC::unmask(*interrupt) };
    }
    NVIC::pend(Interrupt::HapticTick);
}
