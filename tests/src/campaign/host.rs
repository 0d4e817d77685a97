//! The host's end of the link, in steps of a tick, over two pipes.

use std::time::Duration;

use hapterra::link::{Client, Event, HostRequest, LinkError, State, Timeouts};
use hapterra::terrain::Terrain;
use hapterra_core::guard::Fault;
use hapterra_core::scene::{Scene, TickRecord};
use hapterra_core::terrain::TileKey;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode, encode};
use hapterra_core::wire::materials::{MAX_TILE_BYTES, MaterialTile, TileMaterials};
use hapterra_core::wire::message::{Heights, TileMessage, ToDevice, ToHost};
use hapterra_core::wire::request::Request;
use hapterra_core::wire::session::{InSession, SessionNumber};
use hapterra_core::wire::status::Status;

use super::faulty_pipe::{LinkDisturbance, Pipe};
use crate::random::Random;

/// Bytes of a tile's samples.
const TILE_BYTES: usize = 33 * 33 * 4;

/// The host's answers to tile requests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tiles {
    /// As requested.
    #[default]
    Sent,
    /// No answer.
    Withheld,
    /// With invalid heights.
    Poisoned,
}

/// A host that serves a terrain.
pub struct Host<'t> {
    terrain: &'t Terrain<'t>,
    client: Client<'t>,
    reader: Box<FrameReader<MAX_FRAME>>,
    to_device: Pipe,
    to_host: Pipe,
    /// Samples received since the last read.
    pub samples: Vec<TickRecord>,
    /// The last answer to a status query.
    pub status: Option<Status>,
    /// The last reported fault.
    pub fault: Option<Fault>,
    /// A link error that no link fault may cause.
    pub failed: Option<LinkError>,
}

impl<'t> Host<'t> {
    /// Creates a host that has not sent anything yet.
    #[must_use]
    pub fn new(terrain: &'t Terrain<'t>, scene: Scene, seed: u64) -> Self {
        Self {
            terrain,
            client: Client::numbered(terrain, scene, None, Timeouts::REAL_TIME, seed),
            reader: Box::default(),
            to_device: Pipe::default(),
            to_host: Pipe::default(),
            samples: Vec::new(),
            status: None,
            fault: None,
            failed: None,
        }
    }

    /// Clears all state and restarts with another scene.
    pub fn restart(&mut self, scene: Scene, now: u64, random: &mut Random) {
        let seed = random.bits();
        let timeout = Timeouts::REAL_TIME;
        self.client = Client::numbered(self.terrain, scene, None, timeout, seed);
        *self.reader = FrameReader::new();
        self.greet(now, random);
    }

    /// Opens a session and sends the scene.
    pub fn greet(&mut self, now: u64, random: &mut Random) {
        let mut out = Vec::new();
        self.client.greet(time(now), &mut out);
        self.to_device
            .send(&out, now, &LinkDisturbance::default(), random);
    }

    /// Opens a session if none is open.
    pub fn greet_if_closed(&mut self, now: u64, random: &mut Random) {
        if self.client.state() == State::Closed {
            self.greet(now, random);
        }
    }

    /// Closes the session.
    pub fn leave(&mut self, now: u64, random: &mut Random) {
        let mut out = Vec::new();
        self.client.leave(time(now), &mut out);
        self.to_device
            .send(&out, now, &LinkDisturbance::default(), random);
    }

    /// Queries the status.
    pub fn query_status(&mut self) {
        self.client.enqueue(HostRequest::Status);
    }

    /// Sends a request.
    pub fn request(&mut self, request: Request) {
        self.client.enqueue(HostRequest::Request(request));
    }

    /// Sends a message that the real client would not send.
    pub fn send(
        &mut self,
        message: &ToDevice<'_>,
        now: u64,
        disturbance: &LinkDisturbance,
        random: &mut Random,
    ) {
        let bytes = framed(self.client.session(), message);
        self.to_device.send(&bytes, now, disturbance, random);
    }

    /// Delivers the bytes of this tick to the device; `take` returns the number of bytes accepted.
    pub fn deliver(&mut self, now: u64, take: &mut dyn FnMut(&[u8]) -> usize) {
        while let Some(chunk) = self.to_device.receive(now) {
            let accepted = take(&chunk);
            if accepted < chunk.len() {
                return self.to_device.put_back(chunk[accepted..].to_vec(), now);
            }
        }
    }

    /// Queues the device's bytes of this tick, and answers those that arrive.
    pub fn receive(
        &mut self,
        chunk: &[u8],
        now: u64,
        disturbance: &LinkDisturbance,
        tiles: Tiles,
        random: &mut Random,
    ) {
        self.to_host.send(chunk, now, disturbance, random);
        let mut out = Vec::new();
        while let Some(chunk) = self.to_host.receive(now) {
            match tiles {
                Tiles::Sent => self.process(&chunk, now, &mut out),
                other => self.corrupt(&chunk, other == Tiles::Poisoned, now, &mut out, random),
            }
        }
        self.run_timers(now, &mut out);
        self.to_device.send(&out, now, disturbance, random);
    }

