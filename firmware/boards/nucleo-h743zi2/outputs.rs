//! Commands as duty cycles of TIM1.
//!
//! TIM1 counts only while TIM15 does (gated mode, RM0433, 38.3.26), and TIM15 stops by itself two
//! periods of the tick after the last command. So the duty cycles end without the program, for
//! example when a debugger halts the core or a tick hangs, and only the next command restarts them.
//! Meanwhile their pins have a constant level, which an amplifier reads as a broken wire.

use embassy_stm32::gpio::OutputType;
use embassy_stm32::pac::timer::vals::{Mms, Sms};
use embassy_stm32::peripherals::{PE9, PE11, PE13, TIM1, TIM15};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm, SimplePwmChannels};
use embassy_stm32::{Peri, pac, rcc};
use hapterra_firmware::amplifier::{CURRENT_LOOP_US, CurrentOutputs, DUTY_HZ, duty_code};

use crate::stm32::clock::TICK_HZ;

/// The image's name.
pub(crate) const BOARD: &str = "nucleo-h743zi2";
/// Maximum time from the beginning of a tick until the motors have its current, µs: 121 to the
/// outputs (docs/reference/hardware.md), two periods until an amplifier has read a duty cycle that
/// waits for the next one, and the amplifiers' own time. The timers of the tick and of the duty
/// cycles run at an arbitrary phase, so the wait is a whole period.
pub(crate) const LATENCY_US: u16 = 121 + (2_000_000 / DUTY_HZ) as u16 + CURRENT_LOOP_US;

/// Time after the last command until the duty cycles end, µs: two ticks, because two consecutive
/// commands may be almost that far apart.
const COMMAND_VALID_US: u32 = 2_000_000 / TICK_HZ;

/// Three duty cycles: 15 % and 85 % are the ends of the range, 50 % is no current.
pub(crate) struct Outputs {
    /// Keeps the channels' configuration.
    _channels: SimplePwmChannels<'static, TIM1>,
    /// Counts of a duty cycle of 100 %.
    max: u16,
}

/// Moves the outputs' parts out of the chip's peripherals. A macro, because a function would need
/// all of them.
macro_rules! take_outputs {
    ($p:ident) => {
        crate::outputs::new($p.TIM1, $p.TIM15, $p.PE9, $p.PE11, $p.PE13)
    };
}
pub(crate) use take_outputs;

pub(crate) fn new(
    timer: Peri<'static, TIM1>,
    gate: Peri<'static, TIM15>,
    first: Peri<'static, PE9>,
    second: Peri<'static, PE11>,
    third: Peri<'static, PE13>,
) -> Outputs {
    let mut channels = SimplePwm::new(
        timer,
        Some(PwmPin::new(first, OutputType::PushPull)),
        Some(PwmPin::new(second, OutputType::PushPull)),
        Some(PwmPin::new(third, OutputType::PushPull)),
        None,
        Hertz(DUTY_HZ),
        CountingMode::EdgeAlignedUp,
    )
    .split();
    for channel in [&mut channels.ch1, &mut channels.ch2, &mut channels.ch3] {
        channel.enable();
    }
    close_after_commands(gate);
    Outputs {
        max: channels.ch1.max_duty_cycle() as u16,
        _channels: channels,
    }
}

/// Lets TIM1 count only while TIM15 does.
fn close_after_commands(_: Peri<'static, TIM15>) {
    rcc::enable_and_reset::<TIM15>();
    let counts_a_us = rcc::frequency::<TIM15>().0 / 1_000_000;
    pac::TIM15.psc().write_value((counts_a_us - 1) as u16);
    let last = (COMMAND_VALID_US - 1) as u16;
    pac::TIM15.arr().write(|w| w.set_arr(last));
    // Loads the prescaler.
    pac::TIM15.egr().write(|w| w.set_ug(true));
    pac::TIM15.cr1().modify(|w| w.set_opm(true));
    pac::TIM15.cr2().modify(|w| w.set_mms(Mms::ENABLE));
    // The trigger after a reset is ITR0, which is TIM15 (RM0433, 38.4.3).
    pac::TIM1.smcr().modify(|w| w.set_sms(Sms::GATED_MODE));
}

impl CurrentOutputs for Outputs {
    /// Writes the registers directly: embassy's own function asserts the duty cycle at each write,
    /// and a tick must not panic.
    fn set(&mut self, fractions: [f32; 3]) {
        let [first, second, third] = fractions.map(|fraction| duty_code(fraction, self.max));
        pac::TIM1.ccr(0).write(|w| w.set_ccr(first));
        pac::TIM1.ccr(1).write(|w| w.set_ccr(second));
        pac::TIM1.ccr(2).write(|w| w.set_ccr(third));
        pac::TIM15.cnt().write(|w| w.set_cnt(0));
        pac::TIM15.cr1().modify(|w| w.set_cen(true));
    }
}

/// Returns true if the outputs have failed: a timer does not report that.
pub(crate) const fn failed() -> bool {
    false
}

/// Returns true if the outputs are not as they were set: a timer does not report that.
pub(crate) const fn not_as_set() -> bool {
    false
}
