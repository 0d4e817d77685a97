//! A native device and a host that answers by script.

use std::boxed::Box;
use std::collections::VecDeque;
use std::vec::Vec;

use hapterra_core::Vec3;
use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::{GuardInputs, Mode, Report};
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::{HipCommand, Scene, Source, TickRecord};
use hapterra_core::terrain::{FieldSize, TileKey};
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode, encode};
use hapterra_core::wire::hello::{HostHello, PROTOCOL};
use hapterra_core::wire::message::{Heights, Telemetry, TileMessage, ToDevice, ToHost};
use hapterra_core::wire::request::{Answer, Refusal, Request};
use hapterra_core::wire::session::{DEFAULT_SILENCE_S, InSession, SessionNumber};
use hapterra_core::wire::status::{BootReport, Status};
use hapterra_core::wire::version::VersionCheck;

use crate::app::{TileBuffers, WorkingMemory};
use crate::native::{Device, StoppedClock};
use crate::store::Stored;

/// Tiles along the window's side in these tests.
pub(super) const D: usize = 4;

/// Open message of a host of this protocol.
pub(super) const HELLO: HostHello = HostHello {
    protocol: PROTOCOL,
    number: 1,
    silence_s: DEFAULT_SILENCE_S,
};
/// The rig's first session.
pub(super) const FIRST: SessionNumber = SessionNumber::new(1 << 8);

/// Creates a device without a host. Its memory is leaked, as a board's is never freed.
pub(super) fn device(stored: Stored, boot: BootReport) -> Device<StoppedClock, D> {
    Device::new(
        Box::leak(Box::new(TileBuffers::VACANT)),
        Box::leak(Box::new(WorkingMemory::new())),
        StoppedClock,
        stored,
        boot,
    )
}

/// Returns a scene whose terrain is the plane at height 1.5.
pub(super) fn scene(source: Source) -> Scene {
    Scene {
        epoch: 7,
        level: 0,
        size: FieldSize::new(640, 640),
        top: 3,
        fallback: None,
        cell_mm: 1.0,
        home: GridPoint::new([100, 100, 10], Vec3::ZERO),
        params: SurfaceParams::PREMIUM,
        source,
        hold_clock: false,
        materials: None,
    }
}

/// Returns a frame of a session.
pub(super) fn framed(session: SessionNumber, message: &ToDevice<'_>) -> Vec<u8> {
    let framed = InSession { session, message };
    encode(&framed, &mut [0; MAX_FRAME]).unwrap().to_vec()
}

/// Returns a frame of the first session.
pub(super) fn frame(message: &ToDevice<'_>) -> Vec<u8> {
    framed(FIRST, message)
}

/// Returns a host's query for the device's protocol.
pub(super) fn version_query(protocol: u16) -> Vec<u8> {
    let query = VersionCheck::Query { protocol };
    encode(&query, &mut [0; 16]).unwrap().to_vec()
}

/// Returns a tile of the plane at height 1.5, with every sample sent, in the first session.
pub(super) fn tile(epoch: u32, key: TileKey) -> Vec<u8> {
    tile_in(FIRST, epoch, key)
}

fn tile_in(session: SessionNumber, epoch: u32, key: TileKey) -> Vec<u8> {
    let bytes: Vec<u8> = [0.5f32.to_le_bytes(); 33 * 33].concat();
    let heights = Heights::Samples {
        base: 1,
        bytes: &bytes,
    };
    let message = TileMessage {
        epoch,
        key,
        heights,
    };
    framed(session, &ToDevice::Tile(message))
}

/// Returns a point in the first session.
pub(super) fn point(seq: u32, x: f32, z: f32) -> Vec<u8> {
    point_in(FIRST, seq, x, z)
}

fn point_in(session: SessionNumber, seq: u32, x: f32, z: f32) -> Vec<u8> {
    let hip = GridPoint::new([100, 100, 0], Vec3::new(x, 0.5, z));
    framed(session, &ToDevice::Hip(HipCommand { seq, hip }))
}

