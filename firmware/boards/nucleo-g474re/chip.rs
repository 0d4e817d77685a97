//! The STM32G474RE: its clocks, pins and special features.

use core::arch::global_asm;
use core::mem::MaybeUninit;

use cortex_m::Peripherals as Core;
use embassy_stm32::adc::{Adc, AdcChannel, AdcConfig};
use embassy_stm32::flash::Flash;
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::pac::Interrupt;
use embassy_stm32::pac::adc::regs::{Smpr, Smpr2};
use embassy_stm32::pac::gpio::vals::{Idr, Odr};
use embassy_stm32::peripherals::{IWDG, TIM2, TIM3, TIM4, USB};
use embassy_stm32::usb::{Driver, InterruptHandler};
use embassy_stm32::{Config, Peripherals, interrupt, pac, rcc};
use hapterra_core::wire::status::ResetCause;
use hapterra_firmware::amplifier::Off;

use crate::outputs::{self, Outputs};
use crate::stm32::clock::CycleClock;
use crate::stm32::encoders::{SafetyInputs, TimerEncoders, quadrature};
use crate::stm32::feedback::{Feedback, Monitors};
use crate::stm32::priorities::OTHERS;
use crate::stm32::start::FULL_SCALE_A;
use crate::stm32::{failure, parts, usb_interrupt};

/// Tiles along the side of the window.
pub(crate) const WINDOW: usize = 3;
/// Calibration areas: the last two pages of bank 2, which `memory/nucleo-g474re.x` excludes,
/// counted from the beginning of flash.
pub(crate) const CALIBRATIONS: [u32; 2] = [0x7_F000, 0x7_F800];
/// Bytes of a calibration area.
pub(crate) const CALIBRATIONS_SIZE: u32 = 0x800;
/// The interrupt of the tick's timer.
pub(crate) const HAPTIC_INTERRUPT: Interrupt = Interrupt::TIM7_DAC;
/// The interrupt of the supply's comparator.
pub(crate) const SUPPLY_INTERRUPT: Interrupt = Interrupt::PVD_PVM;
/// GPIOB_BSRR, and its bit that sets the enable pin low.
pub(crate) const ENABLE_OFF: (u32, u32) = (0x4800_0418, 1 << 16);

/// USB's interrupt, embassy's name of it, and embassy's handler.
pub(crate) const USB_INTERRUPT: Interrupt = Interrupt::USB_LP;
pub(crate) type UsbInterrupt = interrupt::typelevel::USB_LP;
pub(crate) type UsbWork = InterruptHandler<USB>;

/// Declares to embassy that its handler is run.
#[derive(Clone, Copy)]
struct Irqs;

// SAFETY: a task runs it whenever the interrupt below was raised.
unsafe impl interrupt::typelevel::Binding<UsbInterrupt, UsbWork> for Irqs {}

#[interrupt]
fn USB_LP() {
    usb_interrupt::raised();
}

pub(crate) type Encoders = TimerEncoders<TIM2, TIM3, TIM4, Input<'static>>;
pub(crate) type Amplifiers = Off<Outputs, Output<'static>>;
/// The core has 168,000,000 cycles a second.
pub(crate) type Clock = CycleClock<168_000_000, 4>;
pub(crate) type UsbDriver = Driver<'static, USB>;
pub(crate) type WatchdogTimer = IWDG;
pub(crate) type Parts = parts::Parts<Outputs, Encoders, UsbDriver, WatchdogTimer>;

/// Excess bits of a current monitor's reading: none, it has 12.
pub(crate) const MONITOR_SHIFT: u32 = 0;

/// Conversions at the beginning of a sequence that are not read: a conversion more than a
/// millisecond after the previous one is wrong (ES0430), and so are those of ticks at 1 kHz.
pub(crate) const DUMMY_CONVERSIONS: usize = 1;

/// Time of a sequence of the dummies and three conversions, µs.
pub(crate) const SEQUENCE_US: u32 = 25;

