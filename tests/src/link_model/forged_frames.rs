//! Frames of other programs: a host and a device of another version, and another host.

use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode, encode};
use hapterra_core::wire::hello::{HostHello, PROTOCOL};
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::session::{DEFAULT_SILENCE_S, InSession, SessionNumber};
use hapterra_core::wire::version::VersionCheck;
use serde::Serialize;

/// The other version.
const OTHER: u16 = PROTOCOL + 1;

fn frame(content: &impl Serialize) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    let frame = encode(content, &mut buffer);
    frame.expect("a short frame").to_vec()
}

/// Returns the open of a host of another version.
pub(super) fn greeting() -> [Vec<u8>; 2] {
    let hello = ToDevice::Hello(HostHello {
        protocol: OTHER,
        number: 1,
        silence_s: DEFAULT_SILENCE_S,
    });
    let session = SessionNumber::new(0x0BAD_0000);
    [
        frame(&VersionCheck::Query { protocol: OTHER }),
        frame(&InSession {
            session,
            message: hello,
        }),
    ]
}

/// Returns the messages of another host that opens a session and closes it at once.
pub(super) fn takeover() -> [Vec<u8>; 2] {
    let hello = ToDevice::Hello(HostHello {
        protocol: PROTOCOL,
        number: 1,
        silence_s: DEFAULT_SILENCE_S,
    });
    let session = SessionNumber::new(0x0BAD_0100);
    [hello, ToDevice::Bye].map(|message| frame(&InSession { session, message }))
}

/// Returns the same frame, except that a `Hello` message becomes one of another version.
pub(super) fn of_another_version(bytes: Vec<u8>) -> Vec<u8> {
    let mut reader = Box::new(FrameReader::<MAX_FRAME>::new());
    let (_, Some(Ok(content))) = reader.push(&bytes) else {
        return bytes;
    };
    match decode::<InSession<ToHost>>(content) {
        Ok(mut framed) => match &mut framed.message {
            ToHost::Hello(device) => {
                device.protocol = OTHER;
                frame(&framed)
            }
            _ => bytes,
        },
        Err(_) => bytes,
    }
}
