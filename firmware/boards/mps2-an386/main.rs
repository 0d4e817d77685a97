//! The emulated board: an ARM MPS2 with the AN386 image (Cortex-M4F), as QEMU
//! models it.
//!
//! ```text
//! qemu-system-arm -M mps2-an386 -nographic -monitor none \
//!     -icount shift=3,sleep=off -semihosting-config enable=on,target=native \
//!     -serial LINK -serial PLANT -kernel mps2-an386
//! ```
//!
//! UART0 is the link, UART1 the virtual Phantom's line. Time is emulated time:
//! see [`time`] for what it is and when it stands still. Ends with exit code 0
//! when the host says goodbye, 1 on a panic or a fault.
//!
//! Log lines (defmt, over semihosting) are written by tasks only, never by the
//! haptic interrupt; while one is written emulated time does not pass.
#![no_std]
#![no_main]
// Interrupt handlers bear the names of the vectors.
#![allow(non_snake_case)]

mod chip;
#[path = "../common/critical.rs"]
mod critical;
mod failure;
mod plant;
mod serial;
#[path = "../common/stack.rs"]
mod stack;
mod time;

use core::cell::{Cell, RefCell};

use cortex_m::peripheral::NVIC;
use cortex_m_rt::{entry, interrupt};
use critical_section::Mutex;
use defmt_semihosting as _;
use embassy_executor::{InterruptExecutor, Spawner};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use hapterra_core::phantom::Calibration;
use hapterra_core::wire::status::BootReport;
use hapterra_firmware::channels::{Application, Channels, Hardware, Tiles, assemble};
use hapterra_firmware::haptic_loop::HapticLoop;
use hapterra_firmware::link::Link;
use hapterra_firmware::link::task::{LinkHost, run};
use hapterra_firmware::native::ReportedOff;
use hapterra_firmware::store::Stored;
use hapterra_firmware::supervisor::{NoWatchdog, Supervisor};
use hapterra_firmware::vitals::{Part, Vitals};
use static_cell::{ConstStaticCell, StaticCell};

use chip::Interrupt;
use chip::Interrupt as interrupt;
use plant::{PlantArm, PlantPort};
use serial::Serial;
use time::Reason;

/// Tiles along the side of the window.
const WINDOW: usize = 16;

static TILES: ConstStaticCell<Tiles<WINDOW>> = ConstStaticCell::new(Tiles::new());
static CHANNELS: ConstStaticCell<Channels<'static>> = ConstStaticCell::new(Channels::new());
static LINK: Serial = Serial::new(chip::link_uart);
static PLANT: Serial = Serial::new(chip::plant_uart);
static EXECUTOR: InterruptExecutor = InterruptExecutor::new();
static TICK_DONE: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// What the haptic interrupt owns.
struct Tick {
    haptic_loop: HapticLoop<'static, PlantArm, ReportedOff, time::Clock, WINDOW>,
    answers: plant::Answers,
}

/// Where that lives.
static LOOP: StaticCell<Tick> = StaticCell::new();
/// Carries it to its interrupt: filled once, before that is let through.
static HANDOVER: Mutex<Cell<Option<&'static mut Tick>>> = Mutex::new(Cell::new(None));

/// The haptic tick, above everything else.
#[interrupt]
fn HapticTick() {
    static mut TICK: Option<&'static mut Tick> = None;
    let Some(tick) = TICK else {
        // Raised once by `main`, before there is a tick to be late for.
        *TICK = critical_section::with(|cs| HANDOVER.borrow(cs).take());
        return;
    };
    let drive = tick.haptic_loop.tick();
    let arm = tick.haptic_loop.encoders_mut();
    if let Some(number) = arm.sensed.take() {
        tick.answers.give(number, drive);
        if !arm.has_counts() {
            time::hold(Reason::Plant);
        }
    }
    // Waking a task takes a critical section: left to an interrupt below.
    NVIC::pend(Interrupt::TickDone);
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
    // SAFETY: this is the interrupt given to `start`, which is what enables it.
    unsafe { EXECUTOR.on_interrupt() };
}

/// Turns of the link between two looks at the stack.
const STACK_TURNS: u32 = 1_000;