/// A host, its device, and their messages.
pub(super) struct Rig {
    pub(super) device: Device<StoppedClock, D>,
    reader: Box<FrameReader<8192>>,
    /// Bytes to the device that it has not read yet.
    pub(super) in_transit: VecDeque<u8>,
    /// Bytes that the writer accepts in a step; `usize::MAX` for a fast one.
    pub(super) writer: usize,
    pub(super) received: Vec<ToHost>,
    /// The session of a host that only reads, if there is one.
    pub(super) read_only_session: Option<SessionNumber>,
    pub(super) read_only_answers: Vec<ToHost>,
    /// Messages to the hosts of earlier sessions.
    pub(super) received_before: Vec<(SessionNumber, ToHost)>,
    /// The current session, and the number of its last request.
    pub(super) session: SessionNumber,
    pub(super) number: u8,
    /// Requests with their numbers.
    pub(super) requests: Vec<(u8, Request)>,
    /// Refusals received.
    pub(super) refused: Vec<VersionCheck>,
    /// True if requests for tiles are answered.
    pub(super) answers_tiles: bool,
    /// Damage of the answer with a tile.
    pub(super) damage: fn(&mut Vec<u8>),
    pub(super) sense: GuardInputs,
}

impl Rig {
    /// Creates a host that has not sent anything yet.
    pub(super) fn new() -> Self {
        let stored = Stored::Found(Calibration::PREMIUM_1_5);
        Self::started(stored, BootReport::default())
    }

    /// Creates a host with a device that started with this memory and boot report.
    pub(super) fn started(stored: Stored, boot: BootReport) -> Self {
        Self {
            device: device(stored, boot),
            reader: Box::new(FrameReader::new()),
            in_transit: VecDeque::new(),
            writer: usize::MAX,
            received: Vec::new(),
            read_only_session: None,
            read_only_answers: Vec::new(),
            received_before: Vec::new(),
            session: FIRST,
            number: 0,
            requests: Vec::new(),
            refused: Vec::new(),
            answers_tiles: true,
            damage: |_| {},
            sense: GuardInputs::default(),
        }
    }

    /// Opens a session in this scene.
    pub(super) fn in_scene(scene: Scene) -> Self {
        let mut rig = Self::with_unanswered_tiles(scene);
        rig.answers_tiles = true;
        for key in rig.tile_requests() {
            rig.send(&tile(scene.epoch, key));
        }
        rig
    }

    /// Opens a session in this scene whose first tiles are requested but not answered.
    pub(super) fn with_unanswered_tiles(scene: Scene) -> Self {
        let mut rig = Self::new();
        rig.answers_tiles = false;
        rig.send_message(&ToDevice::Hello(HELLO));
        rig.send_message(&ToDevice::Scene(scene));
        rig.run(1);
        assert!(
            matches!(rig.received[0], ToHost::Hello(_)),
            "{:?}",
            rig.received
        );
        rig
    }

    /// Opens a session in a scene that the arm touches, and arms.
    pub(super) fn armed() -> Self {
        let mut rig = Self::in_scene(scene(Source::Encoders));
        rig.arm();
        rig
    }

    /// Arms as a user does.
    pub(super) fn arm(&mut self) {
        self.sense.dead_man = false;
        self.request(Request::Zero { counts: [0; 3] });
        self.request(Request::Arm);
        self.run(10);
        self.sense.dead_man = true;
        self.run(2_300);
        assert_eq!(self.report().map(|r| r.mode), Some(Mode::Armed));
    }

    /// Presses the dead-man switch briefly and releases it.
    pub(super) fn press(&mut self) {
        for dead_man in [false, true, false] {
            self.sense.dead_man = dead_man;
            self.run(150);
        }
    }

    pub(super) fn send_message(&mut self, message: &ToDevice<'_>) {
        self.send(&framed(self.session, message));
    }

    /// Opens another session.
    pub(super) fn open_new_session(&mut self) {
        self.session = SessionNumber::new(self.session.get() + (1 << 8));
        self.number = 0;
        self.send_message(&ToDevice::Hello(HELLO));
    }

    /// Makes a request.
    pub(super) fn request(&mut self, request: Request) {
        self.number = self.number.wrapping_add(1);
        let number = self.number;
        self.requests.push((number, request));
        self.send_message(&ToDevice::Request { number, request });
    }

    pub(super) fn send(&mut self, bytes: &[u8]) {
        self.in_transit.extend(bytes);
    }

