//! What went over the link.

use std::collections::HashSet;

use hapterra_core::terrain::TileKey;
use hapterra_core::wire::message::Telemetry;

/// Counts over all sessions with a device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Tiles sent.
    pub tiles: u64,
    /// Of those, tiles that had been sent before: lost on the way, or asked
    /// for again because the window had moved on and come back.
    pub again: u64,
    /// Bytes of the tiles sent, framing included.
    pub tile_bytes: u64,
    /// Telemetry samples received.
    pub samples: u64,
    /// Samples lost on the link, by the gaps in their numbers.
    pub lost: u64,
    /// Samples that the device dropped because the link was slow.
    pub dropped: u64,
    /// Frames that were not understood.
    pub bad_frames: u64,
    /// Sessions opened.
    pub sessions: u64,
    sent: HashSet<TileKey>,
    /// Number that the next sample should have.
    expected: u32,
    /// The device's own count at the last message; it starts with the device.
    dropped_before: u32,
}

impl Tally {
    /// A session begins: samples are numbered from zero again.
    pub(super) fn opened(&mut self) {
        self.sessions += 1;
        self.expected = 0;
    }

    pub(super) fn sent_tile(&mut self, key: TileKey, bytes: usize) {
        self.tiles += 1;
        self.tile_bytes += bytes as u64;
        if !self.sent.insert(key) {
            self.again += 1;
        }
    }

    /// Takes the count of a message; false if it is one that was seen before.
    pub(super) fn received(&mut self, telemetry: &Telemetry) -> bool {
        let count = telemetry.samples.len() as u32;
        let gap = telemetry.first.wrapping_sub(self.expected);
        if gap > u32::MAX / 2 {
            return false; // a duplicate of an earlier message
        }
        self.lost += u64::from(gap);
        self.samples += u64::from(count);
        self.expected = telemetry.first.wrapping_add(count);
        // A count that went down is that of a device that was restarted.
        let newly = telemetry
            .dropped
            .checked_sub(self.dropped_before)
            .unwrap_or(telemetry.dropped);
        self.dropped += u64::from(newly);
        self.dropped_before = telemetry.dropped;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hapterra_core::scene::Sample;

    fn batch(first: u32, dropped: u32) -> Telemetry {
        Telemetry {
            first,
            dropped,
            samples: [Sample::default(); 4].into_iter().collect(),
        }
    }

    #[test]
    fn gaps_are_loss_and_repeats_are_not_counted_twice() {
        let mut tally = Tally::default();
        tally.opened();
        assert!(tally.received(&batch(0, 0)));
        assert!(!tally.received(&batch(0, 0)));
        assert!(tally.received(&batch(12, 3)));
        assert_eq!((tally.samples, tally.lost, tally.dropped), (8, 8, 3));
        tally.opened();
        assert!(tally.received(&batch(0, 3)));
        assert!(tally.received(&batch(4, 1)));
        assert_eq!((tally.samples, tally.lost, tally.dropped), (16, 8, 4));
    }
}
