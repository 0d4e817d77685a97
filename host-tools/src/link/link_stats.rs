//! Traffic and losses of the link.

use std::collections::HashSet;

use hapterra_core::terrain::TileKey;
use hapterra_core::wire::message::Telemetry;
use hapterra_core::wire::session::SampleCount;

/// Counts over all sessions with a device. Each sample of the device in a session of this host is
/// counted once: as received, lost or dropped.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LinkStats {
    /// Tiles sent.
    pub tiles: u64,
    /// Tiles among them that were sent before: lost in transit, or requested again after the window
    /// had moved away and back.
    pub repeated: u64,
    /// Bytes of the sent tiles, with framing.
    pub tile_bytes: u64,
    /// Telemetry samples received.
    pub samples: u64,
    /// Samples lost on the link, from the gaps in their numbers and the device's own count of sent
    /// samples.
    pub lost: u64,
    /// Samples that the device dropped because the link was slow.
    pub dropped: u64,
    /// Sessions whose end is unknown, because the device was restarted or another host opened one
    /// in between: more samples may be lost than were counted.
    pub uncertain: u64,
    /// Invalid frames.
    pub bad_frames: u64,
    /// Frames of other hosts' sessions, or of one that was over.
    pub foreign_frames: u64,
    /// Requests for tiles that do not exist.
    pub no_tiles: u64,
    /// Requests and queries that were given up without an answer.
    pub unanswered: u64,
    /// Sessions opened.
    pub sessions: u64,
    sent: HashSet<TileKey>,
    /// Samples lost before the last one that was received, and in sessions that ended.
    gaps: u64,
    current: Numbering,
    /// The session before, until the device has reported its last count.
    previous: Option<Numbering>,
}

/// The samples of one session.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Numbering {
    /// Expected number of the next sample.
    expected: u32,
    /// Device's counts of sent and dropped samples.
    reported: SampleCount,
}

impl Numbering {
    /// Returns the number of sent samples that are missing after the last received one.
    fn tail(&self) -> u64 {
        u64::from(lead_of(self.expected, self.reported.sent))
    }

    /// Stores the device's count; returns the number of samples dropped since the last count. A
    /// late count changes nothing.
    fn set_reported(&mut self, count: SampleCount) -> u64 {
        self.reported.sent = self
            .reported
            .sent
            .wrapping_add(lead_of(self.reported.sent, count.sent));
        let newly = lead_of(self.reported.dropped, count.dropped);
        self.reported.dropped = self.reported.dropped.wrapping_add(newly);
        u64::from(newly)
    }
}

/// Returns the lead of `later` over `earlier`; zero if it is behind.
fn lead_of(earlier: u32, later: u32) -> u32 {
    match later.wrapping_sub(earlier) {
        behind if behind > u32::MAX / 2 => 0,
        lead => lead,
    }
}

impl LinkStats {
    /// Begins a new session: its samples are numbered from zero.
    pub(super) fn begin_session(&mut self) {
        if self.current != Numbering::default() || self.sessions > 0 {
            self.settle(None);
            self.previous = Some(std::mem::take(&mut self.current));
        }
        self.count_lost();
    }

    /// Counts an opened session. `last` is the sample count of the session before, if the device
    /// still has it.
    pub(super) fn on_opened(&mut self, last: Option<SampleCount>) {
        self.sessions += 1;
        self.settle(last);
        self.count_lost();
    }

    /// Counts a restart of the device: samples are numbered from zero again.
    pub(super) fn on_restarted(&mut self) {
        self.sessions += 1;
        self.previous = Some(std::mem::take(&mut self.current));
        self.settle(None);
        self.count_lost();
    }

    /// Completes the counts of the session before.
    fn settle(&mut self, last: Option<SampleCount>) {
        let Some(mut previous) = self.previous.take() else {
            return;
        };
        match last {
            Some(count) => self.dropped += previous.set_reported(count),
            None => self.uncertain += 1,
        }
        self.gaps += previous.tail();
    }

    pub(super) fn sent_tile(&mut self, key: TileKey, bytes: usize) {
        self.tiles += 1;
        self.tile_bytes += bytes as u64;
        if !self.sent.insert(key) {
            self.repeated += 1;
        }
    }

