//! The measured chain: terrain, client, a line of some rate, and the device's application.
//!
//! Time is the number of ticks of a millisecond each. Work of the host takes no such time, as if it
//! ran beside the device; its duration is measured separately. During a transfer from a server, a
//! tick takes at least a millisecond of this machine's time.

use std::time::{Duration, Instant};

use hapterra::link::{Client, Event, LinkStats, Timeouts};
use hapterra::terrain::Terrain;
use hapterra_core::guard::GuardInputs;
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::{Scene, TickRecord};
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode};
use hapterra_core::wire::message::ToDevice;
use hapterra_core::wire::session::InSession;
use hapterra_core::wire::status::BootReport;
use hapterra_firmware::app::{TileBuffers, WorkingMemory};
use hapterra_firmware::native::{Device, StoppedClock};
use hapterra_firmware::store::Stored;

use super::MeasureError;
use super::link::Line;

/// Tiles along the side of the device's window, as on the emulated board.
const WINDOW: usize = 16;
/// A tick.
const TICK: Duration = Duration::from_millis(1);
/// Interval between two checks for a block.
const POLL_INTERVAL: Duration = Duration::from_micros(100);

/// A device in this program's memory, which is never freed.
pub(super) type Board = Device<StoppedClock, WINDOW>;

/// Creates a device with the calibration of a Premium 1.5, whose arm is not armed: it computes and
/// reports the contact, and no current flows.
pub(super) fn board() -> Board {
    Device::new(
        Box::leak(Box::new(TileBuffers::VACANT)),
        Box::leak(Box::new(WorkingMemory::new())),
        StoppedClock,
        Stored::Found(Calibration::PREMIUM_1_5),
        BootReport::default(),
    )
}

/// A tile of the field that was sent; those of the fallback do not count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SentTile {
    /// The tick in which the host sent it.
    pub(super) tick: u64,
    /// Bytes of its frame.
    pub(super) bytes: usize,
}

/// Pace of the ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pace {
    /// At most a thousand a second.
    Real,
    /// As fast as this machine runs, except during a transfer from a server.
    Virtual,
    /// As fast as this machine runs; time stops while a block is read, so that counts do not depend
    /// on the machine.
    Paused,
}

/// The host, its line to a device, and the device.
pub(super) struct Chain<'t> {
    client: Client<'t>,
    terrain: &'t Terrain<'t>,
    board: Board,
    line: Line,
    pace: Pace,
    now: u64,
    started: Instant,
    reader: Box<FrameReader<MAX_FRAME>>,
    /// Tiles sent up to now.
    pub(super) tiles: Vec<SentTile>,
    /// Time that the host needed to answer requests for tiles.
    pub(super) host: Vec<Duration>,
}

impl<'t> Chain<'t> {
    /// Creates a session that begins with the next tick: a scene of a terrain whose reads do not
    /// wait, over a line that carries `bytes_a_tick` each way.
    pub(super) fn new(
        terrain: &'t Terrain<'t>,
        scene: Scene,
        board: Board,
        bytes_a_tick: usize,
        pace: Pace,
    ) -> Self {
        let mut client = Client::numbered(terrain, scene, None, Timeouts::REAL_TIME, 1);
        let (mut line, mut out) = (Line::new(bytes_a_tick), vec![]);
        client.greet(Duration::ZERO, &mut out);
        line.send(&out);
        Self {
            client,
            terrain,
            board,
            line,
            pace,
            now: 0,
            started: Instant::now(),
            reader: Box::default(),
            tiles: vec![],
            host: vec![],
        }
    }

    /// Sets the pace of the ticks.
    pub(super) const fn set_pace(&mut self, pace: Pace) {
        self.pace = pace;
    }

    /// Returns the ticks up to now.
    pub(super) const fn now(&self) -> u64 {
        self.now
    }

    /// Returns the statistics of the link.
    pub(super) const fn stats(&self) -> &LinkStats {
        self.client.stats()
    }

    /// Runs a tick with these inputs, and calls `on_sample` with the samples that arrive at the
    /// host.
    ///
    /// # Errors
    /// If host and device do not understand each other.
    pub(super) fn tick(
        &mut self,
        inputs: GuardInputs,
        on_sample: &mut dyn FnMut(&TickRecord),
    ) -> Result<(), MeasureError> {
        self.now += 1;
        let board = &mut self.board;
        self.line.carry(|bytes| board.receive(bytes));
        board.tick(inputs);
        let received = self.receive_bytes();
        let (now, mut out) = (TICK * self.now as u32, vec![]);
        let started = Instant::now();
        let mut on = |event: Event<'_>| {
            if let Event::Sample(sample) = event {
                on_sample(sample);
            }
        };
        let result = self.client.receive(now, &received, &mut out, &mut on);
        let spent = started.elapsed();
        result
            .and_then(|()| self.client.append_due(now, &mut out, &mut on))
            .map_err(|error| MeasureError(format!("the session ended: {error}")))?;
        if self.count_tiles(&out) > 0 {
            self.host.push(spent);
        }
        self.line.send(&out);
        self.pace_tick();
        Ok(())
    }

    /// Returns the bytes from the device in a tick.
    fn receive_bytes(&mut self) -> Vec<u8> {
        let mut received = vec![0; self.line.bytes_a_tick()];
        let mut length = 0;
        while length < received.len() {
            let count = self.board.link.transmit(&mut received[length..]);
            if count == 0 {
                break;
            }
            length += count;
        }
        received.truncate(length);
        received
    }

    /// Searches the host's bytes for tiles of the field. Returns their number.
    fn count_tiles(&mut self, mut bytes: &[u8]) -> usize {
        let before = self.tiles.len();
        while !bytes.is_empty() {
            let (consumed, frame) = self.reader.push(bytes);
            let content = frame.and_then(Result::ok);
            let message = content.map(decode::<InSession<ToDevice<'_>>>);
            if let Some(Ok(InSession {
                message: ToDevice::Tile(tile),
                ..
            })) = message
                && tile.key.level == self.terrain.level()
            {
                self.tiles.push(SentTile {
                    tick: self.now,
                    bytes: consumed,
                });
            }
            bytes = &bytes[consumed..];
        }
        self.tiles.len() - before
    }

    /// Lets a tick last a millisecond, if necessary.
    fn pace_tick(&mut self) {
        let is_reading = || self.terrain.raster().is_reading();
        if self.pace == Pace::Paused {
            while is_reading() {
                std::thread::sleep(POLL_INTERVAL);
            }
        } else if self.pace == Pace::Real || is_reading() {
            std::thread::sleep(TICK.saturating_sub(self.started.elapsed()));
        }
        self.started = Instant::now();
    }
}
