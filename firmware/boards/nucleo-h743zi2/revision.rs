//! Refuses a chip before revision V: the older ones are specified for 400 MHz, and read wrong data
//! from the AXI SRAM under load (ES0392, 2.2.9), which would be wrong heights.

use embassy_stm32::pac::gpio::vals::Moder;
use embassy_stm32::pac::{DBGMCU, GPIOB, RCC};
use hapterra_firmware::led::LedPattern;

/// DBGMCU_IDC.REV_ID of revision V.
const REVISION_V: u16 = 0x2003;
/// Argument of `delay` for a millisecond at the 64 MHz that the core has after a reset; on a
/// Cortex-M7, `delay` takes half of its nominal time.
const MS_CYCLES: u32 = 128_000;

/// Returns if the chip is of revision V or newer. Otherwise shows [`LedPattern::WrongChip`]
/// forever: no clock is raised, no output driven, and there is no link.
pub(crate) fn refuse_older() {
    if DBGMCU.idc().read().rev_id() >= REVISION_V {
        return;
    }
    RCC.ahb4enr().modify(|w| w.set_gpioben(true));
    // A clock starts after two cycles.
    let _ = RCC.ahb4enr().read();
    GPIOB.moder().modify(|w| w.set_moder(0, Moder::OUTPUT));
    let mut ms = 0_u32;
    loop {
        let is_lit = LedPattern::WrongChip.is_lit(ms);
        GPIOB.bsrr().write(|w| match is_lit {
            true => w.set_bs(0, true),
            false => w.set_br(0, true),
        });
        cortex_m::asm::delay(MS_CYCLES);
        ms = ms.wrapping_add(1);
    }
}
