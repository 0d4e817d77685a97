//! The two directions between host and device, and their faults.

use std::collections::VecDeque;

use crate::random::Random;

/// Capacity of a direction in bytes: without room a device waits, as it does while its host does
/// not read.
const CAPACITY: usize = 8 << 10;
/// Bytes that a device may send in a tick, about as many as over full-speed USB.
pub const BYTES_PER_TICK: usize = 1_024;

/// Fault of one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LineFaults {
    /// Share of bytes in which a bit flips.
    pub flipped: f64,
    /// Share of transfers that lose a run of bytes.
    pub dropped: f64,
    /// Share of transfers that are duplicated.
    pub twice: f64,
    /// Largest delay of a transfer, ms.
    pub late: u32,
    /// True if no transfer moves.
    pub stalled: bool,
    /// True if it is cut: new bytes are lost, and so are those in transit.
    pub cut: bool,
}

impl LineFaults {
    /// No fault.
    pub const NONE: Self = Self {
        flipped: 0.0,
        dropped: 0.0,
        twice: 0.0,
        late: 0,
        stalled: false,
        cut: false,
    };
}

/// One direction.
#[derive(Default)]
pub struct Channel {
    transfers: VecDeque<(u64, Vec<u8>)>,
    held: usize,
    faults: LineFaults,
}

impl Channel {
    /// Sets its fault from now on.
    pub fn set_faults(&mut self, faults: LineFaults) {
        self.faults = faults;
        if faults.cut {
            self.transfers.clear();
            self.held = 0;
        }
    }

    /// Returns the free capacity in bytes.
    #[must_use]
    pub fn room(&self) -> usize {
        CAPACITY.saturating_sub(self.held)
    }

    /// Sends a transfer at `now`, ms.
    pub fn send(&mut self, bytes: &[u8], now: u64, random: &mut Random) {
        if bytes.is_empty() || self.faults.cut {
            return;
        }
        let mut transfer = bytes.to_vec();
        flip(&mut transfer, self.faults.flipped, random);
        if happens(self.faults.dropped, random) {
            let from = random.below(transfer.len());
            let to = (from + 1 + random.below(80)).min(transfer.len());
            transfer.drain(from..to);
        }
        let late = random.below(self.faults.late as usize + 1) as u64;
        // Bytes do not overtake each other.
        let due = self.transfers.back().map_or(0, |(due, _)| *due);
        let due = due.max(now + late);
        let times = 1 + usize::from(happens(self.faults.twice, random));
        for _ in 0..times {
            self.held += transfer.len();
            self.transfers.push_back((due, transfer.clone()));
        }
    }

    /// Returns the next transfer that has arrived.
    pub fn receive(&mut self, now: u64) -> Option<Vec<u8>> {
        let (due, _) = self.transfers.front()?;
        if self.faults.stalled || *due > now {
            return None;
        }
        let (_, transfer) = self.transfers.pop_front()?;
        self.held -= transfer.len();
        Some(transfer)
    }

    /// Returns unread bytes to the cable.
    pub fn put_back(&mut self, rest: &[u8], now: u64) {
        if !rest.is_empty() {
            self.held += rest.len();
            self.transfers.push_front((now, rest.to_vec()));
        }
    }
}

fn happens(share: f64, random: &mut Random) -> bool {
    share > 0.0 && random.between(0.0, 1.0) < share
}

/// Flips a bit in this share of the bytes.
fn flip(bytes: &mut [u8], share: f64, random: &mut Random) {
    if share <= 0.0 {
        return;
    }
    // Distance of two flips in bytes.
    let stride = |random: &mut Random| {
        let u = random.between(f64::MIN_POSITIVE, 1.0);
        (libm::log(u) / libm::log1p(-share)) as usize
    };
    let mut at = stride(random);
    while let Some(byte) = bytes.get_mut(at) {
        *byte ^= 1 << random.below(8);
        at += 1 + stride(random);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flipped_bits_match_the_error_rate() {
        let mut random = Random::new(1);
        let mut flipped = 0;
        for _ in 0..1_000 {
            let mut bytes = [0; 1_000];
            flip(&mut bytes, 1e-3, &mut random);
            flipped += bytes.iter().filter(|byte| **byte != 0).count();
        }
        assert!((900..1_100).contains(&flipped), "{flipped}");
    }

    #[test]
    fn stalled_bytes_are_delayed_and_cut_bytes_are_lost() {
        let mut random = Random::new(2);
        let mut channel = Channel::default();
        let stalled = LineFaults {
            stalled: true,
            ..LineFaults::NONE
        };
        channel.set_faults(stalled);
        channel.send(b"held", 1, &mut random);
        assert_eq!((channel.receive(9), channel.room()), (None, CAPACITY - 4));
        channel.set_faults(LineFaults::NONE);
        assert_eq!(channel.receive(9), Some(b"held".to_vec()));
        let cut = LineFaults {
            cut: true,
            ..LineFaults::NONE
        };
        channel.send(b"gone", 10, &mut random);
        channel.set_faults(cut);
        channel.send(b"gone", 11, &mut random);
        channel.set_faults(LineFaults::NONE);
        assert_eq!((channel.receive(99), channel.room()), (None, CAPACITY));
    }
}
