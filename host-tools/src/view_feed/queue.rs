//! A queue to the viewer's pipe that never blocks the sender.

use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use hapterra_view_stream::{Message, write};

/// Time between two checks that everything is written.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// Pending messages to a viewer, in order.
pub(super) struct Queue {
    messages: Option<Sender<(Message, usize)>>,
    /// Approximate number of pending bytes.
    waiting: Arc<AtomicUsize>,
    /// True if the viewer has stopped reading.
    is_gone: Arc<AtomicBool>,
    limit: usize,
    writer: Option<JoinHandle<()>>,
}

impl Queue {
    /// Writes `first`, whatever its size, and then the offered messages.
    pub(super) fn start(
        to: impl Write + Send + 'static,
        first: Vec<Message>,
        limit: usize,
    ) -> Self {
        let (messages, waiting_messages) = channel();
        let (waiting, is_gone) = <(Arc<AtomicUsize>, Arc<AtomicBool>)>::default();
        let write = Writer {
            waiting: Arc::clone(&waiting),
            is_gone: Arc::clone(&is_gone),
        };
        let writer = std::thread::Builder::new()
            .name("to the viewer".into())
            .spawn(move || write.run(to, first, &waiting_messages))
            .ok();
        // Without a thread all messages are dropped, and counted.
        is_gone.fetch_or(writer.is_none(), Ordering::AcqRel);
        Self {
            messages: Some(messages),
            waiting,
            is_gone,
            limit,
            writer,
        }
    }

    /// Returns true if the queue accepts a message, false if it is full.
    pub(super) fn offer(&self, message: Message) -> bool {
        self.offer_or_return(message).is_ok()
    }

    /// As [`Self::offer`], but returns a rejected message, because it was expensive to make.
    pub(super) fn offer_or_return(&self, message: Message) -> Result<(), Message> {
        let size = size_of(&message);
        let waiting = self.waiting.load(Ordering::Acquire);
        let has_room = waiting == 0 || waiting.saturating_add(size) <= self.limit;
        if self.is_gone.load(Ordering::Acquire) || !has_room {
            return Err(message);
        }
        let Some(messages) = &self.messages else {
            return Err(message);
        };
        self.waiting.fetch_add(size, Ordering::AcqRel);
        let sent = messages.send((message, size));
        sent.map_err(|unsent| unsent.0.0)
    }

    /// Waits for at most `wait` until there is room: only for a recording, which nothing else waits
    /// for. Returns false if the viewer has ended.
    pub(super) fn wait_for_room(&self, wait: Duration) -> bool {
        let until = Instant::now() + wait;
        let is_full = || self.waiting.load(Ordering::Acquire) > self.limit / 2;
        while is_full() && !self.is_gone.load(Ordering::Acquire) && Instant::now() < until {
            std::thread::sleep(POLL_INTERVAL);
        }
        !self.is_gone.load(Ordering::Acquire)
    }

    /// Ends the stream; pending messages are written if the viewer reads them within `wait`.
    pub(super) fn end(mut self, wait: Duration) {
        if let Some(messages) = self.messages.take() {
            let _ = messages.send((Message::End, 0));
        }
        let until = Instant::now() + wait;
        let is_writing = |writer: &JoinHandle<()>| !writer.is_finished();
        while self.writer.as_ref().is_some_and(is_writing) && Instant::now() < until {
            std::thread::sleep(POLL_INTERVAL);
        }
        // A thread that still writes ends with this program.
    }
}

struct Writer {
    waiting: Arc<AtomicUsize>,
    is_gone: Arc<AtomicBool>,
}

impl Writer {
    fn run(&self, mut to: impl Write, first: Vec<Message>, messages: &Receiver<(Message, usize)>) {
        let first = first.into_iter().map(|message| (message, 0));
        for (message, size) in first.chain(messages.iter()) {
            let written = write(&mut to, &message).and_then(|_| Ok(to.flush()?));
            self.waiting.fetch_sub(size, Ordering::AcqRel);
            if let Err(why) = written {
                tracing::info!("the viewer does not read any more: {why}");
                self.is_gone.store(true, Ordering::Release);
                return;
            }
        }
        // The open pipe shows the viewer that this program still runs.
        std::mem::forget(to);
    }
}

/// Returns the approximate size of a message in bytes.
fn size_of(message: &Message) -> usize {
    64 + match message {
        Message::Samples(samples) => size_of_val(samples.as_slice()),
        Message::Tile(tile) => size_of_val(tile.heights_mm.as_slice()),
        Message::Layer(layer) => size_of_val(layer.heights.as_slice()),
        Message::Tiles(tiles) => 8 * (tiles.held.len() + tiles.awaited.len()),
        _ => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timeouts::{self, HANG, wait_until};
    use crate::view_feed::pipe::Pipe;
    use hapterra_view_stream::{Hello, Tiles, read};
    use std::io::Read;
    use std::sync::mpsc::sync_channel;

    fn tiles(count: usize) -> Message {
        Message::Tiles(Tiles {
            held: vec![[1, 2]; count],
            awaited: vec![],
        })
    }

    fn hello() -> Message {
        Message::Hello(Hello {
            version: 1,
            program: String::new(),
        })
    }

    #[test]
    fn reader_receives_everything_in_order() {
        let (pipe, out) = sync_channel(1);
        let queue = Queue::start(Pipe(pipe), vec![hello()], 1 << 20);
        let mut end = Vec::new();
        write(&mut end, &Message::End).expect("memory");
        // The pipe stays open after it.
        let reader = std::thread::spawn(move || {
            let mut bytes = Vec::new();
            while !bytes.ends_with(&end) {
                bytes.extend(timeouts::next(&out).expect("more"));
            }
            bytes
        });
        for count in 0..100 {
            assert!(queue.offer(tiles(count)));
        }
        queue.end(HANG);
        let bytes = reader.join().expect("it reads");
        let mut rest: &mut dyn Read = &mut bytes.as_slice();
        let mut next = || read(&mut rest).expect("whole");
        assert_eq!(next(), Some(hello()));
        for count in 0..100 {
            assert_eq!(next(), Some(tiles(count)));
        }
        assert_eq!(next(), Some(Message::End));
    }

    #[test]
    fn stalled_reader_never_blocks_the_sender() {
        let (pipe, out) = sync_channel(0);
        let queue = Queue::start(Pipe(pipe), vec![hello()], 10_000);
        let accepted = (0..1000).filter(|_| queue.offer(tiles(100))).count();
        assert!((1..=12).contains(&accepted), "{accepted}");
        queue.end(Duration::from_millis(50));
        drop(out);
    }

    #[test]
    fn queue_without_reader_accepts_nothing_and_never_blocks() {
        let (pipe, out) = sync_channel(0);
        drop(out);
        let queue = Queue::start(Pipe(pipe), vec![hello()], 10_000);
        // Its thread has not detected that yet.
        wait_until("nothing is taken", || !queue.offer(tiles(0)));
        assert_eq!(queue.offer_or_return(tiles(1)), Err(tiles(1)));
        // A year: a test that waits for room would hang.
        assert!(!queue.wait_for_room(Duration::from_secs(31_536_000)));
        queue.end(HANG);
    }
}
