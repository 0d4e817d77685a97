//! Polling of the link: it reads the loop's records, sends commands to the loop, and fills the
//! queue to the host.

use hapterra_core::guard::Mode;
use hapterra_core::tick::Command;
use hapterra_core::wire::message::{BATCH, Telemetry, ToHost};
use heapless::Vec;

use super::{Link, log, tiles};
use crate::monitor::WatchedPart;
use crate::queues::LoopReport;

impl<const D: usize> Link<'_, D> {
    /// Does all pending work: reads the loop's records, requests tiles, sends the next point to the
    /// loop, packs telemetry.
    pub fn poll(&mut self) {
        self.ends.monitor.check_in(WatchedPart::Link);
        self.reclaim_buffers();
        self.read_records();
        self.report_state();
        self.check_host_timeout();
        self.release_abandoned_clutch();
        self.start_next_point();
        self.request_tiles();
        self.pack_telemetry();
        self.send_goodbye();
    }

    /// Reads the loop's records since the last poll.
    pub(super) fn read_records(&mut self) {
        let is_taken = self.ends.commands.is_empty();
        while self.tx.has_room() {
            let Some(record) = self.ends.records.dequeue() else {
                return self.set_cancel_taken(is_taken);
            };
            self.nothing_to_request_at = None;
            let ticks_per_ms = self.device.ticks_per_ms();
            // Samples of the previous placement do not apply to the new one.
            if record.sample.view == self.view {
                self.request_hint = Some(tiles::request_hint(
                    &self.last_record,
                    &record,
                    ticks_per_ms,
                ));
            }
            self.last_record = record;
            self.decide_cancel();
            if record.answered_seq.is_some() {
                self.replay.current = None;
                self.replay.last = Some(record);
                self.answer_point(record);
            } else if self.is_arm_scene()
                && self.session.is_open()
                && self.samples.push_back(record.sample).is_err()
            {
                self.dropped = self.dropped.wrapping_add(1);
            }
        }
    }

    /// Reports the guard's state and the outcomes of requests.
    pub(super) fn report_state(&mut self) {
        // Later reports are after every command, if the loop had taken all commands before the
        // reports up to now were read.
        let follows = self.commands_drained;
        self.commands_drained = self.ends.commands.is_empty();
        while let Some(report) = self.ends.health.dequeue() {
            let LoopReport {
                health,
                epoch,
                marked,
            } = report;
            self.device.request.marked(marked);
            self.device.on_health(health, self.ends.monitor.ticks());
            self.device.may_drive &= !(follows && health.report.mode == Mode::Disarmed);
            let is_refused = self.scene.is_some_and(|scene| Some(scene.epoch) != epoch)
                && !self.is_cancelled_scene(epoch);
            // A scene that the link accepted and the loop refused is dropped.
            if follows
                && is_refused
                && let Some(room) = self.room_for_command()
            {
                self.drop_scene(room);
            }
        }
        while self.session.is_open() && self.tx.has_room() {
            let Some(message) = self.device.next_message() else {
                return;
            };
            self.send(&message);
        }
    }

    /// Sends the close when nothing is driven and everything else was sent.
    fn send_goodbye(&mut self) {
        let is_closing = self.session.is_closing();
        let is_flushed = self.samples.is_empty() && self.tx.is_telemetry_sent();
        if is_closing && is_flushed && !self.device.may_drive && self.tx.has_room() {
            self.send(&ToHost::Goodbye(self.sample_count()));
            self.session.answer_close();
            log::ended();
        }
    }

    /// Sends the next point to the loop, which stores only one.
    fn start_next_point(&mut self) {
        if self.replay.current.is_none()
            && let Some(room) = self.room_for_command()
            && let Some(point) = self.points.pop_front()
        {
            self.replay.current = Some(point.seq);
            self.command(room, Command::Hip(point));
        }
    }

    /// Packs the next telemetry message when the last one was sent.
    fn pack_telemetry(&mut self) {
        let is_closing = self.session.is_closing();
        let is_batch_due = self.samples.len() >= BATCH || is_closing;
        if !is_batch_due || self.samples.is_empty() || !self.tx.is_telemetry_sent() {
            return;
        }
        let mut samples = Vec::new();
        while !samples.is_full() {
            let Some(sample) = self.samples.pop_front() else {
                break;
            };
            let _ = samples.push(sample);
        }
        let first = self.session.packed;
        self.batch = samples.len() as u32;
        self.session.packed = first.wrapping_add(self.batch);
        let message = ToHost::Telemetry(Telemetry {
            first,
            dropped: self.sample_count().dropped,
            samples,
        });
        self.tx.push_telemetry(self.session.number(), &message);
    }

    /// Moves the next bytes to send into `into` and returns their number. They count as sent.
    pub fn transmit(&mut self, into: &mut [u8]) -> usize {
        let mut n = 0;
        while let Some(rest) = into.get_mut(n..).filter(|rest| !rest.is_empty()) {
            let copied = self.tx.take(rest);
            n += copied;
            if copied == 0 {
                self.pack_telemetry();
                self.send_goodbye();
                if self.tx.is_empty() {
                    break;
                }
            }
        }
        n
    }
}