    /// Repeats unanswered messages, and opens a new session if the device was lost.
    fn run_timers(&mut self, now: u64, out: &mut Vec<u8>) {
        match self.client.append_due(time(now), out, &mut |_| {}) {
            Ok(()) => {}
            Err(LinkError::Silent(_) | LinkError::NotConfirmed) => {
                self.client.greet(time(now), out);
            }
            Err(error) => self.failed = Some(error),
        }
    }

    fn process(&mut self, bytes: &[u8], now: u64, out: &mut Vec<u8>) {
        let Self {
            client,
            samples,
            status,
            fault,
            ..
        } = self;
        let mut on = |event: Event<'_>| match event {
            Event::Sample(sample) => samples.push(*sample),
            Event::Status(reported) => *status = Some(reported.clone()),
            Event::Guard(report) => *fault = report.fault,
            _ => {}
        };
        if let Err(error) = client.receive(time(now), bytes, out, &mut on) {
            self.failed = Some(error);
        }
    }

    /// Withholds or poisons tiles; handles all other messages normally.
    fn corrupt(
        &mut self,
        mut bytes: &[u8],
        poison: bool,
        now: u64,
        out: &mut Vec<u8>,
        random: &mut Random,
    ) {
        while !bytes.is_empty() {
            let (consumed, frame) = self.reader.push(bytes);
            bytes = bytes.get(consumed..).unwrap_or(&[]);
            let Some(Ok(framed)) = frame.map(|frame| frame.and_then(decode::<InSession<ToHost>>))
            else {
                continue;
            };
            if let ToHost::TileRequest { epoch, key } = framed.message {
                if poison {
                    let session = self.client.session();
                    let has_materials = self.terrain.grid().materials().is_some();
                    out.extend(match has_materials && random.below(4) > 0 {
                        true => poisoned_material_tile(session, epoch, key, random),
                        false => poisoned_tile(session, epoch, key, random),
                    });
                }
            } else {
                let mut frame = [0; MAX_FRAME];
                let frame = encode(&framed, &mut frame).unwrap_or(&[]).to_vec();
                self.process(&frame, now, out);
            }
        }
    }
}

/// A tick is a millisecond.
const fn time(now: u64) -> Duration {
    Duration::from_millis(now)
}

fn framed(session: SessionNumber, message: &ToDevice<'_>) -> Vec<u8> {
    let mut frame = [0; MAX_FRAME];
    let framed = InSession { session, message };
    encode(&framed, &mut frame).unwrap_or(&[]).to_vec()
}

/// Returns a tile of even ground with materials that are invalid or belong to other ground.
fn poisoned_material_tile(
    session: SessionNumber,
    epoch: u32,
    key: TileKey,
    random: &mut Random,
) -> Vec<u8> {
    let bytes = [random.bits() as u8; MAX_TILE_BYTES];
    let materials = match random.below(4) {
        0 => TileMaterials::One(random.bits() as u8),
        1 => TileMaterials::Runs(&bytes[..random.below(12)]),
        2 => TileMaterials::Each(&bytes[..MAX_TILE_BYTES - random.below(2)]),
        // A material of the table, whatever it is.
        _ => TileMaterials::One(0),
    };
    let heights = match random.below(2) {
        0 => Heights::NoData,
        _ => Heights::Flat {
            base: random.below(40) as i32 - 10,
            height: 0.5,
        },
    };
    let tile = TileMessage {
        epoch,
        key,
        heights,
    };
    let message = ToDevice::MaterialTile(MaterialTile { tile, materials });
    framed(session, &message)
}

/// Returns a well-formed tile with impossible heights.
fn poisoned_tile(session: SessionNumber, epoch: u32, key: TileKey, random: &mut Random) -> Vec<u8> {
    const HOSTILE_HEIGHTS: [f32; 6] = [
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        f32::MAX,
        -1e30,
        1e-45,
    ];
    let mut bytes = [0; TILE_BYTES];
    let heights = match random.below(4) {
        0 => Heights::Flat {
            base: i32::MAX,
            height: HOSTILE_HEIGHTS[random.below(6)],
        },
        1 => Heights::Samples {
            base: i32::MIN,
            bytes: &bytes[..TILE_BYTES - 4],
        },
        _ => {
            for word in bytes.chunks_exact_mut(4) {
                word.copy_from_slice(&HOSTILE_HEIGHTS[random.below(6)].to_le_bytes());
            }
            Heights::Samples {
                base: 0,
                bytes: &bytes,
            }
        }
    };
    let message = ToDevice::Tile(TileMessage {
        epoch,
        key,
        heights,
    });
    framed(session, &message)
}
