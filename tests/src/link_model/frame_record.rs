//! Record of both sides' frames before any fault: the device's `Hello` messages, the samples of
//! each session, and whether a host has requested arming.

use std::collections::{HashMap, HashSet};

use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode};
use hapterra_core::wire::hello::DeviceHello;
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::request::Request;
use hapterra_core::wire::session::{InSession, SampleCount};

/// The samples of every session, as the device sent them.
#[derive(Default)]
pub(super) struct FrameRecord {
    reader: Box<FrameReader<MAX_FRAME>>,
    sessions: HashMap<u32, SampleCount>,
    /// The ticks of the samples that were sent in each session.
    ticks: HashMap<u32, HashSet<u32>>,
    /// Each `Hello` message of the device, and its session.
    greetings: Vec<(u32, DeviceHello)>,
}

/// Returns true if any of these frames requests arming.
pub(super) fn requests_arming(mut bytes: &[u8]) -> bool {
    let mut reader = Box::new(FrameReader::<MAX_FRAME>::new());
    while !bytes.is_empty() {
        let (consumed, frame) = reader.push(bytes);
        bytes = bytes.get(consumed..).unwrap_or(&[]);
        let Some(Ok(content)) = frame else {
            continue;
        };
        let framed = decode::<InSession<ToDevice<'_>>>(content);
        let message = framed.map(|framed| framed.message);
        let arm = Request::Arm;
        if matches!(message, Ok(ToDevice::Request { request, .. }) if request == arm) {
            return true;
        }
    }
    false
}

impl FrameRecord {
    /// Records the device's bytes.
    pub(super) fn receive(&mut self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let (consumed, frame) = self.reader.push(bytes);
            bytes = bytes.get(consumed..).unwrap_or(&[]);
            if let Some(Ok(framed)) = frame.map(|f| f.and_then(decode::<InSession<ToHost>>)) {
                self.take(framed.session.get(), framed.message);
            }
        }
    }

    fn take(&mut self, session: u32, message: ToHost) {
        match message {
            ToHost::Telemetry(telemetry) => {
                let sent = telemetry.first + telemetry.samples.len() as u32;
                let dropped = telemetry.dropped;
                self.raise(session, SampleCount { sent, dropped });
                let ticks = telemetry.samples.iter().map(|sample| sample.tick);
                self.ticks.entry(session).or_default().extend(ticks);
            }
            ToHost::Heartbeat { count, .. } | ToHost::Goodbye(count) => self.raise(session, count),
            ToHost::Hello(device) => {
                self.raise(device.last.session, device.last.count);
                self.greetings.push((session, device));
            }
            _ => {}
        }
    }

    /// Returns the `Hello` messages of a session up to now.
    pub(super) fn greetings(&self, session: u32) -> impl Iterator<Item = &DeviceHello> {
        let of_it = self.greetings.iter().filter(move |(of, _)| *of == session);
        of_it.map(|(_, device)| device)
    }

    /// Returns true if the sample of this tick was sent in this session.
    pub(super) fn has_sent(&self, session: u32, tick: u32) -> bool {
        let ticks = self.ticks.get(&session);
        ticks.is_some_and(|ticks| ticks.contains(&tick))
    }

    fn raise(&mut self, session: u32, count: SampleCount) {
        let total = self.sessions.entry(session).or_default();
        total.sent = total.sent.max(count.sent);
        total.dropped = total.dropped.max(count.dropped);
    }

    /// Returns the sums over sessions: sent, and dropped.
    pub(super) fn of(&self, sessions: &[u32]) -> (u64, u64) {
        let counts = sessions
            .iter()
            .filter_map(|number| self.sessions.get(number));
        counts.fold((0, 0), |(sent, dropped), count| {
            (
                sent + u64::from(count.sent),
                dropped + u64::from(count.dropped),
            )
        })
    }
}
