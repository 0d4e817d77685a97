//! One direction of a line, frame by frame.

use crate::random::Random;

/// Direction of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// From the host.
    ToDevice,
    /// From the device.
    ToHost,
}

/// Fault of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameFault {
    /// It is lost.
    Lose,
    /// It arrives at once, and again this many ticks later.
    Repeat(u64),
    /// It is delayed by this many ticks; others overtake it.
    Delay(u64),
}

/// Frames in transit.
pub(super) struct LossyLine {
    /// The frames with the tick of their arrival.
    frames: Vec<(u64, Vec<u8>)>,
    /// Bytes of an unfinished frame.
    partial: Vec<u8>,
    /// All frames sent up to now.
    sent: Vec<Vec<u8>>,
    frame_faults: Vec<(usize, FrameFault)>,
    random: Option<(Random, usize)>,
    /// The tick until which new frames are lost.
    cut_until: u64,
}

impl LossyLine {
    pub(super) fn new(
        frame_faults: Vec<(usize, FrameFault)>,
        random: Option<(u64, usize)>,
    ) -> Self {
        Self {
            frames: vec![],
            partial: vec![],
            sent: vec![],
            frame_faults,
            random: random.map(|(seed, share)| (Random::new(seed), share)),
            cut_until: 0,
        }
    }

    pub(super) fn count(&self) -> usize {
        self.sent.len()
    }

    /// Repeats all earlier frames in order, like a store-and-forward node.
    pub(super) fn echo(&mut self, now: u64) {
        let duplicates = self.sent.iter().map(|frame| (now + 1, frame.clone()));
        self.frames.extend(duplicates);
    }

    /// Inserts a frame of another program.
    pub(super) fn inject(&mut self, frame: Vec<u8>, now: u64) {
        self.frames.push((now + 1, frame));
    }

    pub(super) fn cut(&mut self, until: u64) {
        self.cut_until = self.cut_until.max(until);
    }

    /// Drops an unfinished frame: its sender has ended.
    pub(super) fn drop_partial(&mut self) {
        self.partial.clear();
    }

    /// Sends bytes; whole frames enter the line.
    pub(super) fn send(&mut self, bytes: &[u8], now: u64) {
        for byte in bytes {
            self.partial.push(*byte);
            if *byte == 0 {
                let frame = std::mem::take(&mut self.partial);
                // A zero alone only ends an earlier frame.
                if frame.len() > 1 {
                    self.put(frame, now);
                }
            }
        }
    }

    fn put(&mut self, frame: Vec<u8>, now: u64) {
        let number = self.sent.len();
        self.sent.push(frame.clone());
        if now < self.cut_until {
            return;
        }
        let planned = self.frame_faults.iter().find(|(at, _)| *at == number);
        let frame_fault = planned
            .map(|(_, frame_fault)| *frame_fault)
            .or_else(|| self.random_fault());
        let due = now + 1;
        match frame_fault {
            None => self.frames.push((due, frame)),
            Some(FrameFault::Lose) => {}
            Some(FrameFault::Repeat(later)) => {
                self.frames.push((due, frame.clone()));
                self.frames.push((due + later, frame));
            }
            Some(FrameFault::Delay(later)) => self.frames.push((due + later, frame)),
        }
    }

    fn random_fault(&mut self) -> Option<FrameFault> {
        let (random, share) = self.random.as_mut()?;
        if random.below(1_000) >= *share {
            return None;
        }
        let later = [1, 10, 100, 1_000, 6_000][random.below(5)];
        Some(match random.below(3) {
            0 => FrameFault::Lose,
            1 => FrameFault::Repeat(later),
            _ => FrameFault::Delay(later),
        })
    }

    /// Returns the frames that have arrived, in order of arrival.
    pub(super) fn take_arrived(&mut self, now: u64) -> Vec<Vec<u8>> {
        let (mut arrived, later): (Vec<_>, Vec<_>) =
            self.frames.drain(..).partition(|(due, _)| *due <= now);
        self.frames = later;
        arrived.sort_by_key(|(due, _)| *due);
        arrived.into_iter().map(|(_, frame)| frame).collect()
    }
}
