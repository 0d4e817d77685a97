//! A core halted by a debugger, and a core in lockup: time passes without instructions. Also a
//! probe that stops reading the log.

use super::{Machine, Stop};

/// Nanoseconds between two checks.
const STEP_NS: u64 = 5_000;

impl Machine {
    /// Configures the chip as a debugger does when it attaches: the watchdog, the clock of
    /// embassy's time and the gate of the duty cycles stop while the core is halted, and nothing
    /// else does.
    pub fn attach_debugger(&mut self) {
        let freeze = self.chip.freeze;
        for (register, bit) in [freeze.watchdog, freeze.clock]
            .into_iter()
            .chain(freeze.gate)
        {
            self.bus().write(register, bit, bit);
        }
        if let Some((register, bit)) = freeze.outputs {
            self.bus().write(register, 0, bit);
        }
    }

    /// Feeds the watchdog like the supervisor, so that a halt may take all of its time.
    pub fn feed_watchdog(&mut self) {
        let mut bus = self.bus();
        let now_ns = bus.now_ns;
        bus.watchdog.restart(now_ns);
    }

    /// Halts the core for this time, or until the watchdog resets the chip.
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
            bus.advance(STEP_NS);
        }
    }

    /// Resumes a halted core.
    pub fn resume(&mut self) {
        self.bus().is_halted = false;
    }

    /// Fills the log's buffer without a reader, as after a probe is pulled out: in the channel's
    /// mode a writer waits for room.
    ///
    /// # Panics
    /// If the image has no log.
    pub fn stop_reading_log(&mut self) {
        // SEGGER's control block: 16 bytes of name, two counts, then the first channel's name,
        // buffer, size, write and read position and flags.
        let block = self.image.symbol("_SEGGER_RTT").expect("a log");
        let (size, write) = (self.word(block + 32), self.word(block + 36));
        const BLOCK_IF_FULL: u32 = 2;
        self.patch(block + 40, &((write + 1) % size).to_le_bytes());
        self.patch(block + 44, &BLOCK_IF_FULL.to_le_bytes());
    }
}
