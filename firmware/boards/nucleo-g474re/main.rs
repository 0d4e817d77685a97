//! NUCLEO-G474RE: Cortex-M4F at 170 MHz, three encoder timers, three DAC
//! outputs, USB full speed.
//!
//! | what | pin | part |
//! | --- | --- | --- |
//! | encoder 1 A, B | PA0, PA1 | TIM2 |
//! | encoder 2 A, B | PC6, PC7 | TIM3 |
//! | encoder 3 A, B | PB6, PB7 | TIM4 |
//! | current command 1, 2, 3 | PA4, PA5, PA6 | DAC1 and DAC2, 12 bits, 0-3.3 V, middle is zero |
//! | amplifier enable, high is on, pull it down outside | PB0 | |
//! | emergency stop, closed to ground | PC0 | |
//! | dead-man switch, closed to ground while held | PC1 | |
//! | USB D-, D+ | PA11, PA12 | USB |
//! | status LED, to ground over a resistor | PA8 | |
//!
//! PA5 also drives the board's LED LD2: open its solder bridge.
#![no_std]
#![no_main]
// Interrupt handlers bear the names of the vectors.
#![allow(non_snake_case)]

#[path = "../common/critical.rs"]
mod critical;
mod flash;
#[path = "../common/stm32/mod.rs"]
mod stm32;

use core::cell::Cell;

use cortex_m::peripheral::NVIC;
use critical_section::Mutex;
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_stm32::dac::{Ch1, Dac, DacChannel};
use embassy_stm32::flash::Flash;
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::interrupt;
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::Interrupt;
use embassy_stm32::pac::common::{RW, Reg};
use embassy_stm32::pac::dac::regs::Dhr12r;
use embassy_stm32::peripherals::{IWDG, TIM2, TIM3, TIM4, USB};
use embassy_stm32::timer::qei::{self, Qei};
use embassy_stm32::usb::{Driver, InterruptHandler};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, bind_interrupts, pac, rcc, time::Hertz};
use embassy_usb::UsbDevice;
use embassy_usb::driver::Driver as UsbDriver;
use hapterra_firmware::amplifier::{CurrentOutput, Off, offset_code};
use hapterra_firmware::channels::{Application, Channels, Hardware, Tiles, assemble};
use hapterra_firmware::haptic_loop::HapticLoop;
use hapterra_firmware::link::Link;
use hapterra_firmware::link::task::run;
use hapterra_firmware::usb::{Descriptors, Known, Packets};
use hapterra_firmware::vitals::Vitals;
use static_cell::{ConstStaticCell, StaticCell};

use stm32::arm::{Arm, SafetyInputs};
use stm32::clock::Clock;
use stm32::memory::Memory;
use stm32::{Board, ResetFlags};

/// Tiles along the side of the window.
const WINDOW: usize = 4;
/// Core cycles a second.
const CORE_HZ: u32 = 170_000_000;
/// Current in amperes that the ends of a DAC's range stand for.
const FULL_SCALE_A: f32 = 5.5;
/// The largest DAC code.
const DAC_MAX: u16 = 4095;
/// First address of flash.
const FLASH_BASE: usize = 0x0800_0000;
/// The last two pages of bank 2, which `memory/nucleo-g474re.x` leaves out.
const CALIBRATIONS: [u32; 2] = [0x7_F000, 0x7_F800];
const CALIBRATIONS_SIZE: u32 = 0x800;

bind_interrupts!(struct Irqs {
    USB_LP => InterruptHandler<USB>;
});

type Encoders = Arm<Qei<'static, TIM2>, Qei<'static, TIM3>, Qei<'static, TIM4>>;
type Amplifiers = Off<[DacOutput; 3], Output<'static>>;
type TickClock = Clock<CORE_HZ, 4>;
type Usb = Driver<'static, USB>;

static TILES: ConstStaticCell<Tiles<WINDOW>> = ConstStaticCell::new(Tiles::new());
static DESCRIPTORS: ConstStaticCell<Descriptors> = ConstStaticCell::new(Descriptors::new());
static CHANNELS: ConstStaticCell<Channels<'static>> = ConstStaticCell::new(Channels::new());

type Tick = HapticLoop<'static, Encoders, Amplifiers, TickClock, WINDOW>;
/// Where the loop lives. Not in the interrupt's own variable: what has a value
/// from the start is stored in flash, too.
static LOOP: StaticCell<Tick> = StaticCell::new();
/// Carries it to its interrupt: filled once, before that is let through.
static HANDOVER: Mutex<Cell<Option<&'static mut Tick>>> = Mutex::new(Cell::new(None));

/// The haptic tick, above everything else.
#[interrupt]
fn TIM7_DAC() {
    static mut TICK: Option<&'static mut Tick> = None;
    let Some(tick) = TICK else {
        // Raised once by `main`, before there is a tick to be late for.
        *TICK = critical_section::with(|cs| HANDOVER.borrow(cs).take());
        return;
    };
    tick.tick();
    // Waking a task takes a critical section: left to an interrupt below.
    NVIC::pend(Interrupt::TIM6_DAC);
}

/// Raised by the tick; TIM6 itself is not used.
#[interrupt]
fn TIM6_DAC() {
    stm32::tick_done();
}

/// A DAC channel behind an offset stage: the middle of the range is no current.
struct DacOutput {
    /// Keeps the channel as it was set up.
    _channel: DacChannel<'static, Blocking>,
    /// Its data: embassy's own way asserts the channel's number at each write,
    /// and nothing in a tick may panic.
    data: Reg<Dhr12r, RW>,
}

