//! The table of messages. This file is the specification of the link.
//!
//! Any change to a type here, or to one it holds, is a new [`PROTOCOL`].
//! [`HostHello`] and [`DeviceHello`] keep their place (variant 0) and begin
//! with the protocol number in every version, so that versions can tell each
//! other apart.

use glam::Vec3;
use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::contact::{Rule, State};
use crate::force::ForceLaw;
use crate::grid::{GridPoint, MAX_CELL};
use crate::guard::{Fault, Limits, Mode, Report};
use crate::phantom::Calibration;
use crate::terrain::TileKey;
use crate::wire::status::{Answer, Status};

/// Version of this table.
pub const PROTOCOL: u16 = 3;
/// Samples in a telemetry message, at most.
pub const BATCH: usize = 8;
/// Length limit of names in a hello, bytes.
pub const NAME: usize = 32;

/// Host to device.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ToDevice<'a> {
    /// Opens a session.
    Hello(HostHello),
    /// What to touch and how. Starts afresh, unless the device already holds
    /// this very scene.
    Scene(Scene),
    /// A tile that was asked for.
    #[serde(borrow)]
    Tile(TileMessage<'a>),
    /// A hand position to be felt, in a scene fed by points.
    Point(Point),
    /// Asks for a [`ToHost::Status`].
    Status,
    /// Asks to arm: once nothing is in the way, the dead-man switch has to be
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
    /// What was felt, tick by tick.
    Telemetry(Telemetry),
    /// Answers one point.
    Felt {
        /// The point's number.
        seq: u32,
        /// What was felt there.
        sample: Sample,
    },
    /// Where the guard stands; told at the beginning of a session and whenever
    /// it changes.
    Guard(Report),
    /// Answers [`ToDevice::Status`].
    Status(Status),
    /// Answers [`ToDevice::GetCalibration`].
    Calibration(Option<Calibration>),
    /// Answers a request.
    Answer(Answer),
}

/// The host introduces itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HostHello {
    /// The host's [`PROTOCOL`].
    pub protocol: u16,
}

/// The device introduces itself.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DeviceHello {
    /// The device's [`PROTOCOL`].
    pub protocol: u16,
    /// Board name.
    pub board: heapless::String<NAME>,
    /// Firmware version.
    pub version: heapless::String<NAME>,
    /// Tiles along the side of the device's window.
    pub window: u8,
    /// Ticks a second.
    pub tick_hz: u32,
    /// Ticks of the clock in which tick costs are given, a second.
    pub clock_hz: u32,
    /// Epoch of the scene that the device still holds, if any.
    pub epoch: Option<u32>,
}

/// Where the haptic interface point comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Source {
    /// The Phantom's encoders.
    #[default]
    Encoders,
    /// The host's points, one a tick, in lock-step: replay.
    Points,
}

/// What to touch and how. Checked as a whole before it is taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Names this field, placement and law; tiles carry it.
    pub epoch: u32,
    /// Level of the tiles that are felt.
    pub level: u8,
    /// Size in patches, east and north.
    pub size: [i32; 2],
    /// A whole height in cells that no sample exceeds.
    pub top: i32,
    /// Hand millimetres a cell.
    pub cell_mm: f32,
    /// The point of the terrain that is at the tip in the home pose.
    pub home: GridPoint,
    /// Spring and limit.
    pub law: ForceLaw,
    /// Contact rule.
    pub rule: Rule,
    /// Where the hand comes from.
    pub source: Source,
    /// On an emulated board: let its clock stand still while the host owes a
    /// tile, so that a slow host machine is not felt.
    pub hold_clock: bool,
}

impl Scene {
    /// Whether every number is one that the loop can work with.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let size_ok = self.size.iter().all(|s| (1..=MAX_CELL).contains(s));
        let top_ok = self.top.unsigned_abs() <= MAX_CELL.unsigned_abs() + 1;
        let cell_ok = self.cell_mm.is_finite() && self.cell_mm > 0.0;
        size_ok && top_ok && cell_ok && self.law.is_valid()
    }
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

/// A hand position to be felt.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Number, repeated in the answer.
    pub seq: u32,
    /// The haptic interface point.
    pub hip: GridPoint,
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

/// One tick's record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// Tick since the scene was taken.
    pub tick: u32,
    /// Haptic interface point.
    pub hip: GridPoint,
    /// Proxy.
    pub proxy: GridPoint,
    /// Force commanded, newtons: east, north, up. Zero unless the amplifiers
    /// are on; in a replay, what the scene's law makes.
    pub force_n: Vec3,
    /// What the proxy is doing.
    pub state: State,
    /// The tile (column, row) whose absence holds the proxy up.
    pub held_up_by: Option<[i32; 2]>,
    /// How far arming has come.
    pub mode: Mode,
    /// Why the force is less than the scene asked for.
    pub limits: Limits,
    /// Latched fault.
    pub fault: Option<Fault>,
    /// Units of contact work spent.
    pub work: u32,
    /// What the tick before this one cost, in clock ticks.
    pub cost: u32,
    /// The costliest tick so far, in clock ticks.
    pub worst_cost: u32,
    /// Ticks so far that began or ended too late.
    pub late: u32,
}
