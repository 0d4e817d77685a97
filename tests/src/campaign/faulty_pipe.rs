//! One direction of a link with faults.

use std::collections::VecDeque;

use crate::random::Random;

/// Disturbance of a pipe's transfers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkDisturbance {
    /// Share of chunks that are lost.
    pub lost: f64,
    /// Share of chunks that are duplicated.
    pub twice: f64,
    /// Share of chunks in which a bit is flipped.
    pub flipped: f64,
    /// Largest delay of a chunk, ticks.
    pub late: u32,
    /// True if the pipe is cut: new bytes are lost, and so are those in transit.
    pub cut: bool,
}

/// Bytes in transit.
#[derive(Default)]
pub struct Pipe {
    pieces: VecDeque<(u64, Vec<u8>)>,
}

impl Pipe {
    /// Sends bytes at a tick.
    pub fn send(
        &mut self,
        bytes: &[u8],
        now: u64,
        disturbance: &LinkDisturbance,
        random: &mut Random,
    ) {
        if disturbance.cut {
            self.pieces.clear();
            return;
        }
        if bytes.is_empty() || random.between(0.0, 1.0) < disturbance.lost {
            return;
        }
        let mut piece = bytes.to_vec();
        if random.between(0.0, 1.0) < disturbance.flipped {
            let at = random.below(piece.len());
            piece[at] ^= 1 << random.below(8);
        }
        let late = random.below(disturbance.late as usize + 1) as u64;
        // Bytes do not overtake each other.
        let due = self
            .pieces
            .back()
            .map_or(0, |(due, _)| *due)
            .max(now + late);
        if random.between(0.0, 1.0) < disturbance.twice {
            self.pieces.push_back((due, piece.clone()));
        }
        self.pieces.push_back((due, piece));
    }

    /// Returns the next chunk that has arrived.
    pub fn receive(&mut self, now: u64) -> Option<Vec<u8>> {
        let (due, _) = self.pieces.front()?;
        (*due <= now).then(|| self.pieces.pop_front().map(|(_, piece)| piece))?
    }

    /// Returns unread bytes to the pipe.
    pub fn put_back(&mut self, rest: Vec<u8>, now: u64) {
        if !rest.is_empty() {
            self.pieces.push_front((now, rest));
        }
    }
}
