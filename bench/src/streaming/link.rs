//! A line with a rate in bytes a tick, without errors and without delay.

use std::collections::VecDeque;

/// Bytes that wait for the line.
pub(super) struct Line {
    bytes_a_tick: usize,
    waiting: VecDeque<u8>,
}

impl Line {
    /// Creates an idle line.
    pub(super) fn new(bytes_a_tick: usize) -> Self {
        Self {
            bytes_a_tick,
            waiting: VecDeque::new(),
        }
    }

    /// Returns the bytes that it carries in a tick.
    pub(super) const fn bytes_a_tick(&self) -> usize {
        self.bytes_a_tick
    }

    /// Appends bytes to those that wait.
    pub(super) fn send(&mut self, bytes: &[u8]) {
        self.waiting.extend(bytes);
    }

    /// Sends a tick's bytes to a reader, which returns the number of bytes it accepted; the rest
    /// waits.
    pub(super) fn carry(&mut self, mut take: impl FnMut(&[u8]) -> usize) {
        let mut left = self.bytes_a_tick.min(self.waiting.len());
        while left > 0 {
            let (chunk, _) = self.waiting.as_slices();
            let taken = take(&chunk[..left.min(chunk.len())]);
            if taken == 0 {
                return;
            }
            self.waiting.drain(..taken);
            left -= taken;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_carries_no_more_than_its_bytes_and_loses_none() {
        let mut line = Line::new(10);
        let sent: Vec<u8> = (0..95).collect();
        let mut came: Vec<u8> = vec![];
        let mut ticks = 0;
        line.send(&sent[..40]);
        while came.len() < sent.len() {
            let before = came.len();
            // Accepts seven at a time, and nothing in every third tick.
            line.carry(|bytes| {
                let taken = if ticks % 3 == 2 {
                    0
                } else {
                    bytes.len().min(7)
                };
                came.extend(&bytes[..taken]);
                taken
            });
            assert!(came.len() - before <= 10);
            if ticks == 2 {
                line.send(&sent[40..]);
            }
            ticks += 1;
        }
        assert_eq!(came, sent);
        assert_eq!(ticks, 14);
    }
}
