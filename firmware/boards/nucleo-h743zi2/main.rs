//! NUCLEO-H743ZI2: Cortex-M7 at 480 MHz, three encoder timers, three PWM
//! outputs for amplifiers that read 10-90 % (Maxon ESCON), USB full speed.
//!
//! | what | pin | part |
//! | --- | --- | --- |
//! | encoder 1 A, B | PC6, PC7 | TIM8 |
//! | encoder 2 A, B | PB4, PB5 | TIM3 |
//! | encoder 3 A, B | PD12, PD13 | TIM4 |
//! | current command 1, 2, 3 | PE9, PE11, PE13 | TIM1, PWM, 50 % is zero |
//! | amplifier enable, high is on, pull it down outside | PF3 | |
//! | emergency stop, closed to ground | PF4 | |
//! | dead-man switch, closed to ground while held | PF5 | |
//! | USB D-, D+ | PA11, PA12 | OTG_FS |
#![no_std]
#![no_main]
// Interrupt handlers bear the names of the vectors.
#![allow(non_snake_case)]

#[path = "../common/critical.rs"]
mod critical;
#[path = "../common/stm32/mod.rs"]
mod stm32;

use core::cell::Cell;
use core::mem;

use cortex_m::peripheral::NVIC;
use critical_section::Mutex;
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_stm32::gpio::{Input, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::interrupt;
use embassy_stm32::pac::Interrupt;
use embassy_stm32::peripherals::{IWDG1, TIM1, TIM3, TIM4, TIM8, USB_OTG_FS};
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::qei::{self, Qei};
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm, SimplePwmChannel};
use embassy_stm32::usb::{self, Driver, InterruptHandler};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, bind_interrupts, pac, rcc, time::Hertz};
use embassy_usb::UsbDevice;
use embassy_usb::driver::Driver as UsbDriver;
use hapterra_core::wire::status::BootReport;
use hapterra_firmware::amplifier::{DutyCycle, Off};
use hapterra_firmware::channels::{Application, Channels, Hardware, Tiles, assemble};
use hapterra_firmware::haptic_loop::HapticLoop;
use hapterra_firmware::link::Link;
use hapterra_firmware::link::task::run;
use hapterra_firmware::store::Stored;
use hapterra_firmware::supervisor::Supervisor;
use hapterra_firmware::usb::{Descriptors, Known, Packets};
use hapterra_firmware::vitals::Part;
use static_cell::ConstStaticCell;

use stm32::arm::{Arm, SafetyInputs};
use stm32::clock::{Clock, Period};
use stm32::{Board, Dog, TICK_DONE};

/// Tiles along the side of the window.
const WINDOW: usize = 8;
/// Core cycles a second.
const CORE_HZ: u32 = 480_000_000;
/// 240 MHz / 4 / 60,000 = 1 kHz.
const PERIOD: Period = Period {
    prescaler: 3,
    reload: 59_999,
};
/// Frequency of the duty cycles. An ESCON reads 10 Hz to 5 kHz; the faster, the
/// less a command is delayed, and the coarser it is read.
const PWM_HZ: u32 = 5_000;
/// Current in amperes that duty cycles of 10 % and 90 % stand for.
const FULL_SCALE_A: f32 = 5.5;

bind_interrupts!(struct Irqs {
    OTG_FS => InterruptHandler<USB_OTG_FS>;
});

type Encoders = Arm<Qei<'static, TIM8>, Qei<'static, TIM3>, Qei<'static, TIM4>>;
type Amplifiers = Off<DutyCycle<SimplePwmChannel<'static, TIM1>>, Output<'static>>;
type TickClock = Clock<CORE_HZ, 8>;
type Usb = Driver<'static, USB_OTG_FS>;

static TILES: ConstStaticCell<Tiles<WINDOW>> = ConstStaticCell::new(Tiles::new());
static USB_BUFFER: ConstStaticCell<[u8; 256]> = ConstStaticCell::new([0; 256]);
static DESCRIPTORS: ConstStaticCell<Descriptors> = ConstStaticCell::new(Descriptors::new());
static CHANNELS: ConstStaticCell<Channels<'static>> = ConstStaticCell::new(Channels::new());

type Tick = HapticLoop<'static, Encoders, Amplifiers, TickClock, WINDOW>;
/// Carries the loop to its interrupt: filled once, before that is let through.
static HANDOVER: Mutex<Cell<Option<Tick>>> = Mutex::new(Cell::new(None));

/// The haptic tick, above everything else.
#[interrupt]
fn TIM7() {
    static mut TICK: Option<Tick> = None;
    let Some(tick) = TICK else {
        // Raised once by `main`, before there is a tick to be late for.
        let ready = critical_section::with(|cs| HANDOVER.borrow(cs).take());
        // Not an assignment, which would bring in the drivers' destructors:
        // they can panic, and nothing in this interrupt may.
        mem::forget(mem::replace(TICK, ready));
        return;
    };
    tick.tick();
    // Waking a task takes a critical section: left to an interrupt below.
    NVIC::pend(Interrupt::TIM6_DAC);
}

/// Raised by the tick; TIM6 itself is not used.
#[interrupt]
fn TIM6_DAC() {
    TICK_DONE.signal(());
}

