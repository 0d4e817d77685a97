//! The monitor of the supply.
//!
//! The chip compares its supply with a level of 2.85 V or 2.9 V. Below it, the program ends like
//! any program that failed: the first instructions of the interrupt, whose priority is above the
//! tick's, switch the amplifiers off. The reset that follows also invalidates the counts of the
//! encoders, which may have the same supply.

use cortex_m::peripheral::DWT;
use embassy_stm32::gpio::Output;
use embassy_stm32::interrupt::InterruptExt;
use embassy_stm32::pac::EXTI;
use hapterra_firmware::board::TickClock;

use crate::chip::{Clock, SUPPLY_INTERRUPT, supply_is_low};
use crate::stm32::priorities;

/// EXTI's line of the comparator: it rises as the supply falls.
const LINE: usize = 16;
/// Core cycles for the comparator to settle: 0.2 ms at 456 MHz, 0.6 ms at 168 MHz.
const SETTLE_CYCLES: u32 = 100_000;
/// Core cycles for which the LED is lit and then dark: a twentieth of a second.
const FLICKER_CYCLES: u32 = Clock::HZ / 20;

/// Waits until the supply is high enough by the comparator, which is on already, and monitors it
/// from then on. Meanwhile the LED flickers, the amplifiers are off, and the watchdog does not run
/// yet.
pub(crate) fn wait_and_monitor(led: &mut Output<'_>) {
    cortex_m::asm::delay(SETTLE_CYCLES);
    while supply_is_low() {
        let is_lit = (DWT::cycle_count() / FLICKER_CYCLES).is_multiple_of(2);
        led.set_level(is_lit.into());
    }
    led.set_low();
    EXTI.rtsr(0).modify(|w| w.set_line(LINE, true));
    EXTI.imr(0).modify(|w| w.set_line(LINE, true));
    // Earlier edges do not count.
    EXTI.pr(0).write(|w| w.set_line(LINE, true));
    SUPPLY_INTERRUPT.unpend();
    priorities::start_supply_watch(SUPPLY_INTERRUPT);
    // An edge in between may have been lost.
    if supply_is_low() {
        SUPPLY_INTERRUPT.pend();
    }
}
