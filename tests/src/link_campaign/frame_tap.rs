//! Tap of the frames that leave the device: data that the oracle has and the host does
//! not.

use std::collections::HashMap;

use hapterra_core::terrain::TileKey;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME};
use hapterra_core::wire::message::ToHost;
use hapterra_core::wire::session::SessionNumber;

use super::frames;

/// Within this time a device that repeats a request for a tile cannot know that the tile
/// is lost, ms: its own time-out is as long.
const EARLY: u64 = 200;

/// When something left the device.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// The time, ms.
    pub now: u64,
    /// Ticks that the device has run.
    pub ticks: u64,
    /// True if the line has not stood still lately: otherwise what leaves may have been
    /// sent at any time before.
    pub flows: bool,
}

/// Reads what the device says.
#[derive(Default)]
pub struct Tap {
    /// The session that is counted.
    session: Option<SessionNumber>,
    reader: Box<FrameReader<MAX_FRAME>>,
    /// The first sample's tick and the last one's, in the present scene, since
    /// [`Tap::begin`].
    ticks: Option<(u32, u32)>,
    /// Samples of the scenes before, since then.
    before: u64,
    /// Of those scenes, the samples that were made after the last that left, at most: what
    /// another scene replaces is dropped, and counted by the device.
    replaced: u64,
    /// Ticks that the device had run when it took a scene, since the last sample left.
    taken: Option<u64>,
    /// Ticks of the device that were not the scene's, before it: the least that any sample
    /// was late to leave, so what it is for one that left at once.
    lead: u64,
    requested: HashMap<TileKey, u64>,
    /// Requests for tiles that came too early after the last for the same tile.
    pub early: u32,
}

impl Tap {
    /// A host begins, with this session; none where nothing is to be counted.
    pub fn begin(&mut self, session: Option<SessionNumber>) {
        self.session = session;
        self.requested.clear();
        self.ticks = None;
        self.before = 0;
        (self.replaced, self.taken) = (0, None);
        self.lead = u64::MAX;
        self.early = 0;
    }

    /// Samples that were made from the first that left the device since [`Tap::begin`] to
    /// the last, by the numbers of their ticks: also those that never left.
    #[must_use]
    pub fn made(&self) -> u64 {
        self.before + self.ticks.map_or(0, length)
    }

    /// Returns the largest number of samples that were made and have not left when the device has run so
    /// many ticks: after the last of each scene that did, as many as the device ran ticks.
    #[must_use]
    pub fn unseen(&self, ticks: u64) -> u64 {
        self.replaced + self.made_since(ticks)
    }

    fn made_since(&self, ticks: u64) -> u64 {
        let last = self.ticks.map_or(0, |(_, last)| u64::from(last));
        ticks.saturating_sub(self.lead.saturating_add(last))
    }

    /// Takes what left the device.
    pub fn hear(&mut self, mut bytes: &[u8], when: &Moment) {
        while !bytes.is_empty() {
            let (taken, frame) = self.reader.push(bytes);
            bytes = bytes.get(taken..).unwrap_or(&[]);
            // A frame that was cut short by a hello is none.
            let said = frame.and_then(|frame| frames::said_by_device(frame.ok()?));
            if let Some(said) = said.filter(|said| Some(said.session) == self.session) {
                self.on_message(&said.message, when);
            }
        }
    }

    fn on_message(&mut self, message: &ToHost, when: &Moment) {
        match message {
            ToHost::Telemetry(telemetry) => {
                let ticks = telemetry.samples.iter().map(|sample| sample.tick);
                ticks.for_each(|tick| self.on_sample(tick, when.ticks));
            }
            ToHost::TileRequest { key, .. } => {
                let before = self.requested.insert(*key, when.now);
                let early = before.is_some_and(|before| when.now < before + EARLY);
                self.early += u32::from(when.flows && early);
            }
            ToHost::SceneAck { accepted: true, .. } => {
                self.taken.get_or_insert(when.ticks);
            }
            _ => {}
        }
    }

    /// Takes a sample that left when the device had run so many ticks.
    fn on_sample(&mut self, tick: u32, ticks: u64) {
        let taken = self.taken.take();
        self.ticks = Some(match self.ticks {
            Some((first, last)) if tick > last => (first, tick),
            // A tick that goes back is that of another scene, whose ticks begin with 1.
            Some(scene) => {
                self.before += length(scene);
                self.replaced += taken.map_or(0, |ticks| self.made_since(ticks));
                self.lead = u64::MAX;
                (1, tick)
            }
            None => (tick, tick),
        });
        self.lead = self.lead.min(ticks.saturating_sub(u64::from(tick)));
    }
}

fn length((first, last): (u32, u32)) -> u64 {
    u64::from(last - first) + 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use hapterra_core::scene::TickRecord;
    use hapterra_core::wire::message::Telemetry;

    #[test]
    fn what_is_dropped_at_the_end_of_a_scene_was_made_and_is_not_seen() {
        let mut tap = Tap::default();
        tap.begin(None);
        let mut say = |ticks: u64, message: ToHost| {
            let (now, flows) = (ticks, true);
            tap.on_message(&message, &Moment { now, ticks, flows });
        };
        let samples = |from: u32| {
            let sample = |tick| TickRecord {
                tick,
                ..TickRecord::default()
            };
            ToHost::Telemetry(Telemetry {
                samples: (from..from + 8).map(sample).collect(),
                ..Telemetry::default()
            })
        };
        let taken = || ToHost::SceneAck {
            epoch: 7,
            accepted: true,
        };
        // The first scene runs for 19 ticks; the word for it comes again in between.
        say(0, taken());
        say(9, samples(1));
        say(12, taken());
        say(17, samples(9));
        say(20, taken());
        say(20, taken());
        say(29, samples(1));
        assert_eq!((tap.made(), tap.unseen(29)), (24, 3));
        assert_eq!(tap.unseen(31), 5);
    }
}