/// For a program that failed: the enable pin low, past any driver.
fn amplifiers_off() {
    pac::GPIOF.bsrr().write(|w| w.set_br(3, true));
}

fn configuration() -> Config {
    let mut config = Config::default();
    config.bdma_interrupt_priority = stm32::nvic::OTHERS;
    config.dma_interrupt_priority = stm32::nvic::OTHERS;
    config.mdma_interrupt_priority = stm32::nvic::OTHERS;
    // 8 MHz come from the ST-LINK.
    config.rcc.hse = Some(rcc::Hse {
        freq: Hertz(8_000_000),
        mode: rcc::HseMode::Bypass,
    });
    config.rcc.pll1 = Some(rcc::Pll {
        source: rcc::PllSource::HSE,
        prediv: rcc::PllPreDiv::DIV4,
        mul: rcc::PllMul::MUL480,
        fracn: None,
        divp: Some(rcc::PllDiv::DIV2),
        divq: None,
        divr: None,
    });
    config.rcc.sys = rcc::Sysclk::PLL1_P;
    config.rcc.voltage_scale = rcc::VoltageScale::Scale0;
    config.rcc.ahb_pre = rcc::AHBPrescaler::DIV2;
    config.rcc.apb1_pre = rcc::APBPrescaler::DIV2;
    config.rcc.apb2_pre = rcc::APBPrescaler::DIV2;
    config.rcc.apb3_pre = rcc::APBPrescaler::DIV2;
    config.rcc.apb4_pre = rcc::APBPrescaler::DIV2;
    config.rcc.hsi48 = Some(rcc::Hsi48Config {
        sync_from_usb: true,
    });
    config.rcc.mux.usbsel = rcc::mux::Usbsel::HSI48;
    config
}

#[embassy_executor::task]
async fn serve_usb(mut device: UsbDevice<'static, Known<Usb>>) -> ! {
    device.run().await
}

#[embassy_executor::task]
async fn serve_link(
    mut link: Link<'static, WINDOW>,
    rx: Packets<<Usb as UsbDriver<'static>>::EndpointOut>,
    tx: Packets<<Usb as UsbDriver<'static>>::EndpointIn>,
) {
    run(&mut link, rx, tx, &Board).await;
}

#[embassy_executor::task]
async fn supervise(supervisor: Supervisor<'static, Dog<IWDG1>>) {
    stm32::supervise(supervisor).await;
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let mut core = cortex_m::Peripherals::take().expect("taken once");
    stm32::nvic::lower_all(&mut core);
    // No DMA is used, so the data cache needs no care.
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);
    let p = embassy_stm32::init(configuration());
    // The enable pin first of all.
    let enable = Output::new(p.PF3, Level::Low, Speed::Low);
    let pwm = SimplePwm::new(
        p.TIM1,
        Some(PwmPin::new(p.PE9, OutputType::PushPull)),
        Some(PwmPin::new(p.PE11, OutputType::PushPull)),
        Some(PwmPin::new(p.PE13, OutputType::PushPull)),
        None,
        Hertz(PWM_HZ),
        CountingMode::EdgeAlignedUp,
    )
    .split();
    let outputs = [pwm.ch1, pwm.ch2, pwm.ch3].map(|mut channel| {
        channel.enable();
        DutyCycle(channel)
    });
    let pulses = qei::Config::default();
    let counters = (
        Qei::new(p.TIM8, p.PC6, p.PC7, pulses),
        Qei::new(p.TIM3, p.PB4, p.PB5, pulses),
        Qei::new(p.TIM4, p.PD12, p.PD13, pulses),
    );
    let inputs = SafetyInputs {
        emergency_stop: Input::new(p.PF4, Pull::Up),
        dead_man: Input::new(p.PF5, Pull::Up),
    };
    let hardware = Hardware {
        encoders: Arm::new(counters, inputs),
        amplifiers: Off::new(outputs, enable, FULL_SCALE_A),
        clock: TickClock::new(p.TIM7, &PERIOD, &mut core),
        calibration: Stored::Missing,
        boot: BootReport::default(),
    };
    let Application {
        haptic_loop,
        link,
        vitals,
    } = assemble(TILES.take(), CHANNELS.take(), hardware, "nucleo-h743zi2");

    let mut wiring = usb::Config::default();
    // The board's power does not come from this connector.
    wiring.vbus_detection = false;
    let buffer = USB_BUFFER.take();
    let driver = Driver::new_fs(p.USB_OTG_FS, Irqs, p.PA12, p.PA11, buffer, wiring);
    let (device, rx, tx) =
        hapterra_firmware::usb::device(driver, embassy_stm32::uid::uid_hex(), DESCRIPTORS.take());
    spawner.spawn(serve_usb(device).expect("started once"));
    spawner.spawn(serve_link(link, rx, tx).expect("started once"));

    critical_section::with(|cs| HANDOVER.borrow(cs).set(Some(haptic_loop)));
    stm32::nvic::start_tick(Interrupt::TIM7, Interrupt::TIM6_DAC);
    let mut dog = IndependentWatchdog::new(p.IWDG1, stm32::WATCHDOG_US);
    dog.unleash();
    spawner.spawn(
        supervise(Supervisor::new(vitals, Dog(dog), &[Part::Tick, Part::Link]))
            .expect("started once"),
    );
    defmt::info!("nucleo-h743zi2 is up");
}
