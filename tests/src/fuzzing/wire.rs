//! Arbitrary bytes as input of the frame decoder and of the device's end of the link.

use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::{Fault, GuardInputs};
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::{Scene, Source};
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode, encode};
use hapterra_core::wire::hello::{HostHello, PROTOCOL};
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::request::Request;
use hapterra_core::wire::session::{DEFAULT_SILENCE_S, InSession, SessionNumber};
use hapterra_core::wire::status::BootReport;
use hapterra_core::wire::version::VersionCheck;
use hapterra_firmware::app::{TileBuffers, WorkingMemory};
use hapterra_firmware::native::{Device, StoppedClock};
use hapterra_firmware::store::Stored;

use super::bytes::Bytes;
use hapterra_core::terrain::FieldSize;

/// The session under test, and the number of sessions opened before it.
const SESSION: SessionNumber = SessionNumber::new(0);
const OTHER_SESSIONS: u32 = 16;

/// A device that lives as long as the thread, as its memory is leaked.
pub struct Wire {
    device: Device<StoppedClock, 2>,
    host: Box<FrameReader<8192>>,
}

impl Default for Wire {
    fn default() -> Self {
        let device = Device::new(
            Box::leak(Box::new(TileBuffers::VACANT)),
            Box::leak(Box::new(WorkingMemory::new())),
            StoppedClock,
            Stored::Found(Calibration::PREMIUM_1_5),
            BootReport::default(),
        );
        Self {
            device,
            host: Box::new(FrameReader::new()),
        }
    }
}

impl Wire {
    /// Sends the bytes to the decoder and to the device, in a fresh session and scene.
    ///
    /// # Panics
    /// If the device sends an invalid message, or drives a motor in a replay.
    pub fn run(&mut self, data: &[u8]) {
        decoded(data);
        self.begin();
        let mut bytes = Bytes(data);
        while !bytes.is_empty() {
            let kind = bytes.byte();
            let length = usize::from(bytes.byte()).min(bytes.0.len());
            let (chunk, rest) = bytes.0.split_at(length);
            bytes.0 = rest;
            match kind % 4 {
                // Unchanged.
                0 => self.receive(chunk),
                // In a frame with a correct checksum, so that its content is parsed.
                1 => self.receive(&framed(chunk)),
                // In a frame of the open session, so that the device acts on it.
                2 => self.receive(&framed(&in_session(chunk))),
                _ => self.device.link.interrupted(),
            }
            let sense = GuardInputs {
                counts: [i32::from(kind), 0, 0],
                dead_man: kind % 2 == 0,
                ..GuardInputs::default()
            };
            let drive = self.device.tick(sense);
            assert!(drive.currents_a.is_finite(), "{drive:?}");
            assert!(
                self.device.link.is_arm_in_use() || !drive.enabled,
                "{drive:?}"
            );
            self.listen();
        }
    }

    /// Opens a new session, whatever the device received before.
    fn begin(&mut self) {
        self.device.link.interrupted();
        self.receive(&[0]);
        let hello = HostHello {
            protocol: PROTOCOL,
            number: 1,
            silence_s: DEFAULT_SILENCE_S,
        };
        // The other sessions first, so that the device no longer stores this session's number.
        for session in (1..=OTHER_SESSIONS).map(SessionNumber::new) {
            self.receive(&message_in(session, &ToDevice::Hello(hello)));
        }
        for message_to_device in [ToDevice::Hello(hello), ToDevice::Scene(scene())] {
            self.receive(&message(&message_to_device));
        }
        // Clears any latched fault. The last of these requests has the number 1.
        let first = 2_u8.wrapping_sub(Fault::ALL.len() as u8);
        for (fault, number) in Fault::ALL.into_iter().zip(0..) {
            let number = first.wrapping_add(number);
            let request = Request::ClearFault { fault: Some(fault) };
            self.receive(&message(&ToDevice::Request { number, request }));
        }
        let _ = self.device.tick(GuardInputs::default());
        self.listen();
    }

    /// Sends all bytes, with ticks in between while the device has no room.
    fn receive(&mut self, mut bytes: &[u8]) {
        for _ in 0..10_000 {
            let taken = self.device.receive(bytes);
            bytes = &bytes[taken..];
            if bytes.is_empty() {
                return;
            }
            let _ = self.device.tick(GuardInputs::default());
            self.listen();
        }
        panic!("the device does not accept {} bytes", bytes.len());
    }

    /// Checks that everything the device sends is a message.
    fn listen(&mut self) {
        let mut chunk = [0; 256];
        for _ in 0..10_000 {
            let n = self.device.link.transmit(&mut chunk);
            if n == 0 {
                return;
            }
            let mut message = &chunk[..n];
            while !message.is_empty() {
                let (taken, frame) = self.host.push(message);
                message = &message[taken..];
                if let Some(frame) = frame {
                    let frame = frame.expect("the device sends whole frames");
                    if VersionCheck::is_in(frame) {
                        let _: VersionCheck = decode(frame).expect("a refusal");
                    } else {
                        let _: InSession<ToHost> = decode(frame).expect("and messages in them");
                    }
                }
            }
        }
        panic!("the device does not stop talking");
    }
}

/// Runs the decoder alone, for both directions.
fn decoded(mut data: &[u8]) {
    let mut reader = Box::new(FrameReader::<MAX_FRAME>::new());
    while !data.is_empty() {
        let (taken, frame) = reader.push(data);
        assert!(taken > 0);
        if let Some(Ok(frame)) = frame {
            let _ = decode::<InSession<ToDevice<'_>>>(frame);
            let _ = decode::<InSession<ToHost>>(frame);
            let _ = decode::<VersionCheck>(frame);
        }
        data = &data[taken..];
    }
}

/// Frames bytes as postcard would, with the checksum.
fn framed(content: &[u8]) -> Vec<u8> {
    /// Serializes as its bytes alone.
    struct Raw<'b>(&'b [u8]);
    impl serde::Serialize for Raw<'_> {
        fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            use serde::ser::SerializeTuple;
            let mut tuple = serializer.serialize_tuple(self.0.len())?;
            for byte in self.0 {
                tuple.serialize_element(byte)?;
            }
            tuple.end()
        }
    }
    encode(&Raw(content), &mut [0; MAX_FRAME])
        .expect("a chunk is short")
        .to_vec()
}

/// Returns a whole message of the session as a frame.
///
/// # Panics
/// If it does not fit a frame.
#[must_use]
pub fn message(message: &ToDevice<'_>) -> Vec<u8> {
    message_in(SESSION, message)
}

fn message_in(session: SessionNumber, message: &ToDevice<'_>) -> Vec<u8> {
    let framed = InSession { session, message };
    encode(&framed, &mut [0; MAX_FRAME])
        .expect("fits a frame")
        .to_vec()
}

/// Returns a message's bytes after the session's number.
fn in_session(content: &[u8]) -> Vec<u8> {
    // The smallest number with a varint of two bytes.
    assert_eq!(SESSION.get(), 128);
    [&[0x80, 0x01], content].concat()
}

/// Returns the scene of a replay over 64 × 64 patches.
#[must_use]
pub fn scene() -> Scene {
    Scene {
        epoch: 7,
        level: 0,
        size: FieldSize::new(64, 64),
        top: 100,
        fallback: None,
        cell_mm: 1.0,
        home: GridPoint::default(),
        params: SurfaceParams::PREMIUM,
        source: Source::Points,
        hold_clock: false,
        materials: None,
    }
}
