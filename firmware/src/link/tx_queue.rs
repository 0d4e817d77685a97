//! Frames that wait to be sent: answers and requests first, telemetry after.

use hapterra_core::wire::frame::encode;
use hapterra_core::wire::message::ToHost;
use hapterra_core::wire::session::{InSession, SessionNumber};
use hapterra_core::wire::version::VersionCheck;

/// Bytes kept for answers and requests.
const URGENT: usize = 1152;
/// Maximum length of an urgent frame: `Status` with every number at its maximum.
pub(super) const MAX_URGENT: usize = 448;
/// Maximum length of a telemetry frame: eight samples, every number at its maximum.
const MAX_TELEMETRY: usize = 1280;

/// Bytes of whole frames that wait to be sent.
struct Frames<const N: usize> {
    bytes: [u8; N],
    sent: usize,
    end: usize,
}

impl<const N: usize> Frames<N> {
    const fn new() -> Self {
        Self {
            bytes: [0; N],
            sent: 0,
            end: 0,
        }
    }

    const fn is_empty(&self) -> bool {
        self.sent == self.end
    }

    const fn room(&self) -> usize {
        N - (self.end - self.sent)
    }

    /// Appends a frame that `write` writes; `write` returns its length. Returns false if it does
    /// not fit.
    fn push(&mut self, write: impl FnOnce(&mut [u8]) -> Option<usize>) -> bool {
        self.bytes.copy_within(self.sent..self.end, 0);
        (self.sent, self.end) = (0, self.end - self.sent);
        let free = self.bytes.get_mut(self.end..).unwrap_or(&mut []);
        let Some(length) = write(free) else {
            return false;
        };
        self.end += length;
        true
    }

    fn take(&mut self, into: &mut [u8]) -> usize {
        let waiting = self.bytes.get(self.sent..self.end).unwrap_or(&[]);
        let n = waiting.len().min(into.len());
        for (to, from) in into.iter_mut().zip(waiting) {
            *to = *from;
        }
        self.sent += n;
        n
    }
}

fn in_session(session: SessionNumber, message: &ToHost, free: &mut [u8]) -> Option<usize> {
    encode(&InSession { session, message }, free).map(<[u8]>::len)
}

/// Frames that wait for the writer, in two classes whose bytes never mix.
pub(super) struct TxQueue {
    urgent: Frames<URGENT>,
    telemetry: Frames<MAX_TELEMETRY>,
    /// True if a zero is sent first, which ends a frame that was cut off before.
    starts_clean: bool,
}

impl TxQueue {
    pub(super) const fn new() -> Self {
        Self {
            urgent: Frames::new(),
            telemetry: Frames::new(),
            starts_clean: false,
        }
    }

    /// Drops everything, for a new session.
    pub(super) fn clear(&mut self) {
        *self = Self::new();
        self.starts_clean = true;
    }

    pub(super) fn is_empty(&self) -> bool {
        self.urgent.is_empty() && self.telemetry.is_empty() && !self.starts_clean
    }

    /// Returns true if any answer or request is sure to fit.
    pub(super) fn has_room(&self) -> bool {
        self.urgent.room() >= MAX_URGENT
    }

    /// Returns true if the writer has sent all telemetry.
    pub(super) fn is_telemetry_sent(&self) -> bool {
        self.telemetry.is_empty()
    }

    /// Queues an answer or a request. Returns false if there is no room.
    pub(super) fn push(&mut self, session: SessionNumber, message: &ToHost) -> bool {
        self.urgent.push(|free| in_session(session, message, free))
    }

    /// Queues a refusal, which belongs to no session.
    pub(super) fn push_refusal(&mut self, refusal: &VersionCheck) -> bool {
        self.urgent
            .push(|free| encode(refusal, free).map(<[u8]>::len))
    }

