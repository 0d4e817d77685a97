//! Wait states of a flash: lines that arrive late.

/// Fetches of code from a memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Flash {
    /// Bytes of one read.
    pub line: u32,
    /// Core cycles of a read.
    pub read: u64,
}

/// The flash of an STM32G474 at 168 MHz: four wait states (RM0440, 3.3.3), and 64 bits a read in
/// dual-bank mode, which this firmware requires. Its cache is ignored here.
pub const G474: Flash = Flash { line: 8, read: 5 };

/// Reads in the order of execution. The line after the one in use is prefetched (PRFTEN) as soon as
/// the memory is free; a jump waits until the current read ends.
#[derive(Clone, Debug)]
pub struct Fetch {
    flash: Flash,
    /// The line in use.
    line: Option<u32>,
    /// The time at which the prefetch ends.
    ahead_at: u64,
}

impl Fetch {
    /// Creates a fetch with nothing read.
    #[must_use]
    pub const fn new(flash: Flash) -> Self {
        Self {
            flash,
            line: None,
            ahead_at: 0,
        }
    }

    /// Returns the time at which the instruction requested at `now` has arrived.
    pub fn instruction(&mut self, address: u32, length: u32, now: u64) -> u64 {
        let (from, to) = (
            address / self.flash.line,
            (address + length - 1) / self.flash.line,
        );
        (from..=to).fold(now, |now, line| self.take(line, now))
    }

    fn take(&mut self, line: u32, now: u64) -> u64 {
        if self.line == Some(line) {
            return now;
        }
        let free_at = now.max(self.ahead_at);
        let is_ahead = self.line.is_some_and(|before| before + 1 == line);
        let there_at = if is_ahead {
            free_at
        } else {
            free_at + self.flash.read
        };
        self.line = Some(line);
        self.ahead_at = there_at + self.flash.read;
        there_at
    }

    /// Returns the time at which a constant beside the code has arrived: the memory reads it
    /// between two lines, and its cache is ignored.
    pub fn literal(&mut self, now: u64) -> u64 {
        let there_at = now.max(self.ahead_at) + self.flash.read;
        self.ahead_at = there_at;
        there_at
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_code_of_wide_instructions_takes_a_read_for_two() {
        let mut fetch = Fetch::new(G474);
        let mut now = 0;
        for i in 0..100 {
            now = fetch.instruction(4 * i, 4, now) + 1;
        }
        // The first line without prefetch, the next 49 at 5 cycles each, and the last two executed.
        assert_eq!(now, 5 + 49 * 5 + 2);
    }

    #[test]
    fn slow_instructions_hide_the_reads() {
        let mut fetch = Fetch::new(G474);
        let mut now = fetch.instruction(0, 4, 0);
        assert_eq!(now, 5);
        for i in 1..50 {
            now += 14;
            assert_eq!(fetch.instruction(4 * i, 4, now), now, "{i}");
        }
    }

    #[test]
    fn jump_waits_for_current_fetch_and_its_own_fetch() {
        let mut fetch = Fetch::new(G474);
        assert_eq!(fetch.instruction(0, 2, 0), 5);
        // The prefetch of the next line ends at 10.
        assert_eq!(fetch.instruction(0x100, 2, 6), 15);
        // A wide instruction across two lines needs both.
        assert_eq!(fetch.instruction(0x206, 4, 30), 30 + 5 + 5);
    }

    #[test]
    fn literal_delays_the_line_after_it() {
        let mut fetch = Fetch::new(G474);
        assert_eq!(fetch.instruction(0, 4, 0), 5);
        assert_eq!(fetch.literal(6), 15);
        assert_eq!(fetch.instruction(8, 4, 16), 16);
    }
}
