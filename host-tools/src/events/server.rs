//! Readers of events on a local socket.

use std::io::{self, ErrorKind, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::event::{Event, FORMAT, Line};

/// Maximum lines in the queue to the thread.
const MAX_QUEUED_LINES: usize = 4096;
/// Maximum bytes buffered for a reader, in addition to the system's buffer.
const MAX_READER_BYTES: usize = 256 << 10;
/// Maximum number of readers; further connections are closed.
const MAX_READERS: usize = 16;
/// Interval of checks for new readers and of retries to slow ones.
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// Time for readers to receive the last lines.
const END_TIMEOUT: Duration = Duration::from_secs(1);

/// State that the senders and the thread share.
#[derive(Debug, Default)]
struct Shared {
    readers: AtomicUsize,
    /// Number of readers that have connected.
    joined: AtomicU64,
    /// Lines lost because the queue was full.
    dropped: AtomicU64,
}

/// Queues lines without waiting.
#[derive(Clone, Debug)]
pub struct Sender {
    lines: SyncSender<String>,
    shared: Arc<Shared>,
}

impl Sender {
    /// Returns the number of readers that have ever connected; `None` if none is connected now.
    pub(super) fn readers_joined(&self) -> Option<u64> {
        let has_readers = self.shared.readers.load(Ordering::Acquire) > 0;
        has_readers.then(|| self.shared.joined.load(Ordering::Acquire))
    }

    /// Queues a line; it is dropped and counted if the queue is full.
    pub(super) fn offer(&self, line: String) {
        if self.lines.try_send(line).is_err() {
            self.shared.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// The socket and the thread that writes to its readers.
#[derive(Debug)]
pub struct Server {
    sender: Sender,
    address: SocketAddr,
    /// Returns the number of lines lost to slow readers.
    thread: JoinHandle<u64>,
}

impl Server {
    /// Listens on a port of 127.0.0.1, for this machine only; port 0 selects a free one.
    ///
    /// # Errors
    /// The port is in use.
    pub fn listen(port: u16) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let (lines, waiting) = sync_channel(MAX_QUEUED_LINES);
        let shared = Arc::<Shared>::default();
        let readers = Readers {
            listener,
            readers: vec![],
            shared: Arc::clone(&shared),
            dropped: 0,
        };
        let thread = std::thread::Builder::new()
            .name("events".into())
            .spawn(move || readers.run(&waiting))?;
        Ok(Self {
            sender: Sender { lines, shared },
            address,
            thread,
        })
    }

    /// Returns the server's address.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns another sender of lines.
    #[must_use]
    pub fn sender(&self) -> Sender {
        self.sender.clone()
    }

    /// Ends the server when all other senders are dropped. Readers have one second to receive the
    /// remaining lines. Returns the number of dropped lines.
    #[must_use]
    pub fn end(self) -> u64 {
        let Sender { lines, shared } = self.sender;
        drop(lines);
        let of_readers = self.thread.join().unwrap_or_default();
        of_readers + shared.dropped.load(Ordering::Acquire)
    }
}

/// A reader and its unsent lines.
struct Reader {
    stream: TcpStream,
    unsent: Vec<u8>,
    dropped: u64,
}

impl Reader {
    /// Adds a line if there is room, after the number of lines dropped before it.
    fn push_line(&mut self, line: &[u8]) {
        let notice = match self.dropped {
            0 => String::new(),
            lines => reader_line(&Event::Dropped { lines }),
        };
        if self.unsent.len() + notice.len() + line.len() > MAX_READER_BYTES {
            self.dropped += 1;
            return;
        }
        self.dropped = 0;
        self.unsent.extend(notice.bytes());
        self.unsent.extend(line);
    }

    /// Writes as much as the reader accepts now. Returns false if it is disconnected.
    fn write(&mut self) -> bool {
        while !self.unsent.is_empty() {
            match self.stream.write(&self.unsent) {
                Ok(0) => return false,
                Ok(written) => drop(self.unsent.drain(..written)),
                Err(why) if why.kind() == ErrorKind::WouldBlock => return true,
                Err(why) if why.kind() == ErrorKind::Interrupted => {}
                Err(_) => return false,
            }
        }
        true
    }
}

/// Returns a line that belongs to no device.
fn reader_line(event: &Event<'_>) -> String {
    Line { event, at: None }.text()
}

/// State of the server's thread.
struct Readers {
    listener: TcpListener,
    readers: Vec<Reader>,
    shared: Arc<Shared>,
    /// Number of lines lost to slow readers.
    dropped: u64,
}

impl Readers {
    fn run(mut self, lines: &Receiver<String>) -> u64 {
        loop {
            self.accept();
            match lines.recv_timeout(POLL_INTERVAL) {
                Ok(line) => self.push_line(&line),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            for line in lines.try_iter().take(MAX_QUEUED_LINES) {
                self.push_line(&line);
            }
            self.write();
        }
        let until = Instant::now() + END_TIMEOUT;
        while self.readers.iter().any(|reader| !reader.unsent.is_empty()) && Instant::now() < until
        {
            std::thread::sleep(POLL_INTERVAL);
            self.write();
        }
        self.dropped
    }

    fn push_line(&mut self, line: &str) {
        for reader in &mut self.readers {
            let before = reader.dropped;
            reader.push_line(line.as_bytes());
            self.dropped += u64::from(reader.dropped > before);
        }
    }

    fn write(&mut self) {
        self.readers.retain_mut(Reader::write);
        let count = self.readers.len();
        self.shared.readers.store(count, Ordering::Release);
    }

    /// Accepts new readers. An error affects only its own reader.
    fn accept(&mut self) {
        while let Ok((stream, _)) = self.listener.accept() {
            if self.readers.len() >= MAX_READERS || stream.set_nonblocking(true).is_err() {
                continue;
            }
            let _ = stream.set_nodelay(true);
            let hello = Event::Hello {
                format: FORMAT,
                program: env!("CARGO_PKG_VERSION"),
            };
            self.readers.push(Reader {
                stream,
                unsent: reader_line(&hello).into_bytes(),
                dropped: 0,
            });
            self.write();
            self.shared.joined.fetch_add(1, Ordering::AcqRel);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timeouts::wait_until;
    use std::io::{BufRead, BufReader};

    fn connected(server: &Server) -> TcpStream {
        let before = server.sender.shared.joined.load(Ordering::Acquire);
        let stream = TcpStream::connect(server.address()).expect("connected");
        wait_until("the reader is seen", || {
            server.sender.shared.joined.load(Ordering::Acquire) > before
        });
        stream
    }

    fn number(line: &str) -> Option<u64> {
        line.strip_prefix("{\"n\":")?
            .trim_end()
            .strip_suffix('}')?
            .parse()
            .ok()
    }

    #[test]
    fn readers_receive_every_line_in_order_until_the_end() {
        let server = Server::listen(0).expect("listens");
        assert!(server.address().ip().is_loopback());
        assert_eq!(server.sender().readers_joined(), None);
        let streams = [connected(&server), connected(&server)];
        let sender = server.sender();
        assert_eq!(sender.readers_joined(), Some(2));
        for n in 0..1000 {
            sender.offer(format!("{{\"n\":{n}}}\n"));
        }
        drop(sender);
        assert_eq!(server.end(), 0);
        for stream in streams {
            let lines: Vec<_> = BufReader::new(stream).lines().map(Result::unwrap).collect();
            assert!(lines[0].starts_with("{\"event\":\"hello\",\"format\":1"));
            let numbers: Vec<_> = lines[1..].iter().filter_map(|line| number(line)).collect();
            assert_eq!(numbers, Vec::from_iter(0..1000));
        }
    }

    /// Reads a reader's lines in a thread.
    fn read(stream: TcpStream, mut take: impl FnMut(&str) + Send + 'static) {
        std::thread::spawn(move || {
            let lines = BufReader::new(stream).lines();
            lines.map_while(Result::ok).for_each(|line| take(&line));
        });
    }

    /// Safety: 30.
    #[test]
    fn stuck_reader_delays_no_other_reader_and_gets_drop_count() {
        let server = Server::listen(0).expect("listens");
        let (stuck, quick) = (connected(&server), connected(&server));
        let sender = server.sender();
        let latest = Arc::new(AtomicU64::new(0));
        let seen_by_thread = Arc::clone(&latest);
        read(quick, move |line| {
            assert!(!line.contains("dropped"), "{line}");
            seen_by_thread.fetch_max(number(line).unwrap_or(0), Ordering::AcqRel);
        });
        // More than the buffers of system and reader can store.
        let spaces = " ".repeat(1000);
        for n in 1..=20_000 {
            sender.offer(format!("{{\"n\":{n}}}{spaces}\n"));
            if n % 100 == 0 {
                wait_until("the other reader", || latest.load(Ordering::Acquire) == n);
            }
        }
        let notice = Arc::new(AtomicU64::new(0));
        let notice_of_thread = Arc::clone(&notice);
        read(stuck, move |line| {
            let rest = line.strip_prefix("{\"event\":\"dropped\",\"lines\":");
            let lines = rest.and_then(|rest| rest.strip_suffix('}')?.parse().ok());
            notice_of_thread.fetch_add(lines.unwrap_or(0), Ordering::AcqRel);
        });
        wait_until("its lost lines are reported", || {
            sender.offer("{}\n".to_owned());
            notice.load(Ordering::Acquire) > 0
        });
        drop(sender);
        assert!(server.end() >= notice.load(Ordering::Acquire));
    }

    /// Safety: 30.
    #[test]
    fn full_queue_drops_and_counts_lines_without_blocking() {
        let (lines, _waiting) = sync_channel(2);
        let shared = Arc::<Shared>::default();
        let sender = Sender {
            lines,
            shared: Arc::clone(&shared),
        };
        for _ in 0..10 {
            sender.offer(String::new());
        }
        assert_eq!(shared.dropped.load(Ordering::Acquire), 8);
    }

    #[test]
    fn disconnected_readers_are_removed() {
        let server = Server::listen(0).expect("listens");
        drop(connected(&server));
        let sender = server.sender();
        wait_until("there is no reader", || {
            sender.offer("{}\n".to_owned());
            sender.readers_joined().is_none()
        });
        let second = Server::listen(server.address().port());
        assert_eq!(second.expect_err("taken").kind(), ErrorKind::AddrInUse);
        drop(sender);
        assert_eq!(server.end(), 0);
    }
}
