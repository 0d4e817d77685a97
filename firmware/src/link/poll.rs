//! What the link does when it is polled: it reads what the loop did, hands on what
//! the loop needs, and fills the queue to the host.

use hapterra_core::tick::Command;
use hapterra_core::wire::message::{BATCH, Telemetry};
use heapless::Vec;

use super::{Link, SessionState, tiles};
use crate::monitor::Part;

impl<const D: usize> Link<'_, D> {
    /// Does what is due: reads what the loop left, requests tiles, hands on the
    /// next point, packs telemetry.
    pub fn poll(&mut self) {
        self.ends.monitor.check_in(Part::Link);
        self.reclaim_buffers();
        self.read_records();
        self.report_state();
        self.start_next_point();
        self.request_tiles();
        self.pack_telemetry();
    }

    /// Reads what the loop recorded since the last poll.
    fn read_records(&mut self) {
        while self.tx.has_room() {
            let Some(record) = self.ends.records.dequeue() else {
                return;
            };
            self.nothing_to_request_at = None;
            let ticks_per_ms = self.device.ticks_per_ms();
            self.focus = Some(tiles::focus(&self.last_record, &record, ticks_per_ms));
            self.last_record = record;
            if record.answers.is_some() {
                self.replay.under_way = None;
                self.replay.last = Some(record);
                self.answer_point(record);
            } else if self.renders_arm()
                && self.session == SessionState::Open
                && self.samples.push_back(record.sample).is_err()
            {
                self.dropped = self.dropped.wrapping_add(1);
            }
        }
    }

    /// Reports where the guard stands and what became of requests.
    fn report_state(&mut self) {
        while let Some(health) = self.ends.health.dequeue() {
            self.device.health = health;
        }
        while self.session == SessionState::Open && self.tx.has_room() {
            let Some(message) = self.device.next_message() else {
                return;
            };
            self.say(&message);
        }
    }

    /// Hands the next point to the loop, which would forget a second one.
    fn start_next_point(&mut self) {
        if self.replay.under_way.is_some() || !self.ends.commands.ready() {
            return;
        }
        if let Some(point) = self.points.pop_front() {
            self.replay.under_way = Some(point.seq);
            self.command(Command::Point(point));
        }
    }

    /// Packs the next telemetry message, once the last one has left.
    fn pack_telemetry(&mut self) {
        let enough = self.samples.len() >= BATCH || self.session == SessionState::Ended;
        if !enough || self.samples.is_empty() || !self.tx.wants_telemetry() {
            return;
        }
        let mut samples = Vec::new();
        while !samples.is_full() {
            let Some(sample) = self.samples.pop_front() else {
                break;
            };
            let _ = samples.push(sample);
        }
        let first = self.packed;
        self.packed = self.packed.wrapping_add(samples.len() as u32);
        self.tx.push_telemetry(Telemetry {
            first,
            dropped: self.samples_dropped(),
            samples,
        });
    }

    /// Moves bytes that are sent next into `into` and returns how many. They count
    /// as sent.
    pub fn transmit(&mut self, into: &mut [u8]) -> usize {
        let mut n = 0;
        while let Some(rest) = into.get_mut(n..).filter(|rest| !rest.is_empty()) {
            let taken = self.tx.take(rest);
            n += taken;
            if taken == 0 {
                self.pack_telemetry();
                if self.tx.is_empty() {
                    break;
                }
            }
        }
        n
    }
}
