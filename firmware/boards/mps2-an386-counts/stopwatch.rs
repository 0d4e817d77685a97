//! The timer that counts, and the vector table of an image without interrupts.

use core::hint::black_box;

use crate::registers::{Timer, clock_timer};

/// TIMER1, running.
pub(crate) struct Stopwatch(&'static Timer);

impl Stopwatch {
    /// Starts the timer: it counts down from `u32::MAX` at 25 MHz.
    pub(crate) fn start() -> Self {
        let timer = clock_timer();
        timer.reload.set(u32::MAX);
        timer.value.set(u32::MAX);
        timer.control.set(Timer::RUN);
        Self(timer)
    }

    /// Returns the timer counts of `work`, without those of reading the timer.
    #[inline(always)]
    pub(crate) fn counted<T>(&self, work: impl FnOnce() -> T) -> (u32, T) {
        let empty = self.between(|| black_box(()));
        let (took, result) = self.between(work);
        (took.wrapping_sub(empty.0), result)
    }

    #[inline(always)]
    fn between<T>(&self, work: impl FnOnce() -> T) -> (u32, T) {
        let began = self.0.value.get();
        let result = work();
        let ended = self.0.value.get();
        (began.wrapping_sub(ended), result)
    }
}

// SAFETY: cortex-m-rt defines it from `DefaultHandler`, with this signature.
unsafe extern "C" {
    #[link_name = "DefaultHandler"]
    safe fn no_handler();
}

/// The vector table: no interrupt is ever enabled.
// SAFETY: cortex-m-rt's `device` feature requires this section and this name, and the table
// contains only a function.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [extern "C" fn(); 1] = [no_handler];
