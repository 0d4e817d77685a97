//! The link between device and host: one table of messages, one framing. This page is the
//! specification of the protocol.
//!
//! - [`message`]: the table of messages of each end;
//! - [`frame`]: encoding and reading of frames;
//! - [`version`]: the frames with which two protocol versions detect each other;
//! - [`session`]: the session of a frame, its end, and the number of its samples;
//! - [`hello`]: the messages that open a session;
//! - [`request`]: requests of a host, and their answers;
//! - [`status`]: start, guard and measurements of a device;
//! - [`tile`], [`materials`]: the heights of a tile; its materials, and the table of a scene;
//! - [`plant`]: the emulated board's second line, to the virtual arm.
//!
//! # Frames
//!
//! Every frame is serialised with postcard, followed by its CRC-32 (ISO-HDLC,
//! little-endian), COBS-encoded, and ended by a zero byte. A reader that joins
//! in the middle, or meets garbage, finds the next frame at the next zero.
//!
//! A frame contains an [`InSession`](session::InSession): the number of a session and a message.
//! Messages of other sessions are ignored, except [`ToDevice::Hello`](message::ToDevice::Hello),
//! which opens a session. The only other frames are those with which two protocol versions detect
//! each other: [`version`].
//!
//! ```
//! use hapterra_core::wire::frame::{FrameReader, MAX_FRAME, decode, encode};
//! use hapterra_core::wire::message::ToDevice;
//! use hapterra_core::wire::session::{InSession, SessionNumber};
//!
//! let session = SessionNumber::new(0x1234_5678);
//! let alive = InSession { session, message: ToDevice::Heartbeat };
//! let mut buffer = [0; 32];
//! let frame = encode(&alive, &mut buffer).expect("it fits");
//!
//! let mut reader = FrameReader::<MAX_FRAME>::new();
//! let (taken, content) = reader.push(frame);
//! let content = content.expect("a whole frame").expect("undamaged");
//! assert_eq!((taken, decode(content)), (frame.len(), Ok(alive)));
//! ```
//!
//! The line may lose, damage, delay, repeat and reorder frames. So a message is either repeated
//! until it is answered, or is harmless if it is lost (telemetry, which is counted) or arrives
//! twice.
//!
//! # The host
//!
//! | state | sends | exit | time-out |
//! | --- | --- | --- | --- |
//! | closed | nothing | a command to open: opening | |
//! | opening | a version check and a hello, every 0.4 s | the device's hello: scene sent, or open if there is no scene. A refusal with another protocol: an error | after 4 s, even if other frames arrive |
//! | scene sent | the scene, every 0.4 s; after 0.75 s without an answer also a hello | the scene is accepted: open. It is refused: an error | after 4 s, even if other frames arrive |
//! | open | a heartbeat, every 0.5 s of its own or of the device's time; its request and its queries, every 0.4 s; tiles and points; after 0.75 s without an answer a hello, every 0.4 s | a command to leave: leaving. A hello of a device that was restarted (another hello opened the session) or stores another scene: scene sent | after 4 s without an answer; after 1.5 s if frames of another session arrive meanwhile: another host uses the device |
//! | leaving | a hello and a bye, every 0.4 s; answers no more requests for tiles | goodbye: sends close once and is closed | after 3 s: an error reports that the board may be armed |
//! | detaching | a hello and a detach, every 0.4 s | detached: closed | after 3 s |
//!
//! A host that has sent no scene, and requested nothing that drives, detaches instead of closing:
//! the state set by another host is unchanged.
//!
//! A session that the device has closed stays closed, also if its host has missed the close. The
//! host receives a session-closed message in answer to its hello. It accepts that only for its own
//! session and its last hello: a late message from an earlier session, or from before a restart of
//! the device, is not about the present one. If another session was opened since then, another host
//! uses the device: an error at once in every state except detaching, which becomes closed. If the
//! device disarmed because the host was silent, the host continues in a new session; a host that
//! leaves waits for its goodbye.
//!
//! An answer is a frame of this session that answers a message of the host: hello, scene
//! acknowledgement, point answer, answer, marked, status, calibration, heartbeat, goodbye,
//! detached, session closed. Telemetry is not an answer, because it also arrives if the device
//! receives nothing. The times are for a board in real time.
//!
//! Only one request is active at a time; the next waits for its answer. If a request is not
//! answered in 4 s (plus 10 s for a press before storing) while other answers arrive, it is
//! cancelled and reported. If it was an arm request, a disarm request follows, so that the device
//! ignores the first one if it still arrives.
//!
//! The answer to a mark ([`Request::Mark`](request::Request::Mark)) is the marked tick
//! ([`ToHost::Marked`](message::ToHost::Marked)) after its pulse, or a refusal.
//!
//! Queries, for status and calibration, are repeated in the same way. They have their own numbers,
//! which the answers repeat: a host accepts only the answer to its present query. A late answer to
//! an earlier query is outdated.
//!
//! A host that continues over a new line draws a new session number, unless the last one was never
//! answered. The device's hello reports the end of the previous session and the number of its
//! samples, so that a loss at its end is also counted.
//!
//! # The device
//!
//! | state | accepts | exit |
//! | --- | --- | --- |
//! | closed | hello | hello: open |
//! | open | everything | bye: closing. Detach: detached, which is answered. `silence_s` without a frame of this session while armed, or during arming: ended, after a command to disarm. Hello of another session: open, replaced |
//! | closing | heartbeat, status, calibration, bye | the amplifiers are off and the telemetry is sent: it sends goodbye and is ended. Hello of another session: open |
//! | detached | detach: answered by detached; bye | bye: closing. `silence_s` while armed, as in open: ended, after a command to disarm. Hello of another session: open |
//! | ended | bye: answered by goodbye; detach: answered by detached; close: the emulated board ends its program | hello of another session: open |
//!
//! - A hello of the open session is answered and changes nothing. A hello of an ended session, or
//!   of the eight sessions before the present one, is stale: it opens none. The answer is session
//!   closed, if another session was opened since then or if the host was silent for too long. A
//!   host that has left receives goodbye or detached instead. Nothing else of such a session is
//!   answered. No host answers session closed: it is sent once for each hello.
//! - A hello with a silence time of zero, of a session that is not open, opens none: its host only
//!   reads. The hello is answered, and so are its queries for status and calibration, with the
//!   number of its own session; the device stores the last such host. A host that only reads does
//!   not end another host's session, and does not keep an arm armed whose host has left.
//! - The previous session in a hello is the last one that was not detached. A host that only reads
//!   does not hide its end.
//! - A wait for a press of the dead-man switch (an arm command before anything is driven, a
//!   calibration to be stored) ends after 2 s without a frame of the session: its host could not
//!   observe the effect of the press.
//! - The tiles of a scene's fallback are requested before the others, by their own keys
//!   ([`Fallback::keys`](crate::terrain::Fallback::keys)); each new placement has its own fallback.
//! - A scene with materials is sent with their table
//!   ([`ToDevice::MaterialScene`](message::ToDevice::MaterialScene)), and is refused if the table
//!   is invalid or does not have the scene's check sum. Each of its tiles has materials
//!   ([`ToDevice::MaterialTile`](message::ToDevice::MaterialTile)), and its fallback has none; any
//!   other tile is a bad frame. A new placement keeps the table, or has none.
//! - A new session keeps the scene and every stored tile; the numbers of samples and requests start
//!   again. If arming was in progress but nothing was driven yet, it is cancelled: the new host
//!   must request it again. The same happens when its host detaches.
//! - Each request is done once. A repeated number of the last request is answered again, unless the
//!   request is still active. An older number (by less than 128, wrapping) is ignored. An arm
//!   request is answered when the loop has decided, a store request when the calibration is stored.
//! - A new placement of the present scene
//!   ([`ToDevice::SceneChange`](message::ToDevice::SceneChange)) is applied only while no force is
//!   rendered: with the clutch held ([`Request::Clutch`](request::Request::Clutch)) and open, as a
//!   sample of the present scene shows; in a replay, between two points. It is answered like a
//!   scene, also if it is refused, and nothing is disarmed. The host repeats it every 0.4 s until
//!   it is answered, and cancels it after 4 s. A number that is not newer (by less than 128,
//!   wrapping) than the present one is ignored, except for a repetition of the same placement. A
//!   clutch is released at the end of its session. The board's clutch input (the limit
//!   [`CLUTCH_INPUT`](crate::guard::Limits::CLUTCH_INPUT)) also opens the clutch, but does not
//!   permit a new placement by itself.
//! - A new placement that waits to change under the pressing hand
//!   ([`SceneChange::in_contact`](crate::scene::SceneChange::in_contact)) can be cancelled
//!   ([`Request::CancelChange`](request::Request::CancelChange)). The device then has the scene
//!   before it, and reports its epoch. If the change was made first, the request is refused. Until
//!   the loop has decided, an open message gets no answer.
//! - While the device's time does not advance (an emulated board in lock-step), it repeats
//!   unanswered requests after two heartbeats.
//!
//! Nothing is driven before the host has requested it ([`Request::Arm`](request::Request::Arm)) and
//! the dead-man switch was pressed after that; [`ToHost::Guard`](message::ToHost::Guard) has the
//! remaining blockers.

pub mod frame;
pub mod hello;
pub mod materials;
pub mod message;
pub mod plant;
pub mod request;
pub mod session;
pub mod status;
pub mod tile;
pub mod version;

#[cfg(test)]
mod bytes_tests;
