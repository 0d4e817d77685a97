//! One direction of a link that is not always kind.

use std::collections::VecDeque;

use crate::random::Random;

/// Disturbance of a pipe's transfers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Unkind {
    /// Share of pieces that are lost.
    pub lost: f64,
    /// Share of pieces that come twice.
    pub twice: f64,
    /// Share of pieces in which a bit is flipped.
    pub flipped: f64,
    /// Ticks that a piece is late at most.
    pub late: u32,
    /// Nothing gets in, and what was on its way is gone.
    pub cut: bool,
}

/// Bytes on their way.
#[derive(Default)]
pub struct Pipe {
    pieces: VecDeque<(u64, Vec<u8>)>,
}

impl Pipe {
    /// Puts bytes in at a tick.
    pub fn send(&mut self, bytes: &[u8], now: u64, unkind: &Unkind, random: &mut Random) {
        if unkind.cut {
            self.pieces.clear();
            return;
        }
        if bytes.is_empty() || random.between(0.0, 1.0) < unkind.lost {
            return;
        }
        let mut piece = bytes.to_vec();
        if random.between(0.0, 1.0) < unkind.flipped {
            let at = random.below(piece.len());
            piece[at] ^= 1 << random.below(8);
        }
        let late = random.below(unkind.late as usize + 1) as u64;
        // Bytes do not overtake each other.
        let due = self
            .pieces
            .back()
            .map_or(0, |(due, _)| *due)
            .max(now + late);
        if random.between(0.0, 1.0) < unkind.twice {
            self.pieces.push_back((due, piece.clone()));
        }
        self.pieces.push_back((due, piece));
    }

    /// The next piece that has arrived.
    pub fn receive(&mut self, now: u64) -> Option<Vec<u8>> {
        let (due, _) = self.pieces.front()?;
        (*due <= now).then(|| self.pieces.pop_front().map(|(_, piece)| piece))?
    }

    /// Puts back what was not taken.
    pub fn put_back(&mut self, rest: Vec<u8>, now: u64) {
        if !rest.is_empty() {
            self.pieces.push_front((now, rest));
        }
    }
}
