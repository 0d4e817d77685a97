//! The tick's timer; the core's cycle counter, which measures the cost of a tick; and the timer of
//! embassy's time, which measures the time between two ticks because it continues while a debugger
//! halts the core.

use cortex_m::Peripherals;
use cortex_m::peripheral::DWT;
use embassy_stm32::peripherals::TIM7;
use embassy_stm32::timer::low_level::Timer;
use embassy_stm32::{Peri, pac};
use hapterra_firmware::board::TickClock;

/// The timer of the haptic tick, on every chip.
pub(crate) type TickTimer = TIM7;

/// Ticks a second. `build.rs` has checked that the board supports this rate.
pub(crate) const TICK_HZ: u32 = match u32::from_str_radix(env!("HAPTERRA_TICK_HZ"), 10) {
    Ok(hz) => hz,
    Err(_) => panic!("build.rs writes a number"),
};

/// Divider of the timer's clock.
const DIVIDER: u16 = 4;

/// The tick's timer and the cycle counter of a core with `HZ` cycles a second, of which
/// `PER_COUNT` are one count of the timer.
pub(crate) struct CycleClock<const HZ: u32, const PER_COUNT: u32> {
    timer: Timer<'static, TickTimer>,
    /// The microsecond of the previous tick, modulo 65,536.
    last_us: Option<u16>,
}

/// Counts of [`microsecond`] in a second, as embassy configures its timer.
const US_HZ: u32 = {
    assert!(
        embassy_time::TICK_HZ == 1_000_000,
        "embassy's time is in microseconds"
    );
    1_000_000
};

/// Returns the current microsecond, modulo 65,536: embassy's timer has 16 bits.
fn microsecond() -> u16 {
    pac::TIM5.cnt().read() as u16
}

impl<const HZ: u32, const PER_COUNT: u32> CycleClock<HZ, PER_COUNT> {
    /// The auto-reload register. It is exact, while embassy would round a frequency.
    const RELOAD: u16 = {
        let counts_a_second = HZ / PER_COUNT;
        assert!(
            counts_a_second.is_multiple_of(TICK_HZ),
            "build.rs assumes another clock of this timer"
        );
        (counts_a_second / TICK_HZ - 1) as u16
    };

    /// Sets up the timer, which [`start`] starts.
    pub(crate) fn new(timer: Peri<'static, TickTimer>) -> Self {
        let timer = Timer::new(timer);
        let registers = timer.regs_core();
        registers.psc().write_value(DIVIDER - 1);
        registers.arr().write(|w| w.set_arr(Self::RELOAD));
        timer.generate_update_event();
        timer.clear_update_interrupt();
        timer.enable_update_interrupt(true);
        Self {
            timer,
            last_us: None,
        }
    }
}

/// Starts the cycle counter.
pub(crate) fn count_cycles(core: &mut Peripherals) {
    core.DCB.enable_trace();
    DWT::unlock();
    core.DWT.enable_cycle_counter();
}

/// Starts the timer. The interrupt already owns the loop.
pub(crate) fn start() {
    pac::TIM7.cr1().modify(|w| w.set_cen(true));
}

impl<const HZ: u32, const PER_COUNT: u32> TickClock for CycleClock<HZ, PER_COUNT> {
    const HZ: u32 = HZ;
    const PERIOD: u32 = HZ / TICK_HZ;

    fn now(&self) -> u32 {
        DWT::cycle_count()
    }

    fn since_due(&self) -> u32 {
        u32::from(self.timer.regs_core().cnt().read().cnt()) * PER_COUNT
    }

    fn since_last_tick(&mut self) -> u32 {
        let now_us = microsecond();
        let last_us = self.last_us.replace(now_us);
        last_us.map_or(Self::PERIOD, |last_us| {
            u32::from(now_us.wrapping_sub(last_us)) * (HZ / US_HZ)
        })
    }

    fn begin_tick(&mut self) {
        self.timer.clear_update_interrupt();
    }

    fn next_is_due(&self) -> bool {
        self.timer.regs_core().sr().read().uif()
    }
}
