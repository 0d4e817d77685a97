//! The STM32H743ZI: its clocks, pins and special features. The pins of the outputs are in
//! [`crate::outputs`].

use core::mem::MaybeUninit;

use cortex_m::Peripherals as Core;
use embassy_stm32::adc::{Adc, AdcChannel};
use embassy_stm32::flash::Flash;
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::pac::Interrupt;
use embassy_stm32::pac::adc::regs::{Pcsel, Smpr};
use embassy_stm32::pac::crs::vals::Syncsrc;
use embassy_stm32::pac::gpio::vals::{Idr, Odr};
use embassy_stm32::peripherals::{IWDG1, TIM3, TIM4, TIM8, USB_OTG_FS};
use embassy_stm32::usb::{self, Driver, InterruptHandler};
use embassy_stm32::{Config, Peripherals, interrupt, pac, rcc};
use hapterra_core::wire::status::ResetCause;
use hapterra_firmware::amplifier::Off;
use static_cell::ConstStaticCell;

use crate::flash;
use crate::outputs::{Outputs, take_outputs};
use crate::revision;
use crate::stm32::clock::CycleClock;
use crate::stm32::encoders::{SafetyInputs, TimerEncoders, quadrature};
use crate::stm32::feedback::{Feedback, Monitors};
use crate::stm32::priorities::OTHERS;
use crate::stm32::start::FULL_SCALE_A;
use crate::stm32::{failure, parts, usb_interrupt};
use crate::stop::{EmergencyStop, take_stop};
use crate::tick_memory;
pub(crate) use crate::tick_memory::fill as fill_memories;

/// Tiles along the side of the window.
pub(crate) const WINDOW: usize = 8;
/// Calibration areas: the last two sectors of bank 2, which `memory/nucleo-h743zi2.x` excludes,
/// counted from the beginning of flash.
pub(crate) const CALIBRATIONS: [u32; 2] = [0x1C_0000, 0x1E_0000];
/// Bytes of a calibration area.
pub(crate) const CALIBRATIONS_SIZE: u32 = 0x2_0000;
/// The interrupt of the tick's timer.
pub(crate) const HAPTIC_INTERRUPT: Interrupt = Interrupt::TIM7;
/// The interrupt of the supply's comparator.
pub(crate) const SUPPLY_INTERRUPT: Interrupt = Interrupt::PVD_AVD;
/// GPIOF_BSRR, and its bit that sets the enable pin low.
pub(crate) const ENABLE_OFF: (u32, u32) = (0x5802_1418, 1 << 19);

/// USB's interrupt, embassy's name of it, and embassy's handler.
pub(crate) const USB_INTERRUPT: Interrupt = Interrupt::OTG_FS;
pub(crate) type UsbInterrupt = interrupt::typelevel::OTG_FS;
pub(crate) type UsbWork = InterruptHandler<USB_OTG_FS>;

/// Declares to embassy that its handler is run.
#[derive(Clone, Copy)]
struct Irqs;

// SAFETY: a task runs it whenever the interrupt below was raised.
unsafe impl interrupt::typelevel::Binding<UsbInterrupt, UsbWork> for Irqs {}

#[interrupt]
fn OTG_FS() {
    usb_interrupt::raised();
}

pub(crate) type Encoders = TimerEncoders<TIM8, TIM3, TIM4, EmergencyStop>;
pub(crate) type Amplifiers = Off<Outputs, Output<'static>>;
/// The core has 456,000,000 cycles a second.
pub(crate) type Clock = CycleClock<456_000_000, 8>;
pub(crate) type UsbDriver = Driver<'static, USB_OTG_FS>;
pub(crate) type WatchdogTimer = IWDG1;
pub(crate) type Parts = parts::Parts<Outputs, Encoders, UsbDriver, WatchdogTimer>;

static USB_BUFFER: ConstStaticCell<[u8; 256]> = ConstStaticCell::new([0; 256]);

/// Excess bits of a current monitor's reading: it has 16, and 12 are used.
pub(crate) const MONITOR_SHIFT: u32 = 4;

/// Conversions at the beginning of a sequence that are not read: this chip needs none.
pub(crate) const DUMMY_CONVERSIONS: usize = 0;

/// Time of a sequence of three conversions, µs, on the slower of the chip's revisions.
pub(crate) const SEQUENCE_US: u32 = 75;

