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
    pub(super) fn carry(&mut self, mut accept: impl FnMut(&[u8]) -> usize) {
        let mut remaining = self.bytes_a_tick.min(self.waiting.len());
        while remaining > 0 {
            let (chunk, _) = self.waiting.as_slices();
            let accepted = accept(&chunk[..remaining.min(chunk.len())]);
            if accepted == 0 {
                return;
            }
            self.waiting.drain(..accepted);
            remaining -= accepted;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tick_carries_at_most_its_bytes_and_loses_none() {
        let mut line = Line::new(10);
        let sent: Vec<u8> = (0..95).collect();
        let mut received: Vec<u8> = vec![];
        let mut ticks = 0;
        line.send(&sent[..40]);
        while received.len() < sent.len() {
            let before = received.len();
            // Accepts seven at a time, and nothing in every third tick.
            line.carry(|bytes| {
                let accepted = if ticks % 3 == 2 {
                    0
                } else {
                    bytes.len().min(7)
                };
                received.extend(&bytes[..accepted]);
                accepted
            });
            assert!(received.len() - before <= 10);
            if ticks == 2 {
                line.send(&sent[40..]);
            }
            ticks += 1;
        }
        assert_eq!(received, sent);
        assert_eq!(ticks, 14);
    }
}
