//! A line to a device that carries so many bytes in a millisecond of the device's own time.

use std::collections::VecDeque;
use std::io;
use std::time::Duration;

use hapterra::link::Transport;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode};
use hapterra_core::wire::message::ToHost;
use hapterra_core::wire::session::InSession;

/// A slow line around another. What the host says waits until the device's samples tell that
/// enough of its time has passed; before the first sample all goes through.
pub struct SlowLine<T> {
    inner: T,
    bytes_a_ms: u64,
    reader: Box<FrameReader<MAX_FRAME>>,
    waiting: VecDeque<u8>,
    /// Samples told so far, one a millisecond.
    samples: u64,
    /// What was carried since the first of them, bytes.
    carried: u64,
}

impl<T> SlowLine<T> {
    /// A line that carries so many bytes a millisecond to the device.
    pub fn new(inner: T, bytes_a_ms: u64) -> Self {
        Self {
            inner,
            bytes_a_ms,
            reader: Box::default(),
            waiting: VecDeque::new(),
            samples: 0,
            carried: 0,
        }
    }

    fn listen(&mut self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let (taken, frame) = self.reader.push(bytes);
            let content = frame.and_then(Result::ok);
            let message = content.and_then(|content| decode::<InSession<ToHost>>(content).ok());
            match message.map(|said| said.message) {
                Some(ToHost::Telemetry(telemetry)) => {
                    let told = telemetry.first as usize + telemetry.samples.len();
                    self.samples = self.samples.max(told as u64);
                }
                // No sample follows: what is still to be said is not held back.
                Some(ToHost::Goodbye(_)) => self.bytes_a_ms = u64::MAX,
                _ => {}
            }
            bytes = &bytes[taken..];
        }
    }

    /// Bytes that may go now.
    fn due(&self) -> usize {
        match self.samples {
            0 => self.waiting.len(),
            samples => {
                let all = samples.saturating_mul(self.bytes_a_ms);
                (all.saturating_sub(self.carried) as usize).min(self.waiting.len())
            }
        }
    }
}

impl<T: Transport> SlowLine<T> {
    fn carry(&mut self) -> io::Result<()> {
        let due = self.due();
        if due == 0 {
            // What was not used is not kept for later.
            let all = self.samples.saturating_mul(self.bytes_a_ms);
            if self.waiting.is_empty() {
                self.carried = self.carried.max(all);
            }
            return Ok(());
        }
        let bytes: Vec<u8> = self.waiting.drain(..due).collect();
        if self.samples > 0 {
            self.carried += bytes.len() as u64;
        }
        self.inner.send(&bytes)
    }
}

impl<T: Transport> Transport for SlowLine<T> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.waiting.extend(bytes);
        self.carry()
    }

    fn receive(&mut self, into: &mut [u8], wait: Duration) -> io::Result<usize> {
        self.carry()?;
        let count = self.inner.receive(into, wait)?;
        self.listen(&into[..count]);
        Ok(count)
    }
}