    /// Runs `ticks` ticks, in lock-step if the device requires it.
    pub(super) fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.deliver();
            self.listen();
            self.deliver();
            if !self.device.link.may_stop_clock() {
                self.device.tick(self.sense);
            }
        }
    }

    /// Closes the session and reads while there are messages. No more ticks: the program may be
    /// about to end.
    pub(super) fn send_bye(&mut self) {
        self.send_message(&ToDevice::Bye);
        self.deliver();
        assert!(!self.device.link.has_ended());
        self.writer = usize::MAX;
        self.listen();
    }

    fn deliver(&mut self) {
        let bytes = self.in_transit.make_contiguous();
        let consumed = self.device.receive(bytes);
        self.in_transit.drain(..consumed);
    }

    /// Reads the device's messages and answers requests for tiles.
    fn listen(&mut self) {
        let mut left = self.writer;
        let mut chunk = [0; 64];
        while left > 0 {
            let room = left.min(chunk.len());
            let n = self.device.link.transmit(&mut chunk[..room]);
            if n == 0 {
                return;
            }
            left -= n;
            self.on_bytes(&chunk[..n]);
        }
    }

    fn on_bytes(&mut self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let (consumed, frame) = self.reader.push(bytes);
            bytes = &bytes[consumed..];
            let Some(content) = frame else {
                continue;
            };
            let content = content.expect("the device sends whole frames");
            if VersionCheck::is_in(content) {
                self.refused.push(decode(content).expect("a refusal"));
                continue;
            }
            let framed: InSession<ToHost> = decode(content).expect("a message");
            if self.read_only_session == Some(framed.session) {
                self.read_only_answers.push(framed.message);
                continue;
            }
            if let ToHost::SessionClosed { .. } = framed.message {
                self.received_before.push((framed.session, framed.message));
                continue;
            }
            assert_eq!(framed.session, self.session, "{:?}", framed.message);
            let message = framed.message;
            if let (ToHost::TileRequest { epoch, key }, true) = (&message, self.answers_tiles) {
                let mut answer = tile_in(self.session, *epoch, *key);
                (self.damage)(&mut answer);
                self.in_transit.extend(answer);
            }
            self.received.push(message);
        }
    }

    pub(super) fn tile_requests(&self) -> Vec<TileKey> {
        let need = |m: &ToHost| match m {
            ToHost::TileRequest { key, .. } => Some(*key),
            _ => None,
        };
        self.received.iter().filter_map(need).collect()
    }

    pub(super) fn rendered(&self) -> Vec<(u32, TickRecord)> {
        let rendered = |m: &ToHost| match m {
            ToHost::PointAnswer { seq, sample } => Some((*seq, *sample)),
            _ => None,
        };
        self.received.iter().filter_map(rendered).collect()
    }

    pub(super) fn telemetry(&self) -> Vec<Telemetry> {
        let telemetry = |m: &ToHost| match m {
            ToHost::Telemetry(telemetry) => Some(telemetry.clone()),
            _ => None,
        };
        self.received.iter().filter_map(telemetry).collect()
    }

    /// Returns the latest reported sample.
    pub(super) fn latest(&self) -> TickRecord {
        let reported = self.telemetry();
        let last = reported
            .last()
            .and_then(|telemetry| telemetry.samples.last());
        *last.expect("samples")
    }

    /// Returns the last report of the guard.
    pub(super) fn report(&self) -> Option<Report> {
        let guard = |m: &ToHost| match m {
            ToHost::Guard(report) => Some(*report),
            _ => None,
        };
        self.received.iter().rev().find_map(guard)
    }

    /// Returns all answers to a kind of request.
    pub(super) fn answers(&self, to: fn(&Request) -> bool) -> Vec<Result<(), Refusal>> {
        let answer = |m: &ToHost| match m {
            ToHost::Answer(Answer { number, result }) => {
                let request = self.requests.iter().find(|(sent, _)| sent == number);
                request.filter(|(_, request)| to(request)).map(|_| *result)
            }
            _ => None,
        };
        self.received.iter().filter_map(answer).collect()
    }

    /// Requests the status.
    pub(super) fn status(&mut self) -> Status {
        self.send_message(&ToDevice::Status { number: 0 });
        self.run(1);
        let status = |m: &ToHost| match m {
            ToHost::Status { status, .. } => Some(status.clone()),
            _ => None,
        };
        self.received
            .iter()
            .rev()
            .find_map(status)
            .expect("answered")
    }

    /// Sends points from above down into the plane, one by one, each after the answer to the one
    /// before.
    pub(super) fn descend(&mut self, points: u32) -> Vec<(u32, TickRecord)> {
        for seq in 0..points {
            let (x, z) = (seq as f32 * 0.9, 4.0 - seq as f32 * 0.1);
            self.send(&point_in(self.session, seq, x, z));
            for _ in 0..2000 {
                self.run(1);
                if self.rendered().last().is_some_and(|(last, _)| *last == seq) {
                    break;
                }
            }
        }
        self.rendered()
    }
}
