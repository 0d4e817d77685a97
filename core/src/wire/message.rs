//! The table of messages. What each end says when is in [`super`].
//!
//! Each message travels in an [`InSession`](super::session::InSession). Any change to
//! a type here, or to one it holds, is a new [`PROTOCOL`](super::hello::PROTOCOL).

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

/// Samples in a telemetry message, at most.
pub const BATCH: usize = 8;

/// Host to device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToDevice<'a> {
    /// Opens the session of its frame. Where that is open already it is answered
    /// again and changes nothing.
    Hello(HostHello),
    /// The scene to render. Starts afresh, unless the device already holds
    /// this very scene.
    Scene(Scene),
    /// A tile that was asked for.
    #[serde(borrow)]
    Tile(TileMessage<'a>),
    /// A haptic interface point for one tick, in a scene fed by points.
    Hip(HipCommand),
    /// The host is there. Answered by [`ToHost::Heartbeat`].
    Heartbeat,
    /// Asks for something to be done, once.
    Request {
        /// Tells requests of a session apart: one more than the last, wrapping.
        number: u8,
        /// The requested action.
        request: Request,
    },
    /// Asks for a [`ToHost::Status`].
    Status {
        /// Tells questions apart: one more than the last, wrapping. The answer repeats it.
        number: u8,
    },
    /// Asks for a [`ToHost::Calibration`].
    GetCalibration {
        /// Tells questions apart, as that of [`ToDevice::Status`].
        number: u8,
    },
    /// Ends the session: disarms and drops the scene. Answered by
    /// [`ToHost::Goodbye`] when the amplifiers are off.
    Bye,
    /// The host has heard the goodbye and is gone. The emulated board ends its
    /// program.
    Close,
    /// Ends the session and leaves the arm and the scene as they are: the host has only
    /// looked. Answered by [`ToHost::Detached`].
    Detach,
    /// Another view of the scene in force, while the clutch is open
    /// ([`Request::Clutch`]): the arm stays armed. Answered by [`ToHost::SceneAck`] with
    /// the epoch of the view's scene.
    SceneChange(SceneChange),
    /// As [`Self::Scene`], of a scene with materials.
    #[serde(borrow)]
    MaterialScene(MaterialScene<'a>),
    /// As [`Self::Tile`], of a scene with materials.
    #[serde(borrow)]
    MaterialTile(MaterialTile<'a>),
}

/// Device to host.
// Made on the stack, written out and dropped; there is no heap to box it on.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToHost {
    /// Answers a hello.
    Hello(DeviceHello),
    /// Answers a scene.
    SceneAck {
        /// The scene's epoch.
        epoch: u32,
        /// True if the scene was valid and is now in force.
        accepted: bool,
    },
    /// Asks for a tile.
    TileRequest {
        /// The scene it belongs to.
        epoch: u32,
        /// Which tile.
        key: TileKey,
    },
    /// Samples, tick by tick.
    Telemetry(Telemetry),
    /// Answers one point.
    PointAnswer {
        /// The point's number.
        seq: u32,
        /// The tick's sample.
        sample: TickRecord,
    },
    /// The state of the guard; sent at the beginning of a session and whenever
    /// it changes.
    Guard(Report),
    /// Answers [`ToDevice::Status`].
    Status {
        /// The question's number.
        number: u8,
        /// Status of the device.
        status: Status,
    },
    /// Answers [`ToDevice::GetCalibration`].
    Calibration {
        /// The question's number.
        number: u8,
        /// The calibration in force, if there is one.
        calibration: Option<Calibration>,
    },
    /// Answers a request.
    Answer(Answer),
    /// Answers [`ToDevice::Heartbeat`].
    Heartbeat {
        /// The samples of this session that were sent before this message.
        count: SampleCount,
        /// Epoch of the scene that the device holds, if any.
        epoch: Option<u32>,
        /// The state of the guard, so that a lost [`ToHost::Guard`] does not leave
        /// the host with an old one.
        report: Report,
    },
    /// Answers [`ToDevice::Bye`]: the amplifiers are off, nothing follows, and these
    /// were the session's samples.
    Goodbye(SampleCount),
    /// Answers [`ToDevice::Detach`]: the session is over.
    Detached,
    /// Answers a hello of a session that is over and opens no more.
    SessionClosed {
        /// The number of the hello that this answers.
        number: u8,
        /// Reason: [`SessionEnd::Replaced`] where another session was opened since,
        /// [`SessionEnd::HostSilent`] where none was.
        end: SessionEnd,
    },
    /// Answers [`Request::Mark`].
    Marked {
        /// The request's number.
        number: u8,
        /// The tick that was marked ([`TickRecord::tick`]).
        tick: u32,
    },
}

/// A run of samples. Numbers are consecutive over the session, so a gap
/// between messages is loss on the link.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Telemetry {
    /// Number of the first sample.
    pub first: u32,
    /// Samples of this session that the device itself dropped because the
    /// link was slow.
    pub dropped: u32,
    /// The samples.
    pub samples: Vec<TickRecord, BATCH>,
}