// SAFETY: the register belongs to the channel, which can be sent as well.
unsafe impl Send for DacOutput {}

impl CurrentOutput for DacOutput {
    fn set(&mut self, fraction: f32) {
        let code = offset_code(fraction, DAC_MAX);
        self.data.write(|w| w.set_dhr(code));
    }
}

/// What the chip says about its last reset; then it forgets.
fn reset_flags() -> ResetFlags {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    ResetFlags {
        watchdog: flags.iwdgrstf() || flags.wwdgrstf(),
        software: flags.sftrstf(),
        power: flags.borrstf(),
        pin: flags.pinrstf(),
    }
}

/// There is no data cache in front of RAM, and flash's own is embassy's care.
fn write_back(_address: usize, _bytes: usize) {}

/// For a program that failed: the enable pin low, past any driver.
fn amplifiers_off() {
    pac::GPIOB.bsrr().write(|w| w.set_br(0, true));
}

/// A converter on the chip does not fail in a way that it could tell.
const fn hardware_failed() -> bool {
    false
}

fn configuration() -> Config {
    let mut config = Config::default();
    config.bdma_interrupt_priority = stm32::nvic::OTHERS;
    config.rcc.hse = Some(rcc::Hse {
        freq: Hertz(24_000_000),
        mode: rcc::HseMode::Oscillator,
    });
    config.rcc.pll = Some(rcc::Pll {
        source: rcc::PllSource::HSE,
        prediv: rcc::PllPreDiv::DIV6,
        mul: rcc::PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(rcc::PllRDiv::DIV2),
    });
    config.rcc.sys = rcc::Sysclk::PLL1_R;
    config.rcc.boost = true;
    config.rcc.hsi48 = Some(rcc::Hsi48Config {
        sync_from_usb: true,
    });
    config.rcc.mux.clk48sel = rcc::mux::Clk48sel::HSI48;
    config
}

#[embassy_executor::task]
async fn serve_usb(device: UsbDevice<'static, Known<Usb>>, vitals: &'static Vitals) {
    stm32::serve_usb(device, vitals).await;
}

#[embassy_executor::task]
async fn serve_link(
    mut link: Link<'static, WINDOW>,
    rx: Packets<<Usb as UsbDriver<'static>>::EndpointOut>,
    tx: Packets<<Usb as UsbDriver<'static>>::EndpointIn>,
    memory: Memory,
) {
    run(&mut link, rx, tx, &Board(memory)).await;
}

#[embassy_executor::task]
async fn supervise(
    vitals: &'static Vitals,
    dog: IndependentWatchdog<'static, IWDG>,
    led: Output<'static>,
) {
    stm32::supervise(vitals, dog, led).await;
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let mut core = cortex_m::Peripherals::take().expect("taken once");
    stm32::nvic::lower_all(&mut core);
    let p = embassy_stm32::init(configuration());
    // The enable pin first of all.
    let enable = Output::new(p.PB0, Level::Low, Speed::Low);
    let (first, second) = Dac::new_blocking(p.DAC1, p.PA4, p.PA5).split();
    let third = DacChannel::new_blocking::<_, Ch1>(p.DAC2, p.PA6);
    let outputs = [
        (first, pac::DAC1.dhr12r(0)),
        (second, pac::DAC1.dhr12r(1)),
        (third, pac::DAC2.dhr12r(0)),
    ]
    .map(|(channel, data)| DacOutput {
        _channel: channel,
        data,
    });
    let pulses = qei::Config::default();
    let counters = (
        Qei::new(p.TIM2, p.PA0, p.PA1, pulses),
        Qei::new(p.TIM3, p.PC6, p.PC7, pulses),
        Qei::new(p.TIM4, p.PB6, p.PB7, pulses),
    );
    let inputs = SafetyInputs {
        emergency_stop: Input::new(p.PC0, Pull::Up),
        dead_man: Input::new(p.PC1, Pull::Up),
    };
    let boot = stm32::boot_report(reset_flags());
    let flash = Flash::new_blocking(p.FLASH);
    let (memory, calibration) = Memory::open(flash, CALIBRATIONS, CALIBRATIONS_SIZE);
    let hardware = Hardware {
        encoders: Arm::new(counters, inputs),
        amplifiers: Off::new(outputs, enable, FULL_SCALE_A),
        clock: TickClock::new(p.TIM7, &mut core),
        calibration,
        boot,
    };
    let Application {
        haptic_loop,
        link,
        vitals,
    } = assemble(TILES.take(), CHANNELS.take(), hardware, "nucleo-g474re");

    let driver = Driver::new(p.USB, Irqs, p.PA12, p.PA11);
    let (device, rx, tx) =
        hapterra_firmware::usb::device(driver, embassy_stm32::uid::uid_hex(), DESCRIPTORS.take());
    spawner.spawn(serve_usb(device, vitals).expect("started once"));
    spawner.spawn(serve_link(link, rx, tx, memory).expect("started once"));

    let tick = LOOP.init(haptic_loop);
    critical_section::with(|cs| HANDOVER.borrow(cs).set(Some(tick)));
    stm32::nvic::start_tick(Interrupt::TIM7_DAC, Interrupt::TIM6_DAC);
    let mut dog = IndependentWatchdog::new(p.IWDG, stm32::WATCHDOG_US);
    dog.unleash();
    let led = Output::new(p.PA8, Level::Low, Speed::Low);
    spawner.spawn(supervise(vitals, dog, led).expect("started once"));
    defmt::info!("nucleo-g474re is up");
}