    /// Queues a telemetry message; there is room for one.
    pub(super) fn push_telemetry(&mut self, session: SessionNumber, message: &ToHost) -> bool {
        self.telemetry.is_empty()
            && self
                .telemetry
                .push(|free| in_session(session, message, free))
    }

    /// Returns true if telemetry waits that an urgent frame would overtake.
    pub(super) fn is_telemetry_pending(&self) -> bool {
        !self.telemetry.is_empty() && self.telemetry.sent == 0
    }

    /// Moves the next bytes to send into `into` and returns their number.
    pub(super) fn take(&mut self, into: &mut [u8]) -> usize {
        if self.starts_clean {
            let Some(first) = into.first_mut() else {
                return 0;
            };
            *first = 0;
            self.starts_clean = false;
            return 1;
        }
        // A frame that has begun is finished first. The telemetry queue has at most one, and the
        // urgent frames are always sent completely.
        if self.telemetry.sent > 0 && !self.telemetry.is_empty() {
            return self.telemetry.take(into);
        }
        if self.urgent.is_empty() {
            self.telemetry.take(into)
        } else {
            self.urgent.take(into)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hapterra_core::wire::frame::{FrameReader, decode};
    use hapterra_core::wire::message::Telemetry;
    use std::vec::Vec;

    const SESSION: SessionNumber = SessionNumber::new(1);

    fn scene_ack(epoch: u32) -> ToHost {
        ToHost::SceneAck {
            epoch,
            accepted: true,
        }
    }

    /// Takes `n` bytes, or fewer if there are no more.
    fn take(queue: &mut TxQueue, n: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        while bytes.len() < n {
            let mut byte = [0];
            if queue.take(&mut byte) == 0 {
                break;
            }
            bytes.extend(byte);
        }
        bytes
    }

    fn understood(mut bytes: &[u8]) -> Vec<ToHost> {
        let mut reader = FrameReader::<2048>::new();
        let mut messages = Vec::new();
        while !bytes.is_empty() {
            let (consumed, frame) = reader.push(bytes);
            let content = frame.and_then(|frame| frame.and_then(decode).ok());
            messages.extend(content.map(|framed: InSession<ToHost>| framed.message));
            bytes = &bytes[consumed..];
        }
        messages
    }

    #[test]
    fn request_precedes_telemetry_but_never_splits_a_frame() {
        let telemetry = || ToHost::Telemetry(Telemetry::default());
        let mut queue = TxQueue::new();
        queue.push_telemetry(SESSION, &telemetry());
        queue.push(SESSION, &scene_ack(1));
        let all = take(&mut queue, 4096);
        assert_eq!(understood(&all), [scene_ack(1), telemetry()]);

        queue.push_telemetry(SESSION, &telemetry());
        let mut all = take(&mut queue, 2);
        queue.push(SESSION, &scene_ack(1));
        all.extend(take(&mut queue, 4096));
        assert_eq!(understood(&all), [telemetry(), scene_ack(1)]);
    }

    #[test]
    fn truncated_frame_does_not_corrupt_the_next_frame() {
        let mut queue = TxQueue::new();
        queue.push(SESSION, &scene_ack(1));
        let mut all = take(&mut queue, 3);
        queue.clear();
        queue.push(SESSION, &scene_ack(2));
        all.extend(take(&mut queue, 4096));
        assert_eq!(understood(&all), [scene_ack(2)]);
    }

    #[test]
    fn full_queue_has_room_after_bytes_are_removed() {
        let mut queue = TxQueue::new();
        let mut pushed = 0;
        while queue.has_room() {
            assert!(queue.push(SESSION, &scene_ack(pushed)));
            pushed += 1;
        }
        assert!(pushed > 20);
        let first = take(&mut queue, MAX_URGENT);
        assert!(queue.has_room());
        let rest = take(&mut queue, 4096);
        let all: Vec<_> = (0..pushed).map(scene_ack).collect();
        assert_eq!(understood(&[first, rest].concat()), all);
    }
}