/// Connects these channels and sets 387.5 clocks as sampling time of each, for monitors with an
/// output resistance of tens of kilohms: 12 µs at 32 MHz up to revision Y of the chip, 24 µs at 16
/// MHz from revision V on, where a fixed divider of two follows the prescaler.
pub(crate) fn sample_slowly(channels: [u8; 3]) {
    let selected = channels.iter().fold(0, |all, channel| all | 1 << channel);
    pac::ADC1.pcsel().write_value(Pcsel(selected));
    for half in [0, 1] {
        pac::ADC1.smpr(half).write_value(Smpr(0o6_666_666_666));
    }
}

/// Sets up the tick's memory, faults and caches, before the clocks. No DMA is used, so the data
/// cache needs no maintenance. Does not return on a chip that is too old.
pub(crate) fn prepare(core: &mut Core) {
    revision::refuse_older();
    tick_memory::protect(&core.MPU);
    flash::enable_bus_fault(core);
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);
}

pub(crate) fn configuration() -> Config {
    let mut config = Config::default();
    config.bdma_interrupt_priority = OTHERS;
    config.dma_interrupt_priority = OTHERS;
    config.mdma_interrupt_priority = OTHERS;
    // The chip's own 64 MHz (1 % from 20 to 105 °C). The board's 8 MHz come from the ST-LINK, which
    // a user may unplug or reset. The core's maximum is 480 MHz, so it has 456: the next lower
    // clock that is a multiple of every tick rate.
    config.rcc.pll1 = Some(rcc::Pll {
        source: rcc::PllSource::HSI,
        prediv: rcc::PllPreDiv::DIV32,
        mul: rcc::PllMul::MUL456,
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
    // The 64 MHz of the HSI.
    config.rcc.mux.adcsel = rcc::mux::Adcsel::PER;
    config
}

/// Sets up the pins and their peripherals.
pub(crate) fn take(p: Peripherals) -> Parts {
    // The enable pin first.
    let enable = Output::new(p.PF3, Level::Low, Speed::Low);
    // Before the stop, which may act on the outputs' timer.
    let amplifiers = Off::new(take_outputs!(p), enable, FULL_SCALE_A);
    // Also before the stop, which locks the comparator's settings.
    compare_supply();
    trim_usb_oscillator();
    let mut wiring = usb::Config::default();
    // The board's power is not from this connector.
    wiring.vbus_detection = false;
    let buffer = USB_BUFFER.take();
    Parts {
        amplifiers,
        encoders: TimerEncoders {
            counters: (
                quadrature(p.TIM8, p.PC6, p.PC7),
                quadrature(p.TIM3, p.PB4, p.PB5),
                quadrature(p.TIM4, p.PD12, p.PD13),
            ),
            counts: Default::default(),
            inputs: SafetyInputs {
                emergency_stop: take_stop!(p),
                dead_man: Input::new(p.PF5, Pull::Up),
                clutch: Input::new(p.PF4, Pull::Up),
            },
            feedback: Feedback {
                ready: [
                    Input::new(p.PF12, Pull::Up),
                    Input::new(p.PF13, Pull::Up),
                    Input::new(p.PF14, Pull::Up),
                ],
                monitors_fitted: Input::new(p.PF15, Pull::Up),
                monitors: Monitors::new(
                    Adc::new(p.ADC1),
                    [
                        p.PA3.degrade_adc(),
                        p.PC0.degrade_adc(),
                        p.PB1.degrade_adc(),
                    ],
                ),
            },
        },
        flash: Some(Flash::new_blocking(p.FLASH)),
        timer: p.TIM7,
        usb: Driver::new_fs(p.USB_OTG_FS, Irqs, p.PA12, p.PA11, buffer, wiring),
        watchdog: p.IWDG1,
        led: Output::new(p.PB0, Level::Low, Speed::Low),
        heartbeat: Output::new(p.PG1, Level::Low, Speed::Low),
        mark: Output::new(p.PG0, Level::Low, Speed::Low),
    }
}

/// Reads and clears the cause of the chip's last reset.
pub(crate) fn take_reset_cause() -> ResetCause {
    let flags = pac::RCC.rsr().read();
    pac::RCC.rsr().modify(|w| w.set_rmvf(true));
    match flags {
        _ if flags.iwdg1rstf() || flags.wwdg1rstf() => ResetCause::Watchdog,
        _ if flags.sftrstf() => ResetCause::Software,
        _ if flags.porrstf() => ResetCause::PowerOn,
        _ if flags.borrstf() => ResetCause::BrownOut,
        _ if flags.pinrstf() => ResetCause::Pin,
        _ => ResetCause::Unknown,
    }
}

/// A line of the data cache that is written after data that has to survive a reset.
#[repr(align(32))]
struct Line(u32);

/// Writes bytes from the data cache to memory, and then one more line: the SRAM keeps the last
/// written word in a buffer, for its check bits, and a reset loses it (RM0433, 2.4).
pub(crate) fn write_back(address: usize, bytes: usize) {
    #[unsafe(link_section = ".uninit.last_line")]
    static mut LAST: MaybeUninit<Line> = MaybeUninit::uninit();
    let last = (&raw mut LAST).cast::<Line>();
    // SAFETY: cleaning and invalidating by address keeps the memory's content, and nothing depends
    // on a state of the cache's registers.
    let mut core = unsafe { Core::steal() };
    core.SCB.clean_invalidate_dcache_by_address(address, bytes);
    // SAFETY: nothing reads it, and no reference to it exists.
    unsafe { (&raw mut (*last).0).write_volatile(0) };
    core.SCB
        .clean_invalidate_dcache_by_address(last as usize, size_of::<Line>());
}

/// Sets the start-of-frames of OTG_FS as the reference of USB's oscillator. embassy chooses source
/// 2, which belongs to the other peripheral, OTG_HS: RM0433 and ST's HAL name them USB1 (2) and
/// USB2 (3). The source can be written only while the recovery is off.
fn trim_usb_oscillator() {
    pac::CRS.cr().modify(|w| w.set_cen(false));
    pac::CRS
        .cfgr()
        .modify(|w| w.set_syncsrc(Syncsrc::from_bits(3)));
    pac::CRS.cr().modify(|w| w.set_cen(true));
}

/// Starts the comparison of the supply with the highest available level (2.85 V).
fn compare_supply() {
    pac::PWR.cr1().modify(|w| {
        w.set_pls(6);
        w.set_pvde(true);
    });
}

/// Returns true if the supply is below that level.
pub(crate) fn supply_is_low() -> bool {
    pac::PWR.csr1().read().pvdo()
}

#[interrupt]
fn PVD_AVD() {
    failure::supply_low()
}

/// Reads the supply below which the chip holds itself in reset, millivolts. The firmware does not
/// program this level: a power cut meanwhile could lock the chip.
pub(crate) fn resets_below_mv() -> u16 {
    match pac::FLASH.optsr_cur().read().bor_lev() {
        0 => 1_670,
        1 => 2_100,
        2 => 2_400,
        _ => 2_700,
    }
}

/// Lets the watchdog and the clock of embassy's time run while a debugger halts the core, whatever
/// the debugger has set: the watchdog resets the chip, and by the clock the next tick detects the
/// halt. TIM15, which keeps the duty cycles running, also runs. TIM1 stops in the halt; its outputs
/// are then off as by a break (RM0433, 38.3.28).
pub(crate) fn set_debug_freeze() {
    pac::DBGMCU.apb4fzr1().modify(|w| w.set_iwdg1(false));
    pac::DBGMCU.apb1lfzr1().modify(|w| w.set_tim5(false));
    pac::DBGMCU.apb2fzr1().modify(|w| {
        w.set_tim1(true);
        w.set_tim15(false);
    });
}

/// Sets the mark pin's level, without a driver.
pub(crate) fn set_mark(is_high: bool) {
    pac::GPIOG.bsrr().write(|w| match is_high {
        true => w.set_bs(0, true),
        false => w.set_br(0, true),
    });
}

/// Toggles the heartbeat, without a driver.
pub(crate) fn toggle_heartbeat() {
    let is_high = pac::GPIOG.odr().read().odr(1) == Odr::HIGH;
    pac::GPIOG.bsrr().write(|w| match is_high {
        true => w.set_br(1, true),
        false => w.set_bs(1, true),
    });
}

/// Returns true if the level at the enable pin differs from its output.
pub(crate) fn enable_pin_differs() -> bool {
    let is_high = pac::GPIOF.idr().read().idr(3) == Idr::HIGH;
    let is_set = pac::GPIOF.odr().read().odr(3) == Odr::HIGH;
    is_high != is_set
}

/// Sets the enable pin low, without a driver, for a program that failed.
#[inline(always)]
pub(crate) fn amplifiers_off() {
    pac::GPIOF.bsrr().write(|w| w.set_br(3, true));
}
