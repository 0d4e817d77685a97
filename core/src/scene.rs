//! Input of a tick (scene, points) and its report (records, health).
//!
//! These types go into the tick and come out of it, and they travel on the wire
//! as they are: any change to one of them is a new version of the wire's protocol.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::contact::ContactState;
use crate::force::SurfaceParams;
use crate::grid::{GridPoint, MAX_CELL};
use crate::guard::{Fault, GuardInputs, Limits, Mode, Report};
use crate::terrain::{Fallback, FieldSize, TileIndex};

/// Source of the haptic interface point (HIP).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Source {
    /// The Phantom's encoders.
    #[default]
    Encoders,
    /// The host's points, one a tick, in lock-step: replay.
    Points,
}

/// A field, its placement under the arm, and its surface parameters. Checked as a
/// whole before it is taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Names this field, placement and surface parameters; tiles carry it.
    pub epoch: u32,
    /// Decimation level of the tiles, 0 the finest.
    pub level: u8,
    /// Size in cells.
    pub size: FieldSize,
    /// A whole height in cells that no sample exceeds.
    pub top: i32,
    /// Coarse fallback where a tile has not arrived; none where ticks wait for their tiles.
    pub fallback: Option<Fallback>,
    /// Millimetres of the arm's tip a cell.
    pub cell_mm: f32,
    /// The point of the terrain that is at the tip in the home pose.
    pub home: GridPoint,
    /// Spring and limit.
    pub params: SurfaceParams,
    /// Source of the haptic interface point (HIP).
    pub source: Source,
    /// On an emulated board: let its clock stand still while the host owes a
    /// tile, so that a slow host machine makes no difference to the contact.
    pub hold_clock: bool,
    /// The check sum of the table of its materials
    /// ([`MaterialTable::check_sum`](crate::force::MaterialTable::check_sum)); none where all
    /// of it is of one material, that of the surface parameters. Tiles of a scene with materials carry a
    /// material for each sample, but for its fallback.
    pub materials: Option<u32>,
}

impl Scene {
    /// Returns true if every number is one that the loop can work with.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let top_ok = self.top.unsigned_abs() <= MAX_CELL.unsigned_abs() + 1;
        let cell_ok = self.cell_mm.is_finite() && self.cell_mm > 0.0;
        // Points are answered from the tiles alone, so that no answer depends on what came when.
        let fallback_ok = self.fallback.is_none_or(|fallback| {
            fallback.is_valid(self.level) && self.source == Source::Encoders
        });
        self.size.is_valid() && top_ok && cell_ok && fallback_ok && self.params.is_valid()
    }
}

/// Another view of the terrain for an arm that stays armed: another place, scale, height
/// or stiffness. It is put in while the clutch is open, and rendered when that has closed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneChange {
    /// Counts the views of a scene from 1 on, wrapping; samples carry it.
    pub number: u8,
    /// The field, its scale and the surface parameters. Its home is where the device would begin if it
    /// were restarted; while it runs the home follows from [`SceneChange::hip`].
    pub scene: Scene,
    /// The haptic interface point in the view, cells, for the tip where it was when the clutch
    /// opened, or where it is when that closes ([`ClutchHold`](crate::clutch::ClutchHold)). In contact
    /// its height is the device's: as deep as before.
    pub hip: GridPoint,
    /// True if the tiles that the device holds are those of this scene: only place and surface
    /// differ.
    pub keeps_tiles: bool,
}

/// Time for which the mark pin of a board is high, ms.
pub const MARK_PULSE_MS: u32 = 10;
/// Time for which it is low after that, ms, before another mark is taken.
pub const MARK_GAP_MS: u32 = 10;

/// A haptic interface point (HIP) for one tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HipCommand {
    /// Number, repeated in the answer.
    pub seq: u32,
    /// The HIP, cells over the terrain.
    pub hip: GridPoint,
}

/// One tick's record; not a sample of the terrain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TickRecord {
    /// Tick since the scene was taken.
    pub tick: u32,
    /// Haptic interface point (HIP), cells over the terrain.
    pub hip: GridPoint,
    /// Proxy, cells over the terrain.
    pub proxy: GridPoint,
    /// Force commanded, newtons: east, north, up. Zero unless the amplifiers
    /// are on; in a replay, that of the scene's surface parameters.
    pub force_n: Vec3,
    /// The view in which this was rendered ([`SceneChange::number`]); 0 for the scene as it was taken.
    pub view: u8,
    /// State of the proxy.
    pub state: ContactState,
    /// The tile without which the tick could not be completed.
    pub missing_tile: Option<TileIndex>,
    /// Progress of arming.
    pub mode: Mode,
    /// Reasons for a force below that of the scene.
    pub limits: Limits,
    /// Latched fault.
    pub fault: Option<Fault>,
    /// Units of contact work spent.
    pub work: u32,
    /// Cost of the tick before this one, clock ticks.
    pub cost: u32,
    /// Maximum cost of a tick, clock ticks.
    pub worst_cost: u32,
    /// Number of ticks that began or ended too late.
    pub late: u32,
}

/// The state of the loop: the guard's, and what was measured and driven.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Health {
    /// The guard.
    pub report: Report,
    /// Encoders and safety inputs.
    pub sense: GuardInputs,
    /// The counts of the zero pose, once the arm was zeroed.
    pub zero: Option<[i32; 3]>,
    /// Joint angles by the calibration, rad; as if zeroed at zero counts where
    /// that has not been done.
    pub angles_rad: Vec3,
    /// Motor currents commanded, A.
    pub currents_a: Vec3,
    /// Winding temperatures by the thermal model, °C.
    pub winding_c: Vec3,
    /// Energy that the ticks have created at the tip and that was not taken back yet, mJ; zero
    /// where the passivity controller is off.
    pub created_mj: f32,
}
