//! What travels between the device and the host: one link, one table of
//! messages, one framing.
//!
//! Every message is serialised with postcard, followed by its CRC-32 (ISO-HDLC,
//! little-endian), COBS-encoded, and ended by a zero byte. A reader that joins
//! in the middle, or meets garbage, finds the next frame at the next zero.
//!
//! The session: the host says [`message::ToDevice::Hello`]; the device answers
//! with its own [`message::ToHost::Hello`], or with
//! [`message::ToHost::Refused`] when the protocol versions differ. The host
//! then sends a [`Scene`](crate::scene::Scene); from there on the device asks for the
//! tiles it needs and reports what it feels. Either end may restart at any
//! time by beginning again with Hello.
//!
//! ```
//! use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode, encode};
//! use hapterra_core::wire::hello::{HostHello, PROTOCOL};
//! use hapterra_core::wire::message::ToDevice;
//!
//! let hello = ToDevice::Hello(HostHello { protocol: PROTOCOL });
//! let mut buffer = [0; 32];
//! let frame = encode(&hello, &mut buffer).expect("it fits");
//!
//! let mut reader = FrameReader::<MAX_FRAME>::new();
//! let (taken, content) = reader.push(frame);
//! let content = content.expect("a whole frame").expect("undamaged");
//! assert_eq!((taken, decode(content)), (frame.len(), Ok(hello)));
//! ```
//!
//! Nothing is driven before the host has asked for it
//! ([`message::ToDevice::Arm`]) and the dead-man switch was pressed after that;
//! what still blocks it is told in [`message::ToHost::Guard`].

pub mod frame;
pub mod hello;
pub mod message;
pub mod plant;
pub mod status;

#[cfg(test)]
mod bytes_tests;
