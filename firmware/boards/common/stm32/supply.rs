//! The watch over the supply.
//!
//! The chip compares its supply with a level of 2.85 V or 2.9 V. Below it the program ends as
//! any program that failed: the amplifiers go off in the interrupt's first instructions, above
//! the tick's priority. The reset that follows also means that the counts of the encoders,
//! which the same supply may feed, are not believed any more.

use cortex_m::peripheral::DWT;
use embassy_stm32::gpio::Output;
use embassy_stm32::interrupt::InterruptExt;
use embassy_stm32::pac::EXTI;
use hapterra_firmware::board::TickClock;

use crate::chip::{Clock, SUPPLY_INTERRUPT, supply_is_low};
use crate::stm32::priorities;

/// EXTI's line of the comparator: it rises as the supply falls.
const LINE: usize = 16;
/// Core cycles that the comparator gets to settle: 0.2 ms at 456 MHz, 0.6 ms at 168 MHz.
const SETTLE_CYCLES: u32 = 100_000;
/// Core cycles that the LED is lit and then dark: a twentieth of a second.
const FLICKER_CYCLES: u32 = Clock::HZ / 20;

/// Waits until the supply is high enough, as the comparator that is on already has it, and
/// watches it from then on. Meanwhile the LED flickers, the amplifiers are off, and no
/// watchdog runs yet.
pub(crate) fn wait_and_watch(led: &mut Output<'_>) {
    cortex_m::asm::delay(SETTLE_CYCLES);
    while supply_is_low() {
        let is_lit = (DWT::cycle_count() / FLICKER_CYCLES).is_multiple_of(2);
        led.set_level(is_lit.into());
    }
    led.set_low();
    EXTI.rtsr(0).modify(|w| w.set_line(LINE, true));
    EXTI.imr(0).modify(|w| w.set_line(LINE, true));
    // No edge from before counts.
    EXTI.pr(0).write(|w| w.set_line(LINE, true));
    SUPPLY_INTERRUPT.unpend();
    priorities::start_supply_watch(SUPPLY_INTERRUPT);
    // One in between may have been lost.
    if supply_is_low() {
        SUPPLY_INTERRUPT.pend();
    }
}
