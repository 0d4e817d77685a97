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
pub enum Harm {
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
    begun: Vec<u8>,
    /// All frames sent up to now.
    past: Vec<Vec<u8>>,
    harms: Vec<(usize, Harm)>,
    random: Option<(Random, usize)>,
    /// The tick until which new frames are lost.
    cut_until: u64,
}

impl LossyLine {
    pub(super) fn new(harms: Vec<(usize, Harm)>, random: Option<(u64, usize)>) -> Self {
        Self {
            frames: vec![],
            begun: vec![],
            past: vec![],
            harms,
            random: random.map(|(seed, share)| (Random::new(seed), share)),
            cut_until: 0,
        }
    }

    pub(super) fn count(&self) -> usize {
        self.past.len()
    }

    /// Repeats all earlier frames in order, like a store-and-forward node.
    pub(super) fn echo(&mut self, now: u64) {
        let again = self.past.iter().map(|frame| (now + 1, frame.clone()));
        self.frames.extend(again);
    }

    /// Inserts a frame of another program.
    pub(super) fn slip_in(&mut self, frame: Vec<u8>, now: u64) {
        self.frames.push((now + 1, frame));
    }

    pub(super) fn cut(&mut self, until: u64) {
        self.cut_until = self.cut_until.max(until);
    }

    /// Drops an unfinished frame: its sender is gone.
    pub(super) fn break_off(&mut self) {
        self.begun.clear();
    }

    /// Sends bytes; whole frames enter the line.
    pub(super) fn send(&mut self, bytes: &[u8], now: u64) {
        for byte in bytes {
            self.begun.push(*byte);
            if *byte == 0 {
                let frame = std::mem::take(&mut self.begun);
                // A zero alone only ends an earlier frame.
                if frame.len() > 1 {
                    self.put(frame, now);
                }
            }
        }
    }

    fn put(&mut self, frame: Vec<u8>, now: u64) {
        let number = self.past.len();
        self.past.push(frame.clone());
        if now < self.cut_until {
            return;
        }
        let planned = self.harms.iter().find(|(at, _)| *at == number);
        let harm = planned.map(|(_, harm)| *harm).or_else(|| self.drawn());
        let due = now + 1;
        match harm {
            None => self.frames.push((due, frame)),
            Some(Harm::Lose) => {}
            Some(Harm::Repeat(later)) => {
                self.frames.push((due, frame.clone()));
                self.frames.push((due + later, frame));
            }
            Some(Harm::Delay(later)) => self.frames.push((due + later, frame)),
        }
    }

    fn drawn(&mut self) -> Option<Harm> {
        let (random, share) = self.random.as_mut()?;
        if random.below(1_000) >= *share {
            return None;
        }
        let later = [1, 10, 100, 1_000, 6_000][random.below(5)];
        Some(match random.below(3) {
            0 => Harm::Lose,
            1 => Harm::Repeat(later),
            _ => Harm::Delay(later),
        })
    }

    /// Returns the frames that have arrived, in order of arrival.
    pub(super) fn arrived(&mut self, now: u64) -> Vec<Vec<u8>> {
        let (mut here, there): (Vec<_>, Vec<_>) =
            self.frames.drain(..).partition(|(due, _)| *due <= now);
        self.frames = there;
        here.sort_by_key(|(due, _)| *due);
        here.into_iter().map(|(_, frame)| frame).collect()
    }
}
