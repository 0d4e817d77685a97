//! The STM32H743ZI: its clocks, pins and what is particular to it. The pins of the
//! outputs are the image's own ([`crate::outputs`]).

use cortex_m::Peripherals as Core;
use embassy_stm32::flash::Flash;
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::pac::Interrupt;
use embassy_stm32::peripherals::{IWDG1, TIM3, TIM4, TIM8, USB_OTG_FS};
use embassy_stm32::timer::qei::{self, Qei};
use embassy_stm32::usb::{self, Driver, InterruptHandler};
use embassy_stm32::{Config, Peripherals, bind_interrupts, pac, rcc, time::Hertz};
use hapterra_core::wire::status::ResetCause;
use hapterra_firmware::amplifier::Off;
use static_cell::ConstStaticCell;

use crate::flash;
use crate::outputs::{Outputs, take_outputs};
use crate::stm32::clock::CycleClock;
use crate::stm32::encoders::{SafetyInputs, TimerEncoders};
use crate::stm32::parts;
use crate::stm32::priorities::OTHERS;

/// Tiles along the side of the window.
pub(crate) const WINDOW: usize = 8;
/// Calibration areas: the last two sectors of bank 2, which `memory/nucleo-h743zi2.x`
/// leaves out, counted from the beginning of flash.
pub(crate) const CALIBRATIONS: [u32; 2] = [0x1C_0000, 0x1E_0000];
/// Bytes of a calibration area.
pub(crate) const CALIBRATIONS_SIZE: u32 = 0x2_0000;
/// The interrupt of the tick's timer.
pub(crate) const HAPTIC_INTERRUPT: Interrupt = Interrupt::TIM7;

bind_interrupts!(struct Irqs {
    OTG_FS => InterruptHandler<USB_OTG_FS>;
});

pub(crate) type Encoders = TimerEncoders<TIM8, TIM3, TIM4>;
pub(crate) type Amplifiers = Off<Outputs, Output<'static>>;
/// The core has 480,000,000 cycles a second.
pub(crate) type Clock = CycleClock<480_000_000, 8>;
pub(crate) type UsbDriver = Driver<'static, USB_OTG_FS>;
pub(crate) type WatchdogTimer = IWDG1;
pub(crate) type Parts = parts::Parts<Outputs, Encoders, UsbDriver, WatchdogTimer>;

static USB_BUFFER: ConstStaticCell<[u8; 256]> = ConstStaticCell::new([0; 256]);

/// Sets up what comes before the clocks: faults and caches. No DMA is used, so the data
/// cache needs no care.
pub(crate) fn prepare(core: &mut Core) {
    flash::tell_bus_faults(core);
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);
}

pub(crate) fn configuration() -> Config {
    let mut config = Config::default();
    config.bdma_interrupt_priority = OTHERS;
    config.dma_interrupt_priority = OTHERS;
    config.mdma_interrupt_priority = OTHERS;
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

/// Sets up the pins and what is behind them.
pub(crate) fn take(p: Peripherals) -> Parts {
    // The enable pin first of all.
    let enable = Output::new(p.PF3, Level::Low, Speed::Low);
    let pulses = qei::Config::default();
    let mut wiring = usb::Config::default();
    // The board's power does not come from this connector.
    wiring.vbus_detection = false;
    let buffer = USB_BUFFER.take();
    Parts {
        enable,
        outputs: take_outputs!(p),
        encoders: TimerEncoders {
            counters: (
                Qei::new(p.TIM8, p.PC6, p.PC7, pulses),
                Qei::new(p.TIM3, p.PB4, p.PB5, pulses),
                Qei::new(p.TIM4, p.PD12, p.PD13, pulses),
            ),
            counts: Default::default(),
            inputs: SafetyInputs {
                emergency_stop: Input::new(p.PF4, Pull::Up),
                dead_man: Input::new(p.PF5, Pull::Up),
            },
        },
        flash: Flash::new_blocking(p.FLASH),
        timer: p.TIM7,
        usb: Driver::new_fs(p.USB_OTG_FS, Irqs, p.PA12, p.PA11, buffer, wiring),
        watchdog: p.IWDG1,
        led: Output::new(p.PB0, Level::Low, Speed::Low),
    }
}

/// Reads what the chip says about its last reset; then the chip forgets it.
pub(crate) fn take_reset_cause() -> ResetCause {
    let flags = pac::RCC.rsr().read();
    pac::RCC.rsr().modify(|w| w.set_rmvf(true));
    match flags {
        _ if flags.iwdg1rstf() || flags.wwdg1rstf() => ResetCause::Watchdog,
        _ if flags.sftrstf() => ResetCause::Software,
        _ if flags.porrstf() => ResetCause::PowerOn,
        _ if flags.pinrstf() => ResetCause::Pin,
        _ => ResetCause::Unknown,
    }
}

/// Makes the data cache forget bytes, after memory has got them.
pub(crate) fn write_back(address: usize, bytes: usize) {
    // SAFETY: cleaning and invalidating by address keeps what memory is to
    // hold, and nothing relies on a state of the cache's registers.
    let mut core = unsafe { Core::steal() };
    core.SCB.clean_invalidate_dcache_by_address(address, bytes);
}

/// Sets the enable pin low, past any driver, for a program that failed.
pub(crate) fn amplifiers_off() {
    pac::GPIOF.bsrr().write(|w| w.set_br(3, true));
}
