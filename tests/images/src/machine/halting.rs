//! A debugger that halts the core, and a core that has locked up: time passes, and no
//! instruction runs.

use super::{Machine, Stop};

/// Nanoseconds between two looks.
const LOOK_NS: u64 = 5_000;

impl Machine {
    /// Says to the chip what a debugger says when it attaches: the watchdog is to stop
    /// while the core is halted, and nothing else is.
    pub fn attach_debugger(&mut self) {
        let (register, bit) = self.chip.freeze.watchdog;
        self.bus().write(register, bit, bit);
        if let Some((register, bit)) = self.chip.freeze.outputs {
            self.bus().write(register, 0, bit);
        }
    }

    /// Halts the core for so many milliseconds, or until the watchdog resets the chip.
    pub fn halt_ms(&mut self, ms: u64) -> Stop {
        self.bus().is_halted = true;
        let end_ns = self.bus().now_ns + ms * 1_000_000;
        loop {
            let mut bus = self.bus();
            if bus.watchdog.has_expired(bus.now_ns) {
                return Stop::Watchdog;
            }
            if bus.now_ns >= end_ns {
                return Stop::Time;
            }
            bus.advance(LOOK_NS);
        }
    }
}
