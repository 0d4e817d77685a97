//! Frames as the oracle and hostile programs write and read them. Their only code with the link's
//! format is here.

use hapterra_core::wire::frame::{MAX_FRAME, decode, encode};
use hapterra_core::wire::message::{ToDevice, ToHost};
use hapterra_core::wire::session::{InSession, SessionNumber};
use hapterra_core::wire::version::VersionCheck;

/// Returns a host's message as a frame.
#[must_use]
pub fn from_host(session: SessionNumber, message: &ToDevice<'_>) -> Vec<u8> {
    let mut frame = [0; MAX_FRAME];
    let framed = InSession { session, message };
    encode(&framed, &mut frame).unwrap_or(&[]).to_vec()
}

/// Returns a device's message as a frame.
#[must_use]
pub fn from_device(session: SessionNumber, message: &ToHost) -> Vec<u8> {
    let mut frame = [0; MAX_FRAME];
    let framed = InSession { session, message };
    encode(&framed, &mut frame).unwrap_or(&[]).to_vec()
}

/// Returns a frame without a session.
#[must_use]
pub fn version_check(check: VersionCheck) -> Vec<u8> {
    let mut frame = [0; MAX_FRAME];
    encode(&check, &mut frame).unwrap_or(&[]).to_vec()
}

/// Returns a device's message in a frame, and its session.
#[must_use]
pub fn parse_device_frame(frame: &[u8]) -> Option<InSession<ToHost>> {
    decode(frame).ok()
}

/// Returns a host's message in a frame, and its session.
#[must_use]
pub fn parse_host_frame(frame: &[u8]) -> Option<InSession<ToDevice<'_>>> {
    decode(frame).ok()
}

/// Returns an encoded copy of a device's frame, modified by `change`.
#[must_use]
pub fn modified(frame: &[u8], change: impl FnOnce(&mut ToHost)) -> Option<Vec<u8>> {
    let InSession {
        session,
        mut message,
    } = parse_device_frame(frame)?;
    change(&mut message);
    Some(from_device(session, &message))
}
