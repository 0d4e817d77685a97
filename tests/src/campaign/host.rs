//! The host's end of the link, tick by tick, over two pipes.

use hapterra::link::{Client, Event, LinkError};
use hapterra::terrain::Terrain;
use hapterra_core::scene::{Sample, Scene};
use hapterra_core::terrain::TileKey;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode, encode};
use hapterra_core::wire::message::{Heights, TileMessage, ToDevice, ToHost};
use hapterra_core::wire::status::Status;

use super::pipe::{Pipe, Unkind};
use crate::chance::Chance;

/// After this many silent ticks the host says hello again, as a session does.
const GREET_AGAIN: u64 = 750;
/// Bytes of a tile's samples.
const TILE_BYTES: usize = 33 * 33 * 4;

/// How the host answers requests for tiles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tiles {
    /// As asked.
    #[default]
    Sent,
    /// Not at all.
    Withheld,
    /// With heights that are none.
    Poisoned,
}

/// A host that serves a terrain.
pub struct Host<'t> {
    terrain: &'t Terrain<'t>,
    client: Client<'t>,
    reader: Box<FrameReader<MAX_FRAME>>,
    to_device: Pipe,
    to_host: Pipe,
    heard: u64,
    greeted: u64,
    /// Samples that came since they were last taken.
    pub samples: Vec<Sample>,
    /// The last answer to a question for the status.
    pub status: Option<Status>,
    /// Whether the scene is in force.
    pub opened: bool,
    /// A link error that no fault of a link may cause.
    pub failed: Option<LinkError>,
}

impl<'t> Host<'t> {
    /// A host that has not said anything yet.
    #[must_use]
    pub fn new(terrain: &'t Terrain<'t>, scene: Scene) -> Self {
        Self {
            terrain,
            client: Client::new(terrain, scene, None),
            reader: Box::default(),
            to_device: Pipe::default(),
            to_host: Pipe::default(),
            heard: 0,
            greeted: 0,
            samples: Vec::new(),
            status: None,
            opened: false,
            failed: None,
        }
    }

    /// Forgets everything and begins anew with another scene.
    pub fn restart(&mut self, scene: Scene, now: u64, chance: &mut Chance) {
        self.client = Client::new(self.terrain, scene, None);
        *self.reader = FrameReader::new();
        self.greet(now, chance);
    }

    /// Says hello; the scene follows.
    pub fn greet(&mut self, now: u64, chance: &mut Chance) {
        let mut out = Vec::new();
        self.client.greet(&mut out);
        self.opened = false;
        self.greeted = now;
        self.to_device.send(&out, now, &Unkind::default(), chance);
    }

    /// Sends a message.
    pub fn say(&mut self, message: &ToDevice<'_>, now: u64, unkind: &Unkind, chance: &mut Chance) {
        let mut frame = [0; MAX_FRAME];
        let bytes = encode(message, &mut frame).unwrap_or(&[]);
        self.to_device.send(bytes, now, unkind, chance);
    }

    /// What arrives at the device in this tick; `take` tells how many bytes it
    /// took.
    pub fn deliver(&mut self, now: u64, take: &mut dyn FnMut(&[u8]) -> usize) {
        while let Some(piece) = self.to_device.receive(now) {
            let taken = take(&piece);
            if taken < piece.len() {
                return self.to_device.put_back(piece[taken..].to_vec(), now);
            }
        }
    }

    /// What the device said in this tick goes on its way, and what arrives is
    /// answered.
    pub fn hear(
        &mut self,
        said: &[u8],
        now: u64,
        unkind: &Unkind,
        tiles: Tiles,
        chance: &mut Chance,
    ) {
        self.to_host.send(said, now, unkind, chance);
        while let Some(piece) = self.to_host.receive(now) {
            self.heard = now;
            let out = match tiles {
                Tiles::Sent => self.understand(&piece),
                other => self.mistreat(&piece, other == Tiles::Poisoned, chance),
            };
            self.to_device.send(&out, now, unkind, chance);
        }
        let quiet_since = self.heard.max(self.greeted);
        if now.saturating_sub(quiet_since) >= GREET_AGAIN && !unkind.cut {
            self.greet(now, chance);
        }
    }

    fn understand(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        let Self {
            client,
            samples,
            status,
            opened,
            ..
        } = self;
        let mut on = |event: Event<'_>| match event {
            Event::Opened { .. } => *opened = true,
            Event::Sample(sample) => samples.push(*sample),
            Event::Status(told) => *status = Some(told.clone()),
            _ => {}
        };
        if let Err(error) = client.receive(bytes, &mut out, &mut on) {
            self.failed = Some(error);
        }
        out
    }

    /// Hears samples, and withholds tiles or sends poison.
    fn mistreat(&mut self, mut bytes: &[u8], poison: bool, chance: &mut Chance) -> Vec<u8> {
        let mut out = Vec::new();
        while !bytes.is_empty() {
            let (taken, frame) = self.reader.push(bytes);
            bytes = bytes.get(taken..).unwrap_or(&[]);
            match frame.map(|frame| frame.and_then(decode::<ToHost>)) {
                Some(Ok(ToHost::Telemetry(telemetry))) => self.samples.extend(telemetry.samples),
                Some(Ok(ToHost::Need { epoch, key })) if poison => {
                    out.extend(poisoned(epoch, key, chance));
                }
                _ => {}
            }
        }
        out
    }
}

/// A well-formed tile of heights that no terrain has.
fn poisoned(epoch: u32, key: TileKey, chance: &mut Chance) -> Vec<u8> {
    const WORDS: [f32; 6] = [
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        f32::MAX,
        -1e30,
        1e-45,
    ];
    let mut bytes = [0; TILE_BYTES];
    let heights = match chance.below(4) {
        0 => Heights::Flat {
            base: i32::MAX,
            height: WORDS[chance.below(6)],
        },
        1 => Heights::Samples {
            base: i32::MIN,
            bytes: &bytes[..TILE_BYTES - 4],
        },
        _ => {
            for word in bytes.chunks_exact_mut(4) {
                word.copy_from_slice(&WORDS[chance.below(6)].to_le_bytes());
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
    let mut frame = [0; MAX_FRAME];
    encode(&message, &mut frame).unwrap_or(&[]).to_vec()
}
