//! NUCLEO-H743ZI2: everything but the outputs that command the amplifiers,
//! which are the image's own ([`crate::outputs`]).

#[path = "../common/critical.rs"]
mod critical;
#[path = "flash.rs"]
pub(crate) mod flash;
#[path = "../common/stm32/mod.rs"]
pub(crate) mod stm32;

use core::cell::Cell;

use cortex_m::peripheral::NVIC;
use critical_section::Mutex;
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_stm32::flash::Flash;
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::interrupt;
use embassy_stm32::pac::Interrupt;
use embassy_stm32::peripherals::{IWDG1, TIM3, TIM4, TIM8, USB_OTG_FS};
use embassy_stm32::timer::qei::{self, Qei};
use embassy_stm32::usb::{self, Driver, InterruptHandler};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Config, bind_interrupts, pac, rcc, time::Hertz};
use embassy_usb::UsbDevice;
use embassy_usb::driver::Driver as UsbDriver;
use hapterra_firmware::amplifier::Off;
use hapterra_firmware::channels::{Application, Channels, Hardware, Tiles, assemble};
use hapterra_firmware::haptic_loop::HapticLoop;
use hapterra_firmware::link::Link;
use hapterra_firmware::link::task::run;
use hapterra_firmware::usb::{Descriptors, Known, Packets};
use hapterra_firmware::vitals::Vitals;
use static_cell::{ConstStaticCell, StaticCell};

use crate::outputs::{self, Outputs, take_outputs};
use stm32::arm::{Arm, SafetyInputs};
use stm32::clock::Clock;
use stm32::memory::Memory;
use stm32::{Board, ResetFlags};

/// Tiles along the side of the window.
const WINDOW: usize = 8;
/// Core cycles a second.
const CORE_HZ: u32 = 480_000_000;
/// Current in amperes that the ends of an output's range stand for.
const FULL_SCALE_A: f32 = 5.5;

/// First address of flash.
pub(crate) const FLASH_BASE: usize = 0x0800_0000;
/// The last two sectors of bank 2, which `memory/nucleo-h743zi2.x` leaves out.
const CALIBRATIONS: [u32; 2] = [0x1C_0000, 0x1E_0000];
const CALIBRATIONS_SIZE: u32 = 0x2_0000;

bind_interrupts!(struct Irqs {
    OTG_FS => InterruptHandler<USB_OTG_FS>;
});

type Encoders = Arm<Qei<'static, TIM8>, Qei<'static, TIM3>, Qei<'static, TIM4>>;
type Amplifiers = Off<Outputs, Output<'static>>;
type TickClock = Clock<CORE_HZ, 8>;
type Usb = Driver<'static, USB_OTG_FS>;

static TILES: ConstStaticCell<Tiles<WINDOW>> = ConstStaticCell::new(Tiles::new());
static USB_BUFFER: ConstStaticCell<[u8; 256]> = ConstStaticCell::new([0; 256]);
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
fn TIM7() {
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

/// What the chip says about its last reset; then it forgets.
fn reset_flags() -> ResetFlags {
    let flags = pac::RCC.rsr().read();
    pac::RCC.rsr().modify(|w| w.set_rmvf(true));
    ResetFlags {
        watchdog: flags.iwdg1rstf() || flags.wwdg1rstf(),
        software: flags.sftrstf(),
        power: flags.porrstf(),
        pin: flags.pinrstf(),
    }
}

/// The data cache forgets these bytes, after memory has got them.
pub(crate) fn write_back(address: usize, bytes: usize) {
    // SAFETY: cleaning and invalidating by address keeps what memory is to
    // hold, and the cache's registers have no state that anybody relies on.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    core.SCB.clean_invalidate_dcache_by_address(address, bytes);
}

/// For a program that failed: the enable pin low, past any driver.
pub(crate) fn amplifiers_off() {
    pac::GPIOF.bsrr().write(|w| w.set_br(3, true));
}

/// Whether the outputs cannot work.
pub(crate) fn hardware_failed() -> bool {
    outputs::failed()
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
    dog: IndependentWatchdog<'static, IWDG1>,
    led: Output<'static>,
) {
    stm32::supervise(vitals, dog, led).await;
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let mut core = cortex_m::Peripherals::take().expect("taken once");
    stm32::nvic::lower_all(&mut core);
    flash::tell_bus_faults(&mut core);
    // No DMA is used, so the data cache needs no care.
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);
    let p = embassy_stm32::init(configuration());
    // The enable pin first of all.
    let enable = Output::new(p.PF3, Level::Low, Speed::Low);
    let outputs = take_outputs!(p);
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
    } = assemble(TILES.take(), CHANNELS.take(), hardware, outputs::BOARD);

    let mut wiring = usb::Config::default();
    // The board's power does not come from this connector.
    wiring.vbus_detection = false;
    let buffer = USB_BUFFER.take();
    let driver = Driver::new_fs(p.USB_OTG_FS, Irqs, p.PA12, p.PA11, buffer, wiring);
    let (device, rx, tx) =
        hapterra_firmware::usb::device(driver, embassy_stm32::uid::uid_hex(), DESCRIPTORS.take());
    spawner.spawn(serve_usb(device, vitals).expect("started once"));
    spawner.spawn(serve_link(link, rx, tx, memory).expect("started once"));

    let tick = LOOP.init(haptic_loop);
    critical_section::with(|cs| HANDOVER.borrow(cs).set(Some(tick)));
    stm32::nvic::start_tick(Interrupt::TIM7, Interrupt::TIM6_DAC);
    let mut dog = IndependentWatchdog::new(p.IWDG1, stm32::WATCHDOG_US);
    dog.unleash();
    let led = Output::new(p.PB0, Level::Low, Speed::Low);
    spawner.spawn(supervise(vitals, dog, led).expect("started once"));
    defmt::info!("{} is up", outputs::BOARD);
}
