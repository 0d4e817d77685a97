//! Commands as duty cycles of TIM1.

use core::convert::Infallible;

use embassy_stm32::Peri;
use embassy_stm32::gpio::OutputType;
use embassy_stm32::pac;
use embassy_stm32::pac::common::{RW, Reg};
use embassy_stm32::pac::timer::regs::Ccr1ch;
use embassy_stm32::peripherals::{PE9, PE11, PE13, TIM1};
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm, SimplePwmChannel};
use embedded_hal::pwm::{self, SetDutyCycle};
use hapterra_firmware::amplifier::DutyCycle;

/// The image's name.
pub(crate) const BOARD: &str = "nucleo-h743zi2";
/// Frequency of the duty cycles. An ESCON reads 10 Hz to 5 kHz; the faster, the
/// less a command is delayed, and the coarser it is read.
const PWM_HZ: u32 = 5_000;

/// 10 % and 90 % are the ends of the range, 50 % is no current.
pub(crate) type Outputs = [DutyCycle<Compare>; 3];

/// Takes what is needed out of the chip's peripherals. A macro, as a function
/// cannot take some of them.
macro_rules! take_outputs {
    ($p:ident) => {
        crate::outputs::new($p.TIM1, $p.PE9, $p.PE11, $p.PE13)
    };
}
pub(crate) use take_outputs;

pub(crate) fn new(
    timer: Peri<'static, TIM1>,
    first: Peri<'static, PE9>,
    second: Peri<'static, PE11>,
    third: Peri<'static, PE13>,
) -> Outputs {
    let pwm = SimplePwm::new(
        timer,
        Some(PwmPin::new(first, OutputType::PushPull)),
        Some(PwmPin::new(second, OutputType::PushPull)),
        Some(PwmPin::new(third, OutputType::PushPull)),
        None,
        Hertz(PWM_HZ),
        CountingMode::EdgeAlignedUp,
    )
    .split();
    [(0, pwm.ch1), (1, pwm.ch2), (2, pwm.ch3)].map(|(index, mut channel)| {
        channel.enable();
        DutyCycle(Compare {
            max: channel.max_duty_cycle() as u16,
            _channel: channel,
            register: pac::TIM1.ccr(index),
        })
    })
}

/// A timer does not fail in a way that it could tell.
pub(crate) const fn failed() -> bool {
    false
}

/// A compare register as a duty cycle.
pub(crate) struct Compare {
    /// Keeps the channel as it was set up.
    _channel: SimplePwmChannel<'static, TIM1>,
    /// Its register: embassy's own way asserts the duty cycle at each write, and
    /// nothing in a tick may panic.
    register: Reg<Ccr1ch, RW>,
    max: u16,
}

// SAFETY: the register belongs to the channel, which can be sent as well.
unsafe impl Send for Compare {}

impl pwm::ErrorType for Compare {
    type Error = Infallible;
}

impl SetDutyCycle for Compare {
    fn max_duty_cycle(&self) -> u16 {
        self.max
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.register.write(|w| w.set_ccr(duty));
        Ok(())
    }
}
