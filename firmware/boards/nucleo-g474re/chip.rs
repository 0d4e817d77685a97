//! The STM32G474RE: its clocks, pins and what is particular to it.

use cortex_m::Peripherals as Core;
use embassy_stm32::flash::Flash;
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::pac::Interrupt;
use embassy_stm32::peripherals::{IWDG, TIM2, TIM3, TIM4, USB};
use embassy_stm32::timer::qei::{self, Qei};
use embassy_stm32::usb::{Driver, InterruptHandler};
use embassy_stm32::{Config, Peripherals, bind_interrupts, pac, rcc, time::Hertz};
use hapterra_core::wire::status::ResetCause;
use hapterra_firmware::amplifier::Off;

use crate::outputs::{self, Outputs};
use crate::stm32::clock::CycleClock;
use crate::stm32::encoders::{SafetyInputs, TimerEncoders};
use crate::stm32::parts;
use crate::stm32::priorities::OTHERS;

/// Tiles along the side of the window.
pub(crate) const WINDOW: usize = 4;
/// Calibration areas: the last two pages of bank 2, which `memory/nucleo-g474re.x` leaves
/// out, counted from the beginning of flash.
pub(crate) const CALIBRATIONS: [u32; 2] = [0x7_F000, 0x7_F800];
/// Bytes of a calibration area.
pub(crate) const CALIBRATIONS_SIZE: u32 = 0x800;
/// The interrupt of the tick's timer.
pub(crate) const HAPTIC_INTERRUPT: Interrupt = Interrupt::TIM7_DAC;

bind_interrupts!(struct Irqs {
    USB_LP => InterruptHandler<USB>;
});

pub(crate) type Encoders = TimerEncoders<TIM2, TIM3, TIM4>;
pub(crate) type Amplifiers = Off<Outputs, Output<'static>>;
/// The core has 170,000,000 cycles a second.
pub(crate) type Clock = CycleClock<170_000_000, 4>;
pub(crate) type UsbDriver = Driver<'static, USB>;
pub(crate) type WatchdogTimer = IWDG;
pub(crate) type Parts = parts::Parts<Outputs, Encoders, UsbDriver, WatchdogTimer>;

/// Sets up what comes before the clocks: nothing on this chip.
pub(crate) const fn prepare(_core: &mut Core) {}

pub(crate) fn configuration() -> Config {
    let mut config = Config::default();
    config.bdma_interrupt_priority = OTHERS;
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

/// Sets up the pins and what is behind them.
pub(crate) fn take(p: Peripherals) -> Parts {
    // The enable pin first of all.
    let enable = Output::new(p.PB0, Level::Low, Speed::Low);
    let pulses = qei::Config::default();
    Parts {
        enable,
        outputs: outputs::new(p.DAC1, p.PA4, p.PA5, p.DAC2, p.PA6),
        encoders: TimerEncoders {
            counters: (
                Qei::new(p.TIM2, p.PA0, p.PA1, pulses),
                Qei::new(p.TIM3, p.PC6, p.PC7, pulses),
                Qei::new(p.TIM4, p.PB6, p.PB7, pulses),
            ),
            counts: Default::default(),
            inputs: SafetyInputs {
                emergency_stop: Input::new(p.PC0, Pull::Up),
                dead_man: Input::new(p.PC1, Pull::Up),
            },
        },
        flash: Flash::new_blocking(p.FLASH),
        timer: p.TIM7,
        usb: Driver::new(p.USB, Irqs, p.PA12, p.PA11),
        watchdog: p.IWDG,
        led: Output::new(p.PA8, Level::Low, Speed::Low),
    }
}

/// Reads what the chip says about its last reset; then the chip forgets it.
pub(crate) fn take_reset_cause() -> ResetCause {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    match flags {
        _ if flags.iwdgrstf() || flags.wwdgrstf() => ResetCause::Watchdog,
        _ if flags.sftrstf() => ResetCause::Software,
        _ if flags.borrstf() => ResetCause::PowerOn,
        _ if flags.pinrstf() => ResetCause::Pin,
        _ => ResetCause::Unknown,
    }
}

/// Makes the data cache forget bytes: this chip has none in front of RAM, and embassy
/// cares for the flash's own.
pub(crate) const fn write_back(_address: usize, _bytes: usize) {}

/// Sets the enable pin low, past any driver, for a program that failed.
pub(crate) fn amplifiers_off() {
    pac::GPIOB.bsrr().write(|w| w.set_br(0, true));
}
