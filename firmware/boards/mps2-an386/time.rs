//! The emulated board's time, which can stand still.
//!
//! QEMU runs with `-icount shift=3,sleep=off`: an instruction takes 8 ns of emulated time (125
//! million a second, as a 168 MHz Cortex-M4F at 1.34 cycles an instruction), and sleeping costs no
//! real time. The board's two timers are its only clocks, so stopping both stops its time. This is
//! lock-step: while the host or the virtual Phantom has to answer first, there is a reason to
//! [`hold`], and the answer takes no time.

use core::sync::atomic::{AtomicU8, Ordering};

use hapterra_firmware::board::TickClock;

use crate::registers::{TIMER_HZ, Timer, clock_timer, tick_timer};

/// Counts between two ticks at 1 kHz.
const PERIOD: u32 = TIMER_HZ / 1000;

/// Reason for the stop of time, as bits.
#[derive(Clone, Copy)]
pub(crate) enum Reason {
    /// Requested by the application: it has nothing to do, or waits for tiles.
    Link = 1 << 0,
    /// The virtual Phantom has not answered the last tick.
    Plant = 1 << 1,
}

static REASONS: AtomicU8 = AtomicU8::new(Reason::Link as u8);

/// Sets up both timers, stopped until [`release`].
pub(crate) fn start() -> Clock {
    clock_timer().reload.set(u32::MAX);
    clock_timer().value.set(u32::MAX);
    tick_timer().reload.set(PERIOD - 1);
    tick_timer().value.set(PERIOD - 1);
    Clock
}

/// Stops the board's time until this reason is released.
pub(crate) fn hold(reason: Reason) {
    REASONS.fetch_or(reason as u8, Ordering::AcqRel);
    tick_timer().control.set(Timer::INTERRUPT);
    clock_timer().control.set(0);
}

/// Releases the reason; time continues when no reason remains.
pub(crate) fn release(reason: Reason) {
    let before = REASONS.fetch_and(!(reason as u8), Ordering::AcqRel);
    // Only if no other reason stopped the timers. While they are stopped the haptic interrupt
    // cannot run and add a reason; while they run it could, and starting them here would undo that.
    if before == reason as u8 {
        clock_timer().control.set(Timer::RUN);
        tick_timer().control.set(Timer::RUN | Timer::INTERRUPT);
    }
}

/// The two timers in the application's time.
pub(crate) struct Clock;

impl TickClock for Clock {
    const HZ: u32 = TIMER_HZ;
    const PERIOD: u32 = PERIOD;

    fn now(&self) -> u32 {
        u32::MAX - clock_timer().value.get()
    }

    fn since_due(&self) -> u32 {
        (PERIOD - 1).saturating_sub(tick_timer().value.get())
    }

    /// Returns the time since the last tick. The virtual Phantom answers each tick before the next
    /// one, so no force persists while the board's time stands still.
    fn since_last_tick(&mut self) -> u32 {
        PERIOD
    }

    fn begin_tick(&mut self) {
        tick_timer().pending.set(1);
    }

    fn next_is_due(&self) -> bool {
        tick_timer().pending.get() != 0
    }
}