/// What this board has to do with the link.
struct Emulated {
    vitals: &'static Vitals,
    turns: Cell<u32>,
    fed_by_arm: Cell<bool>,
    supervisor: RefCell<Supervisor<'static, NoWatchdog>>,
}

impl Emulated {
    /// Nothing but its own host watches this board, so the supervisor needs no
    /// task of its own.
    fn new(vitals: &'static Vitals) -> Self {
        let parts = &[Part::Tick, Part::Link];
        Self {
            vitals,
            turns: Cell::new(0),
            fed_by_arm: Cell::new(false),
            supervisor: RefCell::new(Supervisor::new(vitals, NoWatchdog, parts)),
        }
    }

    fn measure_stack(&self) {
        let turns = self.turns.get().wrapping_add(1);
        self.turns.set(turns);
        if turns.is_multiple_of(STACK_TURNS) {
            let (size, high_water) = stack::figures();
            self.vitals.measure_stack(size, high_water);
        }
    }
}

impl LinkHost for Emulated {
    async fn tick_done(&self) {
        TICK_DONE.wait().await;
    }

    fn after_turn<const D: usize>(&self, link: &Link<'_, D>) {
        if link.has_ended() {
            defmt::info!("the host said goodbye");
            semihosting::process::exit(0);
        }
        self.supervisor.borrow_mut().check();
        self.measure_stack();
        let drives_arm = link.drives_arm();
        if self.fed_by_arm.replace(drives_arm) != drives_arm {
            plant::expect(drives_arm);
        }
        if link.may_stand_still() {
            time::hold(Reason::Link);
        } else {
            time::release(Reason::Link);
        }
    }
}

#[embassy_executor::task]
async fn serve_link(mut link: Link<'static, WINDOW>, vitals: &'static Vitals) {
    let (rx, tx) = LINK.open();
    run(&mut link, rx, tx, &Emulated::new(vitals)).await;
}

#[embassy_executor::task]
async fn serve_plant(port: PlantPort) {
    let (rx, tx) = PLANT.open();
    port.run(rx, tx).await;
}

/// Starts the other tasks, which cannot be handed over from outside: what they
/// hold between two awaits stays on this executor.
#[embassy_executor::task]
async fn start(link: Link<'static, WINDOW>, vitals: &'static Vitals, port: PlantPort) {
    // SAFETY: called from a task of the executor that is meant.
    let spawner = unsafe { Spawner::for_current_executor().await };
    spawner.spawn(serve_link(link, vitals).expect("started once"));
    spawner.spawn(serve_plant(port).expect("started once"));
}

#[entry]
fn main() -> ! {
    set_up();
    loop {
        cortex_m::asm::wfi();
    }
}

/// Not inlined: what it needs of the stack is given back when it returns.
#[inline(never)]
fn set_up() {
    let (arm, answers, port) = plant::open();
    let hardware = Hardware {
        encoders: arm,
        amplifiers: ReportedOff,
        clock: time::start(),
        // There is no memory; the virtual Phantom is a Premium 1.5.
        calibration: Stored::Found(Calibration::PREMIUM_1_5),
        boot: BootReport::default(),
    };
    let Application {
        haptic_loop,
        link,
        vitals,
    } = assemble(TILES.take(), CHANNELS.take(), hardware, "mps2-an386");
    let tick = LOOP.init(Tick {
        haptic_loop,
        answers,
    });
    critical_section::with(|cs| HANDOVER.borrow(cs).set(Some(tick)));
    let_interrupts_through();
    let spawner = EXECUTOR.start(Interrupt::Executor);
    spawner.spawn(start(link, vitals, port).expect("started once"));
    defmt::info!("mps2-an386 is up");
}

/// The haptic tick above the ceiling of critical sections, the rest below.
fn let_interrupts_through() {
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
        // SAFETY: no critical section is in force that this could break, and
        // only the haptic interrupt, which enters none, is above the ceiling.
        unsafe { core.NVIC.set_priority(interrupt, priority) };
    }
    for (interrupt, _) in map.iter().filter(|(i, _)| *i != Interrupt::Executor) {
        // SAFETY: their handlers are ready; the executor's is let through by
        // the executor itself.
        unsafe { NVIC::unmask(*interrupt) };
    }
    NVIC::pend(Interrupt::HapticTick);
}