    pub(super) fn sent_fallback(&mut self, bytes: usize) {
        self.tiles += 1;
        self.tile_bytes += bytes as u64;
    }

    /// Counts the samples of a message; returns false if they were received before or given up as
    /// lost.
    pub(super) fn received(&mut self, telemetry: &Telemetry) -> bool {
        let count = telemetry.samples.len() as u32;
        let gap = telemetry.first.wrapping_sub(self.current.expected);
        if gap > u32::MAX / 2 {
            return false;
        }
        self.gaps += u64::from(gap);
        self.samples += u64::from(count);
        self.current.expected = telemetry.first.wrapping_add(count);
        self.set_reported(SampleCount {
            sent: self.current.expected,
            dropped: telemetry.dropped,
        });
        true
    }

    /// Stores the device's own count of this session.
    pub(super) fn set_reported(&mut self, count: SampleCount) {
        self.dropped += self.current.set_reported(count);
        self.count_lost();
    }

    fn count_lost(&mut self) {
        let previous = self.previous.map_or(0, |previous| previous.tail());
        self.lost = self.gaps + previous + self.current.tail();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hapterra_core::scene::TickRecord;

    fn batch(first: u32, dropped: u32) -> Telemetry {
        Telemetry {
            first,
            dropped,
            samples: [TickRecord::default(); 4].into_iter().collect(),
        }
    }

    fn counted(stats: &LinkStats) -> (u64, u64, u64) {
        (stats.samples, stats.lost, stats.dropped)
    }

    const fn count(sent: u32, dropped: u32) -> SampleCount {
        SampleCount { sent, dropped }
    }

    #[test]
    fn gaps_are_loss_and_repeats_are_not_counted_twice() {
        let mut stats = LinkStats::default();
        stats.on_opened(None);
        assert!(stats.received(&batch(0, 0)));
        assert!(!stats.received(&batch(0, 0)));
        assert!(stats.received(&batch(12, 3)));
        assert_eq!(counted(&stats), (8, 8, 3));
        // A sample that arrives after later ones stays counted as lost, once.
        assert!(!stats.received(&batch(4, 1)));
        assert_eq!(counted(&stats), (8, 8, 3));
    }

    #[test]
    fn loss_at_the_start_and_at_the_end_is_counted() {
        let mut stats = LinkStats::default();
        stats.on_opened(None);
        stats.set_reported(count(16, 1));
        assert_eq!(counted(&stats), (0, 16, 1));
        assert!(stats.received(&batch(8, 1)));
        assert_eq!(counted(&stats), (4, 12, 1));
        stats.set_reported(count(12, 1));
        stats.set_reported(count(36, 2));
        stats.set_reported(count(36, 2));
        assert_eq!(counted(&stats), (4, 32, 2));
    }

    #[test]
    fn losses_at_session_end_are_counted_by_the_next_session() {
        let mut stats = LinkStats::default();
        stats.on_opened(None);
        assert!(stats.received(&batch(0, 0)));
        stats.begin_session();
        assert_eq!(counted(&stats), (4, 0, 0));
        stats.on_opened(Some(count(20, 7)));
        assert_eq!(counted(&stats), (4, 16, 7));
        assert!(stats.received(&batch(0, 0)));
        assert!(stats.received(&batch(4, 2)));
        assert_eq!((counted(&stats), stats.uncertain), ((12, 16, 9), 0));
    }

    #[test]
    fn restart_counts_the_session_as_uncertain() {
        let mut stats = LinkStats::default();
        stats.on_opened(None);
        assert!(stats.received(&batch(0, 0)));
        stats.set_reported(count(12, 1));
        stats.on_restarted();
        assert!(stats.received(&batch(0, 1)));
        assert_eq!((counted(&stats), stats.uncertain), ((8, 8, 2), 1));
    }

    #[test]
    fn numbers_wrap_around() {
        let mut numbering = Numbering {
            expected: u32::MAX - 3,
            reported: count(u32::MAX - 3, 0),
        };
        assert_eq!(numbering.set_reported(count(4, 0)), 0);
        assert_eq!(numbering.tail(), 8);
    }
}
