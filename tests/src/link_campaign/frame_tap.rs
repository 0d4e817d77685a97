//! Tap of the frames that the device sends: data for the oracle that the host does not have.

use std::collections::HashMap;

use hapterra_core::terrain::TileKey;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME};
use hapterra_core::wire::message::ToHost;
use hapterra_core::wire::session::SessionNumber;

use super::frames;

/// Time within which a device cannot detect that a requested tile is lost, ms: its own time-out.
const EARLY: u64 = 200;

/// The time at which a frame left the device.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// The time, ms.
    pub now: u64,
    /// Ticks of the device up to now.
    pub ticks: u64,
    /// True if the line has not stalled recently: otherwise the frame may have been sent at any
    /// earlier time.
    pub flows: bool,
}

/// Reads the frames of the device.
#[derive(Default)]
pub struct Tap {
    /// The session under observation.
    session: Option<SessionNumber>,
    reader: Box<FrameReader<MAX_FRAME>>,
    /// The ticks of the first and last sample in the present scene, since [`Tap::begin`].
    ticks: Option<(u32, u32)>,
    /// Samples of earlier scenes since then.
    before: u64,
    /// Upper bound of the samples of earlier scenes that never left: a new scene drops them, and
    /// the device counts them.
    replaced: u64,
    /// Ticks of the device when it accepted a scene, since the last sample.
    taken: Option<u64>,
    /// Ticks of the device minus the scene's: the least over all samples, so the value for a sample
    /// that left without delay.
    lead: u64,
    requested: HashMap<TileKey, u64>,
    /// Requests for a tile that came too early after the last one for the same tile.
    pub early: u32,
}

impl Tap {
    /// Starts the observation of a session, or stops it with `None`.
    pub fn begin(&mut self, session: Option<SessionNumber>) {
        self.session = session;
        self.requested.clear();
        self.ticks = None;
        self.before = 0;
        (self.replaced, self.taken) = (0, None);
        self.lead = u64::MAX;
        self.early = 0;
    }

    /// Returns the samples made between the first and the last one that left the device since
    /// [`Tap::begin`], by their ticks, with those that never left.
    #[must_use]
    pub fn samples_made(&self) -> u64 {
        self.before + self.ticks.map_or(0, length)
    }

    /// Returns an upper bound of the samples made but not sent at this tick of the device: for each
    /// scene, the ticks since its last sample.
    #[must_use]
    pub fn max_unsent(&self, ticks: u64) -> u64 {
        self.replaced + self.samples_since(ticks)
    }

    fn samples_since(&self, ticks: u64) -> u64 {
        let last = self.ticks.map_or(0, |(_, last)| u64::from(last));
        ticks.saturating_sub(self.lead.saturating_add(last))
    }

    /// Reads bytes from the device.
    pub fn receive(&mut self, mut bytes: &[u8], when: &Moment) {
        while !bytes.is_empty() {
            let (taken, frame) = self.reader.push(bytes);
            bytes = bytes.get(taken..).unwrap_or(&[]);
            // A frame cut short by an open is dropped.
            let framed = frame.and_then(|frame| frames::parse_device_frame(frame.ok()?));
            if let Some(framed) = framed.filter(|framed| Some(framed.session) == self.session) {
                self.on_message(&framed.message, when);
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

    /// Records a sample that left at `ticks` of the device.
    fn on_sample(&mut self, tick: u32, ticks: u64) {
        let taken = self.taken.take();
        self.ticks = Some(match self.ticks {
            Some((first, last)) if tick > last => (first, tick),
            // A lower tick belongs to a new scene, whose ticks begin with 1.
            Some(scene) => {
                self.before += length(scene);
                self.replaced += taken.map_or(0, |ticks| self.samples_since(ticks));
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
    fn samples_dropped_by_a_new_scene_count_as_unseen() {
        let mut tap = Tap::default();
        tap.begin(None);
        let mut send = |ticks: u64, message: ToHost| {
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
        // The first scene runs for 19 ticks; its acknowledgement is repeated in between.
        send(0, taken());
        send(9, samples(1));
        send(12, taken());
        send(17, samples(9));
        send(20, taken());
        send(20, taken());
        send(29, samples(1));
        assert_eq!((tap.samples_made(), tap.max_unsent(29)), (24, 3));
        assert_eq!(tap.max_unsent(31), 5);
    }
}
