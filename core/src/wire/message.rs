//! The table of messages. [`super`] specifies when each end sends them.
//!
//! Each message is in an [`InSession`](super::session::InSession). Any change to a type here, or to
//! a type in it, requires a new [`PROTOCOL`](super::hello::PROTOCOL).

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::hello::{DeviceHello, HostHello};
use super::materials::{MaterialScene, MaterialTile};
use super::request::{Answer, Request};
use super::session::{SampleCount, SessionEnd};
use super::status::Status;
pub use super::tile::{Heights, TileMessage};
use crate::guard::Report;
use crate::phantom::Calibration;
use crate::scene::{HipCommand, Scene, SceneChange, TickRecord};
use crate::terrain::TileKey;

/// Maximum number of samples in a telemetry message.
pub const BATCH: usize = 8;

/// Host to device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToDevice<'a> {
    /// Opens the session of its frame. If that is open already, it is answered again and changes
    /// nothing.
    Hello(HostHello),
    /// The scene to render. Replaces the present scene, unless it is the same.
    Scene(Scene),
    /// A requested tile.
    #[serde(borrow)]
    Tile(TileMessage<'a>),
    /// A haptic interface point for one tick, in a scene fed by points.
    Hip(HipCommand),
    /// Shows that the host is connected. Answered by [`ToHost::Heartbeat`].
    Heartbeat,
    /// Requests an action, to be done once.
    Request {
        /// Number of the request within a session: one more than the last, wrapping.
        number: u8,
        /// The requested action.
        request: Request,
    },
    /// Requests a [`ToHost::Status`].
    Status {
        /// Number of the query: one more than the last, wrapping. The answer repeats it.
        number: u8,
    },
    /// Requests a [`ToHost::Calibration`].
    GetCalibration {
        /// Number of the query, as in [`ToDevice::Status`].
        number: u8,
    },
    /// Closes the session: disarms and drops the scene. Answered by [`ToHost::Goodbye`] when the
    /// amplifiers are off.
    Bye,
    /// Reports that the host received [`ToHost::Goodbye`] and leaves. The emulated board then ends
    /// its program.
    Close,
    /// Closes the session without a change to arm or scene: the host has only read. Answered by
    /// [`ToHost::Detached`].
    Detach,
    /// A new placement of the present scene, while the clutch is open ([`Request::Clutch`]) or
    /// under a pressing hand: the arm stays armed. Answered by [`ToHost::SceneAck`] with the epoch
    /// of the new scene.
    SceneChange(SceneChange),
    /// The same as [`Self::Scene`], for a scene with materials.
    #[serde(borrow)]
    MaterialScene(MaterialScene<'a>),
    /// The same as [`Self::Tile`], for a scene with materials.
    #[serde(borrow)]
    MaterialTile(MaterialTile<'a>),
}

/// Device to host.
// Built on the stack, written and dropped; there is no heap for a box.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToHost {
    /// Answers a hello.
    Hello(DeviceHello),
    /// Answers a scene.
    SceneAck {
        /// The scene's epoch.
        epoch: u32,
        /// True if the scene was valid and is now used.
        accepted: bool,
    },
    /// Requests a tile.
    TileRequest {
        /// The epoch of the tile's scene.
        epoch: u32,
        /// The tile's key.
        key: TileKey,
    },
    /// Samples of consecutive ticks.
    Telemetry(Telemetry),
    /// Answers one point.
    PointAnswer {
        /// The point's number.
        seq: u32,
        /// The tick's sample.
        sample: TickRecord,
    },
    /// The state of the guard; sent at the start of a session and on every change.
    Guard(Report),
    /// Answers [`ToDevice::Status`].
    Status {
        /// The query's number.
        number: u8,
        /// Status of the device.
        status: Status,
    },
    /// Answers [`ToDevice::GetCalibration`].
    Calibration {
        /// The query's number.
        number: u8,
        /// The present calibration, if there is one.
        calibration: Option<Calibration>,
    },
    /// Answers a request.
    Answer(Answer),
    /// Answers [`ToDevice::Heartbeat`].
    Heartbeat {
        /// Number of samples of this session sent before this message.
        count: SampleCount,
        /// Epoch of the scene that the device stores, if any.
        epoch: Option<u32>,
        /// The state of the guard, in case a [`ToHost::Guard`] was lost.
        report: Report,
    },
    /// Answers [`ToDevice::Bye`]: the amplifiers are off, nothing follows, and this is the number
    /// of the session's samples.
    Goodbye(SampleCount),
    /// Answers [`ToDevice::Detach`]: the session is closed.
    Detached,
    /// Answers a hello of a closed session, which cannot be opened again.
    SessionClosed {
        /// The number of the answered hello.
        number: u8,
        /// Reason: [`SessionEnd::Replaced`] if another session was opened since then,
        /// [`SessionEnd::HostSilent`] if not.
        end: SessionEnd,
    },
    /// Answers [`Request::Mark`].
    Marked {
        /// The request's number.
        number: u8,
        /// The marked tick ([`TickRecord::tick`]).
        tick: u32,
    },
}

/// Consecutive samples. They are numbered over the session, so a gap between messages shows a loss
/// on the link.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Telemetry {
    /// Number of the first sample.
    pub first: u32,
    /// Samples of this session that the device dropped because the link was slow.
    pub dropped: u32,
    /// The samples.
    pub samples: Vec<TickRecord, BATCH>,
}
