//! A clock that can be told to be late.

use std::cell::Cell;
use std::rc::Rc;

use hapterra_firmware::board::TickClock;

/// What the clock says in the tick at hand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Hands {
    /// Counts since the tick was due.
    pub since_due: u32,
    /// Whether the next tick is due before this one is done.
    pub overrun: bool,
}

/// A clock in lock-step whose hands are set from outside.
#[derive(Clone, Debug, Default)]
pub struct SetClock(Rc<Cell<Hands>>);

impl SetClock {
    /// Sets the hands for the next tick.
    pub fn set(&self, hands: Hands) {
        self.0.set(hands);
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

    fn begin_tick(&mut self) {}

    fn next_is_due(&self) -> bool {
        self.0.get().overrun
    }
}
