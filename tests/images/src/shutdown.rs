//! Shutdown in hardware: the break of TIM1, and the peripherals that stop with a halted core.
//!
//! Modelled by RM0433: of TIM1 CEN of CR1, the gate, the compare modes of CCMR1 and CCMR2, the
//! enables of CCER (38.4.7 to 38.4.11), and (38.3.16, 38.3.28, 38.4.20) BKE, BKP, OSSI and MOE of
//! BDTR, BKINE of AF1, BIF of SR; of SYSCFG_CFGR (12.3.3) PVDL, which also locks the comparator's
//! settings, CM7L, and the bits for double errors of flash and RAM; of DBGMCU (60.5.8) the bits
//! that stop the watchdog and TIM1 with the core, and on the G474 (RM0440, 47.16) the watchdog's.
//!
//! Not modelled: the break's filter, idle levels other than low, polarities other than high,
//! complementary outputs and their dead time, the second break, OSSR, AOE, LOCK, the preload of
//! compare registers.

use crate::timer::Timer;

const CR1: u32 = 0x00;
const SR: u32 = 0x10;
/// CCMR1 and CCMR2: two channels each.
const CCMR: [u32; 2] = [0x18, 0x1C];
const CCER: u32 = 0x20;
const BDTR: u32 = 0x44;
const AF1: u32 = 0x60;
/// Bit of CR1: the counter is enabled.
const CEN: u32 = 1 << 0;
/// Bits of a channel's byte of CCMR: the channel is an output, in PWM mode 1.
const CHANNEL: u32 = 0x73;
const PWM_1: u32 = 6 << 4;
/// Bit of BDTR: the outputs have their idle level while MOE is not set.
const OSSI: u32 = 1 << 10;
/// Bits of BDTR: break enable, break polarity (set: high), main output enable.
const BKE: u32 = 1 << 12;
const BKP: u32 = 1 << 13;
const MOE: u32 = 1 << 15;
/// Bit of SR: a break occurred. Bit of AF1: the pin is a source of it.
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
    /// Its bits for double errors of flash, DTCM, ITCM and AXI SRAM.
    pub memories: [u32; 4],
}

/// Registers and bits that stop parts of the chip while the core is halted.
#[derive(Clone, Copy, Debug)]
pub struct Freeze {
    /// Bit of the watchdog.
    pub watchdog: (u32, u32),
    /// Bit of the timer of embassy's time.
    pub clock: (u32, u32),
    /// Bit of TIM15, which gates TIM1.
    pub gate: Option<(u32, u32)>,
    /// Bit of TIM1.
    pub outputs: Option<(u32, u32)>,
}

/// The levels of a break's sources.
#[derive(Clone, Copy, Debug)]
pub struct Sources {
    /// The pin's level, if it has the break's function.
    pub pin: Option<bool>,
    /// The comparator, a lockup or a double error, if enabled.
    pub system: bool,
}

/// Applies the break to its timer. It has priority over a write that would switch the outputs on.
pub fn follow(timer: &mut Timer, sources: Sources) {
    let bdtr = timer.get(BDTR);
    let by_pin = sources.pin.is_some_and(|high| high == (bdtr & BKP != 0));
    let is_active = by_pin && timer.get(AF1) & BKINE != 0 || sources.system;
    if bdtr & BKE != 0 && is_active {
        timer.set(BDTR, bdtr & !MOE);
        timer.set(SR, timer.get(SR) | BIF);
    }
}

/// Outputs of a timer's first three channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outputs {
    /// Duty cycles.
    Pulses,
    /// They are driven low.
    Low,
    /// They keep their last level: an amplifier detects a broken wire.
    Frozen,
    /// At least one of them is not driven: its level depends on the outside.
    Floating,
}

/// Returns the timer's outputs. `is_stopped` is true if the halted core stops it, which for its
/// outputs equals MOE not set.
#[must_use]
pub fn outputs(timer: &Timer, is_stopped: bool) -> Outputs {
    let each = |is: &dyn Fn(u32) -> bool| (0..3).all(is);
    let is_enabled = |channel: u32| timer.get(CCER) >> (4 * channel) & 1 == 1;
    if !each(&is_enabled) {
        return Outputs::Floating;
    }
    let bdtr = timer.get(BDTR);
    if is_stopped || bdtr & MOE == 0 {
        return match bdtr & OSSI {
            0 => Outputs::Floating,
            _ => Outputs::Low,
        };
    }
    let makes_duty_cycles = |channel: u32| {
        let modes = timer.get(CCMR[(channel / 2) as usize]) >> (8 * (channel % 2));
        modes & CHANNEL == PWM_1
    };
    match timer.get(CR1) & CEN != 0 && each(&makes_duty_cycles) {
        true if timer.is_gate_open() => Outputs::Pulses,
        true => Outputs::Frozen,
        false => Outputs::Low,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a timer with duty cycles on three channels.
    fn timer() -> Timer {
        let mut timer = Timer::new(1);
        let set = [
            (CR1, CEN),
            (CCMR[0], PWM_1 | PWM_1 << 8),
            (CCMR[1], PWM_1),
            (CCER, 0x111),
            (BDTR, MOE | OSSI),
        ];
        for (register, value) in set {
            timer.set(register, value);
        }
        timer
    }

    #[test]
    fn pulses_require_running_timer_pwm_mode_and_enabled_channels() {
        assert_eq!(outputs(&timer(), false), Outputs::Pulses);
        let with = |register, value| {
            let mut timer = timer();
            timer.set(register, value);
            outputs(&timer, false)
        };
        assert_eq!(with(CR1, 0), Outputs::Low);
        assert_eq!(with(CCMR[0], PWM_1), Outputs::Low, "channel 2 is frozen");
        assert_eq!(
            with(CCMR[1], PWM_1 | 1),
            Outputs::Low,
            "channel 3 is an input"
        );
        for enabled in [0x110, 0x101, 0x011] {
            assert_eq!(with(CCER, enabled), Outputs::Floating, "{enabled:#x}");
        }
    }

    #[test]
    fn pins_without_main_output_enable_are_low_or_floating() {
        let mut timer = timer();
        assert_eq!(outputs(&timer, true), Outputs::Low);
        timer.set(BDTR, OSSI);
        assert_eq!(outputs(&timer, false), Outputs::Low);
        timer.set(BDTR, 0);
        assert_eq!(outputs(&timer, false), Outputs::Floating);
    }
}
