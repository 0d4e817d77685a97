//! The table of messages. This file is the specification of the link.
//!
//! Any change to a type here, or to one it holds, is a new [`PROTOCOL`].
//! [`HostHello`] and [`DeviceHello`] keep their place (variant 0) and begin
//! with the protocol number in every version, so that versions can tell each
//! other apart.
//!
//! [`PROTOCOL`]: super::hello::PROTOCOL

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::hello::{DeviceHello, HostHello};
use super::status::{Answer, Status};
use crate::guard::Report;
use crate::phantom::Calibration;
use crate::scene::{Point, Sample, Scene};
use crate::terrain::TileKey;

/// Samples in a telemetry message, at most.
pub const BATCH: usize = 8;
/// Host to device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToDevice<'a> {
    /// Opens a session.
    Hello(HostHello),
    /// The scene to be felt. Starts afresh, unless the device already holds
    /// this very scene.
    Scene(Scene),
    /// A tile that was asked for.
    #[serde(borrow)]
    Tile(TileMessage<'a>),
    /// A haptic interface point for one tick, in a scene fed by points.
    Point(Point),
    /// Asks for a [`ToHost::Status`].
    Status,
    /// Asks to arm: once nothing blocks it, the dead-man switch has to be
    /// let go and pressed. Answered when that much is known.
    Arm,
    /// Asks to disarm; force goes out gently.
    Disarm,
    /// Says what the encoders read in the zero pose of the calibration.
    Zero {
        /// Counts of axes 1 to 3.
        counts: [i32; 3],
    },
    /// Puts a calibration in force. Only while disarmed.
    SetCalibration {
        /// The record.
        calibration: Calibration,
        /// Whether to store it in the device's memory, too; a second answer,
        /// to [`Request::StoreCalibration`], tells how that went.
        ///
        /// [`Request::StoreCalibration`]: super::status::Request::StoreCalibration
        store: bool,
    },
    /// Asks for a [`ToHost::Calibration`].
    GetCalibration,
    /// Clears a latched fault.
    ClearFault,
    /// Drops the scene: disarms, and force goes out gently.
    DropScene,
    /// Ends the session, and drops the scene likewise. The emulated board ends
    /// its program, too.
    Bye,
}

/// Device to host.
// Made on the stack, written out and dropped; there is no heap to box it on.
#[allow(clippy::large_enum_variant)]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToHost {
    /// Answers a hello of the same protocol.
    Hello(DeviceHello),
    /// Answers a hello of another protocol: this is the device's.
    Refused {
        /// The protocol that the device speaks.
        protocol: u16,
    },
    /// Answers a scene.
    SceneTaken {
        /// The scene's epoch.
        epoch: u32,
        /// Whether the scene was valid and is now in force.
        accepted: bool,
    },
    /// Asks for a tile.
    Need {
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
        sample: Sample,
    },
    /// The state of the guard; sent at the beginning of a session and whenever
    /// it changes.
    Guard(Report),
    /// Answers [`ToDevice::Status`].
    Status(Status),
    /// Answers [`ToDevice::GetCalibration`].
    Calibration(Option<Calibration>),
    /// Answers a request.
    Answer(Answer),
}

/// A tile's content.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TileMessage<'a> {
    /// The scene it belongs to.
    pub epoch: u32,
    /// Which tile.
    pub key: TileKey,
    /// The heights.
    #[serde(borrow)]
    pub heights: Heights<'a>,
}

/// The heights of a tile. A constant tile is one number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Heights<'a> {
    /// No surface anywhere.
    Hole,
    /// All samples at `base + height` cells.
    Flat {
        /// Whole cells.
        base: i32,
        /// Cells above the base.
        height: f32,
    },
    /// 33 × 33 little-endian `f32`, rows from the south, cells above the base;
    /// NaN where there is no surface.
    Samples {
        /// Whole cells.
        base: i32,
        /// 4,356 bytes.
        #[serde(borrow)]
        bytes: &'a [u8],
    },
}

/// A run of samples. Numbers are consecutive over the session, so a gap
/// between messages is loss on the link.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Telemetry {
    /// Number of the first sample.
    pub first: u32,
    /// Samples the device itself dropped so far because the link was slow.
    pub dropped: u32,
    /// The samples.
    pub samples: Vec<Sample, BATCH>,
}
