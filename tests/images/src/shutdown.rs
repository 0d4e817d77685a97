//! What stops the arm in hardware: the break of TIM1, and what a halted core stops.
//!
//! Modelled as RM0433 has it: of TIM1 (38.3.16, 38.3.28) BKE, BKP and MOE of BDTR, BKINE of
//! AF1, BIF of SR; of SYSCFG_CFGR (12.3.3) PVDL, which also locks the
//! comparator's settings, and CM7L; of DBGMCU (60.5.8) the bits that
//! stop the watchdog and TIM1 with the core, and of the G474's (RM0440, 47.16) the
//! watchdog's. The break's filter and its idle levels other than low are not modelled.

use crate::timer::Timer;

const SR: u32 = 0x10;
const BDTR: u32 = 0x44;
const AF1: u32 = 0x60;
/// Of BDTR: break enable, break polarity (set: high), main output enable.
const BKE: u32 = 1 << 12;
const BKP: u32 = 1 << 13;
const MOE: u32 = 1 << 15;
/// Of SR: a break came. Of AF1: the pin is a source of it.
const BIF: u32 = 1 << 7;
const BKINE: u32 = 1 << 0;

/// The sources of a timer's break.
#[derive(Clone, Copy, Debug)]
pub struct BreakAt {
    /// Name of the timer.
    pub timer: &'static str,
    /// The pin: port, number, alternate function.
    pub pin: (u32, u32, u32),
    /// SYSCFG_CFGR, and its bits for the supply's comparator and the core's lockup.
    pub system: (u32, u32, u32),
}

/// Registers and bits that stop parts of the chip while the core is halted.
#[derive(Clone, Copy, Debug)]
pub struct Freeze {
    /// The watchdog's.
    pub watchdog: (u32, u32),
    /// TIM1's.
    pub outputs: Option<(u32, u32)>,
}

/// The levels of a break's sources.
#[derive(Clone, Copy, Debug)]
pub struct Sources {
    /// The pin's level, where it bears the break's function.
    pub pin: Option<bool>,
    /// The comparator or a lockup, where they are let through.
    pub system: bool,
}

/// What the break does to its timer now. It wins over a write that would switch the
/// outputs on.
pub fn follow(timer: &mut Timer, sources: Sources) {
    let bdtr = timer.get(BDTR);
    let by_pin = sources.pin.is_some_and(|high| high == (bdtr & BKP != 0));
    let is_active = by_pin && timer.get(AF1) & BKINE != 0 || sources.system;
    if bdtr & BKE != 0 && is_active {
        timer.set(BDTR, bdtr & !MOE);
        timer.set(SR, timer.get(SR) | BIF);
    }
}

/// Whether the timer's outputs are driven by it.
#[must_use]
pub fn drives(timer: &Timer) -> bool {
    timer.get(BDTR) & MOE != 0
}
