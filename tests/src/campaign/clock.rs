//! A clock that can be made late.

use std::cell::Cell;
use std::rc::Rc;

use hapterra_firmware::board::TickClock;

/// Reading of the clock in the present tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reading {
    /// Counts since the tick was due.
    pub since_due: u32,
    /// True if the next tick is due before this one is done.
    pub overrun: bool,
    /// Periods that passed without a tick before this one.
    pub missing: u32,
}

/// A clock in lock-step that is set from outside.
#[derive(Clone, Debug, Default)]
pub struct SetClock(Rc<Cell<Reading>>);

impl SetClock {
    /// Sets its reading for the next tick.
    pub fn set(&self, reading: Reading) {
        self.0.set(reading);
    }
}

impl TickClock for SetClock {
    const HZ: u32 = 1_000_000;
    const PERIOD: u32 = 1_000;

    fn now(&self) -> u32 {
        0
    }

    fn since_due(&self) -> u32 {
        self.0.get().since_due
    }

    fn since_last_tick(&mut self) -> u32 {
        Self::PERIOD * (1 + self.0.get().missing)
    }

    fn begin_tick(&mut self) {}

    fn next_is_due(&self) -> bool {
        self.0.get().overrun
    }
}
