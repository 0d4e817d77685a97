//! The independent watchdog.
//!
//! Modelled: start, feeding, prescaler and reload. Its oscillator is as slow as the data sheets
//! allow, so a reset is as late as possible. Not modelled: the lock of prescaler and reload (KR =
//! 0x5555), the busy bits of SR, the window.

const KR: u32 = 0x00;
const PR: u32 = 0x04;
const RLR: u32 = 0x08;
/// Slowest frequency of its low-speed oscillator: 29.5 kHz on a G474, 29.4 on an H743, over all
/// temperatures. The fastest is 34 kHz.
const LSI_HZ: u64 = 29_400;
/// Fastest frequency of this oscillator.
const MAX_LSI_HZ: u64 = 34_000;

/// The watchdog and the time of its last feeding.
#[derive(Default)]
pub struct Watchdog {
    running: bool,
    prescaler: u32,
    reload: u32,
    fed_ns: u64,
    /// Number of feedings.
    pub feed_count: u64,
}

impl Watchdog {
    /// Returns a register; the status is never busy.
    #[must_use]
    pub fn read(&self, offset: u32) -> u32 {
        match offset {
            PR => self.prescaler,
            RLR => self.reload,
            _ => 0,
        }
    }

    /// Writes a register from the core.
    pub fn write(&mut self, offset: u32, value: u32, now_ns: u64) {
        match (offset, value) {
            (KR, 0xCCCC) => (self.running, self.fed_ns) = (true, now_ns),
            (KR, 0xAAAA) => (self.feed_count, self.fed_ns) = (self.feed_count + 1, now_ns),
            (PR, _) => self.prescaler = value & 7,
            (RLR, _) => self.reload = value & 0xFFF,
            _ => {}
        }
    }

    /// Restarts the count, as after a feeding.
    pub fn restart(&mut self, now_ns: u64) {
        self.fed_ns = now_ns;
    }

    /// Stops the count for a while.
    pub fn freeze(&mut self, ns: u64) {
        self.fed_ns += ns;
    }

    /// Returns the longest time between two feedings, ns.
    #[must_use]
    pub fn timeout_ns(&self) -> u64 {
        self.cycles() * 1_000_000_000 / LSI_HZ
    }

    /// Returns the shortest time without a feeding after which it may reset the chip, ns.
    #[must_use]
    pub fn min_timeout_ns(&self) -> u64 {
        self.cycles() * 1_000_000_000 / MAX_LSI_HZ
    }

    fn cycles(&self) -> u64 {
        (u64::from(self.reload) + 1) * (4 << self.prescaler)
    }

    /// Returns true if it resets the chip now.
    #[must_use]
    pub fn has_expired(&self, now_ns: u64) -> bool {
        self.running && now_ns - self.fed_ns >= self.timeout_ns()
    }
}
