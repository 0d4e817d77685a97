//! A native device and a host that answers by script.

use std::boxed::Box;
use std::collections::VecDeque;
use std::vec::Vec;

use hapterra_core::Vec3;
use hapterra_core::contact::Rule;
use hapterra_core::force::ForceLaw;
use hapterra_core::grid::GridPoint;
use hapterra_core::phantom::Calibration;
use hapterra_core::terrain::TileKey;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode, encode};
use hapterra_core::wire::message::{
    Heights, HostHello, PROTOCOL, Point, Sample, Scene, Source, Telemetry, TileMessage, ToDevice,
    ToHost,
};

use crate::channels::{Channels, Tiles};
use crate::native::{Device, StoppedClock};

/// Tiles along the window's side in these tests.
pub(super) const D: usize = 4;

/// A device without a host. Its memory is leaked, as a board's is never freed.
pub(super) fn device() -> Device<StoppedClock, D> {
    Device::new(
        Box::leak(Box::new(Tiles::new())),
        Box::leak(Box::new(Channels::new())),
        StoppedClock,
        Calibration::PREMIUM_1_5,
    )
}

/// A scene whose terrain is the plane at height 1.5.
pub(super) fn scene(source: Source) -> Scene {
    Scene {
        epoch: 7,
        level: 0,
        size: [640, 640],
        top: 3,
        cell_mm: 1.0,
        home: GridPoint::new([100, 100, 10], Vec3::ZERO),
        law: ForceLaw::PREMIUM,
        rule: Rule::Swept,
        source,
        hold_clock: false,
    }
}

pub(super) fn frame(message: &ToDevice<'_>) -> Vec<u8> {
    encode(message, &mut [0; MAX_FRAME]).unwrap().to_vec()
}

pub(super) fn hello(protocol: u16) -> Vec<u8> {
    frame(&ToDevice::Hello(HostHello { protocol }))
}

/// A tile of the plane at height 1.5, with every sample sent.
pub(super) fn tile(epoch: u32, key: TileKey) -> Vec<u8> {
    let bytes: Vec<u8> = [0.5f32.to_le_bytes(); 33 * 33].concat();
    let heights = Heights::Samples {
        base: 1,
        bytes: &bytes,
    };
    frame(&ToDevice::Tile(TileMessage {
        epoch,
        key,
        heights,
    }))
}

pub(super) fn point(seq: u32, x: f32, z: f32) -> Vec<u8> {
    let hip = GridPoint::new([100, 100, 0], Vec3::new(x, 0.5, z));
    frame(&ToDevice::Point(Point { seq, hip }))
}

/// A host, its device, and what was said so far.
pub(super) struct Rig {
    pub(super) device: Device<StoppedClock, D>,
    reader: Box<FrameReader<8192>>,
    /// Bytes to the device that it has not taken yet.
    pub(super) on_the_way: VecDeque<u8>,
    /// Bytes the writer takes a step; `usize::MAX` for a fast one.
    pub(super) writer: usize,
    pub(super) heard: Vec<ToHost>,
    /// Whether tiles asked for are answered.
    pub(super) answers_tiles: bool,
    /// What the answer to a tile becomes on the way.
    pub(super) damage: fn(&mut Vec<u8>),
    pub(super) counts: [i32; 3],
}

impl Rig {
    /// A host that has not said anything yet.
    pub(super) fn new() -> Self {
        Self {
            device: device(),
            reader: Box::new(FrameReader::new()),
            on_the_way: VecDeque::new(),
            writer: usize::MAX,
            heard: Vec::new(),
            answers_tiles: true,
            damage: |_| {},
            counts: [0; 3],
        }
    }

    /// A session in this scene.
    pub(super) fn in_scene(scene: Scene) -> Self {
        let mut rig = Self::asking(scene);
        rig.answers_tiles = true;
        for key in rig.needs() {
            rig.send(&tile(scene.epoch, key));
        }
        rig
    }

    /// A session in this scene, its first tiles asked for and not answered.
    pub(super) fn asking(scene: Scene) -> Self {
        let mut rig = Self::new();
        rig.answers_tiles = false;
        rig.send(&hello(PROTOCOL));
        rig.send(&frame(&ToDevice::Scene(scene)));
        rig.run(1);
        assert!(matches!(rig.heard[0], ToHost::Hello(_)), "{:?}", rig.heard);
        rig
    }

    pub(super) fn send(&mut self, bytes: &[u8]) {
        self.on_the_way.extend(bytes);
    }

    /// So many ticks, in lock-step where the device wants it.
    pub(super) fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.deliver();
            self.listen();
            self.deliver();
            if !self.device.may_stand_still() {
                self.device.tick(self.counts);
            }
        }
    }

    /// Ends the session and reads on while there is something to read. No more
    /// ticks: the program may be about to end.
    pub(super) fn say_goodbye(&mut self) {
        self.send(&frame(&ToDevice::Bye));
        self.deliver();
        assert!(!self.device.has_ended());
        self.writer = usize::MAX;
        self.listen();
    }

    fn deliver(&mut self) {
        let bytes = self.on_the_way.make_contiguous();
        let taken = self.device.receive(bytes);
        self.on_the_way.drain(..taken);
    }

    /// Reads what the device has to say and answers requests for tiles.
    fn listen(&mut self) {
        let mut left = self.writer;
        let mut chunk = [0; 64];
        while left > 0 {
            let room = left.min(chunk.len());
            let n = self.device.transmit(&mut chunk[..room]);
            if n == 0 {
                return;
            }
            left -= n;
            self.hear(&chunk[..n]);
        }
    }

    fn hear(&mut self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let (taken, frame) = self.reader.push(bytes);
            bytes = &bytes[taken..];
            let Some(message) = frame.map(|frame| frame.and_then(decode::<ToHost>)) else {
                continue;
            };
            let message = message.expect("the device sends whole frames");
            if let (ToHost::Need { epoch, key }, true) = (&message, self.answers_tiles) {
                let mut answer = tile(*epoch, *key);
                (self.damage)(&mut answer);
                self.on_the_way.extend(answer);
            }
            self.heard.push(message);
        }
    }

    pub(super) fn needs(&self) -> Vec<TileKey> {
        let need = |m: &ToHost| match m {
            ToHost::Need { key, .. } => Some(*key),
            _ => None,
        };
        self.heard.iter().filter_map(need).collect()
    }

    pub(super) fn felt(&self) -> Vec<(u32, Sample)> {
        let felt = |m: &ToHost| match m {
            ToHost::Felt { seq, sample } => Some((*seq, *sample)),
            _ => None,
        };
        self.heard.iter().filter_map(felt).collect()
    }

    pub(super) fn telemetry(&self) -> Vec<Telemetry> {
        let telemetry = |m: &ToHost| match m {
            ToHost::Telemetry(telemetry) => Some(telemetry.clone()),
            _ => None,
        };
        self.heard.iter().filter_map(telemetry).collect()
    }

    /// Points from above down into the plane, fed one by one, as felt.
    pub(super) fn descend(&mut self, points: u32) -> Vec<(u32, Sample)> {
        for seq in 0..points {
            self.send(&point(seq, seq as f32 * 0.9, 4.0 - seq as f32 * 0.1));
            for _ in 0..2000 {
                self.run(1);
                if self.felt().last().is_some_and(|(last, _)| *last == seq) {
                    break;
                }
            }
        }
        self.felt()
    }
}