/// Sets 247.5 clocks of 42 MHz, 6 µs, as sampling time of each channel, for monitors with an output
/// resistance of tens of kilohms.
pub(crate) fn sample_slowly(_channels: [u8; 3]) {
    pac::ADC1.smpr().write_value(Smpr(0o6_666_666_666));
    pac::ADC1.smpr2().write_value(Smpr2(0o666_666_666));
}

/// Enables the flash's prefetch, before the clocks are configured. It is off after a reset (RM0440,
/// 3.3.4), and embassy does not change that. It is unsafe only where code jumps from one bank to
/// the other (ES0430), and all code is in the first.
pub(crate) fn prepare(_core: &mut Core) {
    pac::FLASH.acr().modify(|w| w.set_prften(true));
}

pub(crate) fn configuration() -> Config {
    let mut config = Config::default();
    config.bdma_interrupt_priority = OTHERS;
    // The chip's own 16 MHz (1 % from 0 to 85 °C): no crystal that can break off. The core's
    // maximum is 170 MHz, so it has 168.
    config.rcc.pll = Some(rcc::Pll {
        source: rcc::PllSource::HSI,
        prediv: rcc::PllPreDiv::DIV4,
        mul: rcc::PllMul::MUL84,
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
    config.rcc.mux.adc12sel = rcc::mux::Adcsel::SYS;
    config
}

/// Sets up the pins and their peripherals.
pub(crate) fn take(p: Peripherals) -> Parts {
    // The enable pin first.
    let enable = Output::new(p.PB0, Level::Low, Speed::Low);
    let read_back = Adc::new(p.ADC2, AdcConfig::default());
    let outputs = outputs::new(p.DAC1, p.PA4, p.PA5, p.DAC2, p.PA6, read_back);
    let amplifiers = Off::new(outputs, enable, FULL_SCALE_A);
    compare_supply();
    Parts {
        amplifiers,
        encoders: TimerEncoders {
            counters: (
                quadrature(p.TIM2, p.PA0, p.PA1),
                quadrature(p.TIM3, p.PC6, p.PC7),
                quadrature(p.TIM4, p.PB6, p.PB7),
            ),
            counts: Default::default(),
            inputs: SafetyInputs {
                emergency_stop: Input::new(p.PC0, Pull::Up),
                dead_man: Input::new(p.PC1, Pull::Up),
                clutch: Input::new(p.PC9, Pull::Up),
            },
            feedback: Feedback {
                ready: [
                    Input::new(p.PC10, Pull::Up),
                    Input::new(p.PC11, Pull::Up),
                    Input::new(p.PC12, Pull::Up),
                ],
                monitors_fitted: Input::new(p.PC8, Pull::Up),
                monitors: Monitors::new(
                    Adc::new(p.ADC1, AdcConfig::default()),
                    [
                        p.PC2.degrade_adc(),
                        p.PC3.degrade_adc(),
                        p.PB1.degrade_adc(),
                    ],
                ),
            },
        },
        flash: has_two_banks().then(|| Flash::new_blocking(p.FLASH)),
        timer: p.TIM7,
        usb: Driver::new(p.USB, Irqs, p.PA12, p.PA11),
        watchdog: p.IWDG,
        led: Output::new(p.PA8, Level::Low, Speed::Low),
        heartbeat: Output::new(p.PD2, Level::Low, Speed::Low),
        mark: Output::new(p.PB10, Level::Low, Speed::Low),
    }
}

/// Reads and clears the cause of the chip's last reset.
pub(crate) fn take_reset_cause() -> ResetCause {
    let ran_before = mark_ram();
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    match flags {
        _ if flags.iwdgrstf() || flags.wwdgrstf() => ResetCause::Watchdog,
        _ if flags.sftrstf() => ResetCause::Software,
        // The chip sets one flag for both. After a short dip its RAM is still valid.
        _ if flags.borrstf() && ran_before => ResetCause::BrownOut,
        _ if flags.borrstf() => ResetCause::PowerOn,
        _ if flags.pinrstf() => ResetCause::Pin,
        _ => ResetCause::Unknown,
    }
}

/// Writes back the data cache: this chip has none before its RAM, and embassy handles the flash's
/// own.
pub(crate) const fn write_back(_address: usize, _bytes: usize) {}

/// Marks the RAM as this program's. Returns true if it was marked already: a program ran before,
/// and the RAM has kept its content since.
fn mark_ram() -> bool {
    /// "HAP4".
    const OURS: u32 = 0x4841_5034;
    #[unsafe(link_section = ".uninit.mark")]
    static mut MARK: MaybeUninit<u32> = MaybeUninit::uninit();
    let mark = (&raw mut MARK).cast::<u32>();
    // SAFETY: nothing else uses it, `main` calls this once, and any bits are a number.
    unsafe {
        let was_ours = mark.read_volatile() == OURS;
        mark.write_volatile(OURS);
        was_ours
    }
}

/// Returns true if the flash has two banks, as in a new chip. With one bank, the calibrations'
/// pages would be different ones.
fn has_two_banks() -> bool {
    pac::FLASH.optr().read().dbank()
}

/// Starts the comparison of the supply with the highest available level (2.9 V).
fn compare_supply() {
    pac::PWR.cr2().modify(|w| {
        w.set_pls(6);
        w.set_pvde(true);
    });
}

/// Returns true if the supply is below that level.
pub(crate) fn supply_is_low() -> bool {
    pac::PWR.sr2().read().pvdo()
}

#[interrupt]
fn PVD_PVM() {
    failure::supply_low()
}

/// Reads the supply below which the chip holds itself in reset, millivolts. The firmware does not
/// program this level: a power cut meanwhile could lock the chip.
pub(crate) fn resets_below_mv() -> u16 {
    match pac::FLASH.optr().read().bor_lev() {
        0 => 1_700,
        1 => 2_000,
        2 => 2_200,
        3 => 2_500,
        _ => 2_800,
    }
}

/// Lets the watchdog and the clock of embassy's time run while a debugger halts the core, whatever
/// the debugger has set: the watchdog resets the chip, and by the clock the next tick detects the
/// halt.
pub(crate) fn set_debug_freeze() {
    pac::DBGMCU.apb1lfzr().modify(|w| {
        w.set_iwdg(false);
        w.set_tim5(false);
    });
}

/// Sets the mark pin's level, without a driver.
pub(crate) fn set_mark(is_high: bool) {
    pac::GPIOB.bsrr().write(|w| match is_high {
        true => w.set_bs(10, true),
        false => w.set_br(10, true),
    });
}

/// Toggles the heartbeat, without a driver.
pub(crate) fn toggle_heartbeat() {
    let is_high = pac::GPIOD.odr().read().odr(2) == Odr::HIGH;
    pac::GPIOD.bsrr().write(|w| match is_high {
        true => w.set_br(2, true),
        false => w.set_bs(2, true),
    });
}

/// Returns true if the level at the enable pin differs from its output.
pub(crate) fn enable_pin_differs() -> bool {
    let is_high = pac::GPIOB.idr().read().idr(0) == Idr::HIGH;
    let is_set = pac::GPIOB.odr().read().odr(0) == Odr::HIGH;
    is_high != is_set
}

/// Sets the enable pin low, without a driver, for a program that failed.
#[inline(always)]
pub(crate) fn amplifiers_off() {
    pac::GPIOB.bsrr().write(|w| w.set_br(0, true));
}

// Copies nothing: on this chip the start-up code alone fills all memories.
global_asm!(
    ".section .text.hapterra_fill_nothing, \"ax\", %progbits",
    ".thumb",
    ".global hapterra_fill_nothing",
    ".type hapterra_fill_nothing, %function",
    ".thumb_func",
    "hapterra_fill_nothing:",
    "bx lr",
    ".size hapterra_fill_nothing, . - hapterra_fill_nothing",
);

unsafe extern "C" {
    /// Called by the start-up code before memory is initialised.
    #[link_name = "hapterra_fill_nothing"]
    pub(crate) fn fill_memories();
}
