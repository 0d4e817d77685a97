//! A turn: what the loop did, what it needs, what goes out.

use hapterra_core::terrain::{Focus, IN_FLIGHT, Tile};
use hapterra_core::tick::Command;
use hapterra_core::wire::message::{BATCH, Telemetry, ToHost};
use heapless::Vec;

use super::{Session, Stage};
use crate::channels::Record;
use crate::link::focus::follow;
use crate::vitals::Part;

impl<'t, const D: usize> Session<'t, D> {
    pub(crate) fn turn(&mut self) {
        self.ends.vitals.check_in(Part::Link);
        self.reclaim();
        self.collect();
        self.tell();
        self.feed_points();
        self.ask();
        self.pack();
    }

    /// Takes back the tile buffers that the loop is done with.
    pub(super) fn reclaim(&mut self) {
        while let Some(tile) = self.ends.spent.dequeue() {
            self.content = None;
            // It bears its own name if the window would not have it, and the
            // name of what it pushed out otherwise: either is not held.
            if let Some(key) = tile.key() {
                self.puller.lost(key);
            }
            self.give_back(tile);
        }
    }

    pub(super) fn give_back(&mut self, tile: &'t mut Tile) {
        // There are no more buffers than places.
        let _ = self.spare.push(tile);
    }

    /// Reads what the loop recorded since the last turn.
    fn collect(&mut self) {
        while self.outbox.has_room() {
            let Some(record) = self.ends.records.dequeue() else {
                return;
            };
            self.content = None;
            self.focus = Some(follow(&self.previous, &record, self.desk.ticks_per_ms()));
            self.previous = record;
            if record.answers.is_some() {
                self.replay.under_way = None;
                self.replay.last = Some(record);
                self.say_felt(record);
            } else if self.feels_arm() {
                self.keep(record);
            }
        }
    }

    /// Tells where the loop stands, and what became of requests.
    fn tell(&mut self) {
        while let Some(health) = self.ends.healths.dequeue() {
            self.desk.take(health);
        }
        while self.stage == Stage::Open && self.outbox.has_room() {
            let Some(message) = self.desk.next_to_say() else {
                return;
            };
            self.say(&message);
        }
    }

    fn keep(&mut self, record: Record) {
        if self.stage == Stage::Open && self.backlog.push_back(record).is_err() {
            self.dropped = self.dropped.wrapping_add(1);
        }
    }

    /// One point at a time: the loop would forget a second.
    fn feed_points(&mut self) {
        if self.replay.under_way.is_some() || !self.ends.commands.ready() {
            return;
        }
        if let Some(point) = self.points.pop_front() {
            self.replay.under_way = Some(point.seq);
            self.command(Command::Point(point));
        }
    }

    /// Asks for tiles, each with a buffer waiting for it.
    fn ask(&mut self) {
        let (Stage::Open, Some(scene)) = (self.stage, self.scene) else {
            return;
        };
        let focus = self.focus.unwrap_or_else(|| Focus {
            proxy: scene.home.column(),
            hip: scene.home.column(),
            ..Focus::default()
        });
        let now = self.desk.milliseconds(self.ends.vitals.ticks());
        if self.content == Some(now) {
            return;
        }
        while self.outbox.has_room() && self.has_buffer_for_another() {
            let Some(key) = self.puller.next_request(now, &focus) else {
                self.content = Some(now);
                return;
            };
            let epoch = scene.epoch;
            self.say(&ToHost::Need { epoch, key });
        }
    }

    /// With all under way that may be, the puller only asks again.
    fn has_buffer_for_another(&self) -> bool {
        let in_flight = self.puller.in_flight();
        self.spare.len() > in_flight || in_flight == IN_FLIGHT
    }

    /// Packs the next telemetry message, once the last one has left.
    fn pack(&mut self) {
        let enough = self.backlog.len() >= BATCH || self.stage == Stage::Ended;
        if !enough || self.backlog.is_empty() || !self.outbox.wants_telemetry() {
            return;
        }
        let mut samples = Vec::new();
        while !samples.is_full() {
            let Some(record) = self.backlog.pop_front() else {
                break;
            };
            let _ = samples.push(record.sample);
        }
        let first = self.packed;
        self.packed = self.packed.wrapping_add(samples.len() as u32);
        let lost_by_loop = self.ends.vitals.dropped();
        self.outbox.push_telemetry(Telemetry {
            first,
            dropped: self.dropped.wrapping_add(lost_by_loop),
            samples,
        });
    }

    pub(crate) fn transmit(&mut self, into: &mut [u8]) -> usize {
        let mut n = 0;
        while let Some(rest) = into.get_mut(n..).filter(|rest| !rest.is_empty()) {
            n += match self.outbox.take(rest) {
                0 => {
                    self.pack();
                    if self.outbox.is_empty() {
                        break;
                    }
                    0
                }
                taken => taken,
            };
        }
        n
    }
}
