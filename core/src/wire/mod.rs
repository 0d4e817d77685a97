//! The link between device and host: one table of
//! messages, one framing. This page is the specification of the conversation.
//!
//! # Frames
//!
//! Every frame is serialised with postcard, followed by its CRC-32 (ISO-HDLC,
//! little-endian), COBS-encoded, and ended by a zero byte. A reader that joins
//! in the middle, or meets garbage, finds the next frame at the next zero.
//!
//! A frame holds an [`InSession`](session::InSession): the number of a session and a
//! message. What belongs to another session is not heard, except
//! [`ToDevice::Hello`](message::ToDevice::Hello), which opens one. The only other
//! frames are those with which two versions tell each other apart:
//! [`version`].
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
//! The line may lose, damage, delay, repeat and reorder frames. Every message is
//! therefore either repeated until it is answered, or makes no difference when it is
//! lost (telemetry, which is counted) or comes twice.
//!
//! # The host
//!
//! | state | says | leaves it when | gives up |
//! | --- | --- | --- | --- |
//! | closed | nothing | a command to open: greeting | |
//! | greeting | a version check and hello, every 0.4 s | the device's hello comes: scene sent, or open where there is no scene. A refusal that names another protocol: an error | after 4 s, whatever else is heard |
//! | scene sent | the scene, every 0.4 s; after 0.75 s without an answer hello, too | the scene is taken: open. It is refused: an error | after 4 s, whatever else is heard |
//! | open | alive, every 0.5 s of its own or of the device's time; its request, its questions, every 0.4 s; tiles and points; after 0.75 s without an answer hello, every 0.4 s | it is told to leave: leaving. A hello of a device that was restarted (another hello opened the session) or holds another scene: scene sent | after 4 s without an answer; after 1.5 s where frames of another session come meanwhile: another host has taken the device |
//! | leaving | hello and bye, every 0.4 s; answers requests for tiles no more | goodbye comes: close is sent once, and it is closed | after 3 s: an error reports that the board may be armed |
//! | detaching | hello and detach, every 0.4 s | detached comes: closed | after 3 s |
//!
//! A host that has put no scene in force and asked for nothing that drives leaves by
//! detaching: what another host left is none of its business.
//!
//! A session that is over on the device is none any more, whatever its host believes. A
//! host gets that in answer to its hello (over), and heeds that only in its own session
//! and only to its last hello: what comes late of an earlier session, or from before a
//! restart of the device, says nothing about the present one. Where another session was
//! opened since, another host has taken the device: an error at once, in each state but
//! detaching, which is closed. Where the device has let go the arm of a host that was
//! silent, the host continues in a new session; one that leaves waits for its goodbye.
//!
//! An answer is a frame of this session that answers a message of the host:
//! hello, scene taken, point answer, answer, marked, status, calibration, alive, goodbye,
//! detached, over.
//! Telemetry is none, because it also comes where the device hears nothing.
//! The times are those for a board in real time.
//!
//! One request is under way at a time; the next waits for its answer. A request that
//! is not answered in 4 s (and 10 s more for a press, where it is to store), while
//! other answers come, is given up and reported; where it
//! was to arm, a request to disarm follows, which makes the device ignore the first
//! should it still arrive.
//!
//! A mark ([`Request::Mark`](request::Request::Mark)) is answered by the tick that was marked
//! ([`ToHost::Marked`](message::ToHost::Marked)) when its pulse is over, or by a refusal.
//!
//! Questions, for status and calibration, are repeated in the same way. They have numbers
//! of their own, which their answers repeat: a host takes the answer to its present
//! question only. One that comes late, to a question before, tells what was.
//!
//! A host that continues over a new line draws a new number, unless the last one was
//! never answered. The device's hello tells what became of the session before, and
//! how many samples that had: loss at its end is counted, too.
//!
//! # The device
//!
//! | state | hears | leaves it when |
//! | --- | --- | --- |
//! | closed | hello | hello comes: open |
//! | open | everything | bye: leaving. Detach: detached, which is answered. `silence_s` without a frame of this session while armed, or being armed: ended, after a command to disarm. Hello of another session: open, replaced |
//! | leaving | alive, status, calibration, bye | the amplifiers are off and the telemetry has left: it says goodbye and is ended. Hello of another session: open |
//! | detached | detach: answered by detached; bye | bye: leaving. `silence_s` while armed, as when open: ended, after a command to disarm. Hello of another session: open |
//! | ended | bye: answered by goodbye; detach: answered by detached; close: the emulated board ends its program | hello of another session: open |
//!
//! - A hello of the session that is open is answered and changes nothing. A hello of a
//!   session that is ended, or of the eight before the present one, is stale: it opens
//!   none. It is answered by over where another session was opened since, or where the
//!   host was silent for too long. A host that has left hears goodbye, or detached,
//!   instead. Nothing else of such a session is answered, and no host answers over: it
//!   comes once for each hello.
//! - A hello that names no time for silence, of a session that is not open, opens none:
//!   its host only looks. It is answered, and so are its questions for status and
//!   calibration, in its own session's number; the last such host is known. A host that reads
//!   takes no arm from its host, and keeps none armed whose host is gone.
//! - The session before, of which a hello tells, is the last one that was not detached.
//!   Who looks does not hide what became of it.
//! - What waits for a press of the dead-man switch (an arm command before anything is
//!   driven, a calibration to be stored) ends after 2 s without a frame of the session:
//!   its host is not there to see what the press does.
//! - The tiles of a scene's fallback are asked for before the others, and by keys of their own
//!   ([`Fallback::keys`](crate::terrain::Fallback::keys)); each view brings its own.
//! - A scene with materials comes with their table
//!   ([`ToDevice::MaterialScene`](message::ToDevice::MaterialScene)), and is refused where the table is not the one
//!   that the scene names, or is none that can be rendered. Each of its tiles comes with materials
//!   ([`ToDevice::MaterialTile`](message::ToDevice::MaterialTile)), and its fallback without; any other is a bad frame. Its
//!   views keep the table, or have none.
//! - A new session keeps the scene and every tile that is held; samples and requests
//!   are numbered anew. Where the arm was being armed but nothing is driven yet, that
//!   is ended: the new host has to ask itself. So it is where its host detaches.
//! - Each request is done once. The number of the last one again: it is answered again,
//!   or is still under way. An older number (by less than 128, wrapping) is not heard.
//!   To arm is answered when the loop has decided, to store when it is stored.
//! - Another view of the scene in force ([`ToDevice::SceneChange`](message::ToDevice::SceneChange)) is put in
//!   only while no force is rendered: with the clutch held ([`Request::Clutch`](request::Request::Clutch)) and
//!   open, as a sample of the view in force says; in a replay between two points. It is answered as a scene is, also where
//!   it is refused, and nothing is disarmed. The host says it every 0.4 s until it is answered, and gives
//!   it up after 4 s. A number that is not newer (by less than 128, wrapping) than that of the view in force is
//!   not heard, but for the same view again. A clutch is let go when its session ends. The board's clutch input
//!   (the limit [`CLUTCH_INPUT`](crate::guard::Limits::CLUTCH_INPUT)) opens the clutch, too, and lets no view in by itself.
//! - While its time stands still (an emulated board in lock-step), what the device has
//!   requested and not got is requested again after two messages alive.
//!
//! Nothing is driven before the host has asked for it
//! ([`Request::Arm`](request::Request::Arm)) and the dead-man switch was pressed after
//! that; the remaining blockers are in [`ToHost::Guard`](message::ToHost::Guard).

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
