//! The emergency stop, which is also the break of TIM1: pressing it ends the duty cycles
//! in hardware.
//!
//! A lockup of the core, a falling supply and memory that cannot be read (a double error of its
//! check bits) are also breaks. A break clears TIM1_BDTR.MOE, which sets the outputs to their idle
//! level, low (RM0433, 38.3.16). An amplifier that reads a duty cycle of 0 % as a broken wire is
//! then off, whatever the program does.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{AfType, Flex, Pull};
use embassy_stm32::pac::gpio::vals::Odr;
use embassy_stm32::pac::timer::vals::{Bkp, FilterValue, Ossi};
use embassy_stm32::pac::{GPIOF, SYSCFG, TIM1};
use embassy_stm32::peripherals::PE15;
use embassy_stm32::timer::{BkIn1, BreakInputPin};

use crate::stm32::encoders::Stop;

/// The pin, normally closed to ground, pulled up: high when pressed, and when the wire is
/// broken.
pub(crate) struct EmergencyStop(Flex<'static>);

/// Core cycles for the pull-up and the filter: 10 µs.
const SETTLE_CYCLES: u32 = 4_800;
/// SYSCFG_CFGR (RM0433, 12.3.3), as an index of words; metapac does not define it.
const SYSCFG_CFGR: usize = 0x18 / 4;
/// Its bits PVDL, FLASHL, CM7L, DTCML, ITCML and AXISRAML. They make these events breaks: low
/// supply (which also locks the comparator's settings), lockup of the core, and double errors of
/// flash and of the memories in use.
const BREAKS: u32 = 1 << 2 | 1 << 3 | 1 << 6 | 1 << 13 | 1 << 14 | 1 << 15;

/// Returns true if the enable pin is high.
fn amplifiers_are_on() -> bool {
    GPIOF.odr().read().odr(3) == Odr::HIGH
}

/// Moves the pin out of the chip's peripherals, as `take_outputs` does.
macro_rules! take_stop {
    ($p:ident) => {
        crate::stop::new($p.PE15)
    };
}
pub(crate) use take_stop;

/// Makes the pin the break of TIM1, which must be set up already.
pub(crate) fn new(pin: Peri<'static, PE15>) -> EmergencyStop {
    let function = BreakInputPin::<embassy_stm32::peripherals::TIM1, BkIn1>::af_num(&*pin);
    let mut stop = EmergencyStop(Flex::new(pin));
    stop.0
        .set_as_af_unchecked(function, AfType::input(Pull::Up));
    let cfgr = SYSCFG.as_ptr().cast::<u32>().wrapping_add(SYSCFG_CFGR);
    // SAFETY: a register of SYSCFG, whose clock is on. Its bits can only be set.
    unsafe { cfgr.write_volatile(BREAKS) };
    TIM1.bdtr().modify(|w| {
        w.set_ossi(Ossi::IDLE_LEVEL);
        // Eight equal samples of the stop at 7.1 MHz: a microsecond.
        w.set_bkf(0, FilterValue::FDTS_DIV32_N8);
        w.set_bkp(0, Bkp::ACTIVE_HIGH);
        w.set_bke(0, true);
    });
    cortex_m::asm::delay(SETTLE_CYCLES);
    // A break while the pin was being set up was no stop.
    TIM1.bdtr().modify(|w| w.set_moe(true));
    stop
}

impl Stop for EmergencyStop {
    /// Returns true also for a stop that was too short for the tick to read. The outputs return
    /// when the stop is released and the amplifiers are off, at the earliest one tick after the
    /// stop was reported: the compare registers contain the last command until then.
    fn is_pressed(&mut self) -> bool {
        let is_pressed = self.0.is_high();
        let is_broken_off = !TIM1.bdtr().read().moe();
        if is_broken_off && !is_pressed && !amplifiers_are_on() {
            TIM1.bdtr().modify(|w| w.set_moe(true));
        }
        is_pressed || is_broken_off
    }
}
