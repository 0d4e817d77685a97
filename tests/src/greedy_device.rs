//! A device behind a socket that requests much and reads little.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::Duration;

use hapterra_core::phantom::Calibration;
use hapterra_core::terrain::TileKey;
use hapterra_core::wire::frame::{FrameReader, MAX_FRAME};
use hapterra_core::wire::hello::DeviceHello;
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::session::SessionNumber;

use crate::link_campaign::{frames, hostile_programs};
use crate::timeouts::pass;

/// Bytes of one read, and the pause between two reads.
const PAUSE: Duration = Duration::from_millis(100);
const CHUNK_BYTES: usize = 1_024;

/// Starts a device that accepts every scene, repeats requests for the same tiles, and reads a few
/// bytes from time to time.
///
/// # Panics
/// If no port is free.
pub fn start() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("a port");
    std::thread::spawn(move || {
        for host in listener.incoming() {
            let host = host.expect("a host");
            std::thread::spawn(move || answer(host));
        }
    });
    address
}

fn answer(mut host: TcpStream) {
    let mut reader = FrameReader::<MAX_FRAME>::new();
    let mut chunk = [0; CHUNK_BYTES];
    let mut epoch = None;
    while let Ok(read @ 1..) = host.read(&mut chunk) {
        let mut bytes = &chunk[..read];
        let mut sent = vec![];
        while !bytes.is_empty() {
            let (taken, content) = reader.push(bytes);
            bytes = &bytes[taken..];
            if let Some(Ok(content)) = content {
                sent.extend(answer_to(content, &mut epoch));
            }
        }
        if host.write_all(&sent).is_err() {
            return;
        }
        if let Some((session, epoch)) = epoch {
            let needs = needs(session, epoch);
            if host.write_all(&needs).is_err() {
                return;
            }
            pass(PAUSE);
        }
    }
}

/// The session and its scene, after the scene was accepted.
type Taken = Option<(SessionNumber, u32)>;

fn answer_to(content: &[u8], taken: &mut Taken) -> Vec<u8> {
    let Some(received) = frames::parse_host_frame(content) else {
        return vec![];
    };
    let session = received.session;
    match received.message {
        ToDevice::Hello(hello) => {
            let device = DeviceHello {
                opened_by: 1,
                ..hostile_programs::hello(hello.number)
            };
            frames::from_device(session, &ToHost::Hello(device))
        }
        ToDevice::Scene(scene) => {
            *taken = Some((session, scene.epoch));
            let (epoch, accepted) = (scene.epoch, true);
            frames::from_device(session, &ToHost::SceneAck { epoch, accepted })
        }
        // The host's queries before it serves tiles.
        ToDevice::GetCalibration { number } => {
            let calibration = Some(Calibration::PREMIUM_1_5);
            let answer = ToHost::Calibration {
                number,
                calibration,
            };
            frames::from_device(session, &answer)
        }
        ToDevice::Detach => frames::from_device(session, &ToHost::Detached),
        _ => vec![],
    }
}

fn needs(session: SessionNumber, epoch: u32) -> Vec<u8> {
    let need = |i: i32| ToHost::TileRequest {
        epoch,
        key: TileKey::new(0, i % 2, 0),
    };
    let needs = (0..200).map(|i| frames::from_device(session, &need(i)));
    needs.flatten().collect()
}
