//! Signs of life: who has checked in, and what the board measures about itself.

use core::sync::atomic::{AtomicU32, Ordering};

/// A part of the application that has to check in before the watchdog is fed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// The haptic tick.
    Tick = 0,
    /// The link's task.
    Link = 1,
    /// The USB stack's task.
    Usb = 2,
    /// The emulated board's plant line.
    Plant = 3,
}

impl Part {
    const fn bit(self) -> u32 {
        1 << self as u32
    }
}

/// Signs of life, shared by all parts. Single loads and stores, no lock.
#[derive(Debug, Default)]
pub struct Vitals {
    ticks: AtomicU32,
    dropped: AtomicU32,
    checked_in: AtomicU32,
    fed: AtomicU32,
    stack_size: AtomicU32,
    stack_high_water: AtomicU32,
}

impl Vitals {
    /// Nothing has happened yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            ticks: AtomicU32::new(0),
            dropped: AtomicU32::new(0),
            checked_in: AtomicU32::new(0),
            fed: AtomicU32::new(0),
            stack_size: AtomicU32::new(0),
            stack_high_water: AtomicU32::new(0),
        }
    }

    /// A part says that it lives. To be called at least every few
    /// milliseconds, from anywhere.
    pub fn check_in(&self, part: Part) {
        self.checked_in.fetch_or(part.bit(), Ordering::Relaxed);
    }

    /// Whether all of these have checked in since the last time that this was
    /// true.
    pub(crate) fn all_checked_in(&self, parts: &[Part]) -> bool {
        let all = parts.iter().fold(0, |bits, part| bits | part.bit());
        let here = self.checked_in.load(Ordering::Relaxed);
        if here & all != all {
            return false;
        }
        self.checked_in.fetch_and(!all, Ordering::Relaxed);
        true
    }

    pub(crate) fn count_tick(&self) {
        self.ticks.fetch_add(1, Ordering::Relaxed);
    }

    /// Ticks since the start, wrapping.
    #[must_use]
    pub fn ticks(&self) -> u32 {
        self.ticks.load(Ordering::Relaxed)
    }

    pub(crate) fn count_dropped(&self) {
        self.dropped.fetch_add(1, Ordering::Relaxed);
    }

    /// Samples that found the queue full.
    pub(crate) fn dropped(&self) -> u32 {
        self.dropped.load(Ordering::Relaxed)
    }

    pub(crate) fn count_feed(&self) {
        self.fed.fetch_add(1, Ordering::Relaxed);
    }

    /// Times that the watchdog was fed, wrapping.
    pub(crate) fn fed(&self) -> u32 {
        self.fed.load(Ordering::Relaxed)
    }

    /// The board tells how large its stack is and how much of it was ever
    /// used, bytes.
    pub fn measure_stack(&self, size: u32, high_water: u32) {
        self.stack_size.store(size, Ordering::Relaxed);
        self.stack_high_water.store(high_water, Ordering::Relaxed);
    }

    /// Size of the stack and how much of it was ever used, bytes.
    #[must_use]
    pub fn stack(&self) -> (u32, u32) {
        (
            self.stack_size.load(Ordering::Relaxed),
            self.stack_high_water.load(Ordering::Relaxed),
        )
    }
}
