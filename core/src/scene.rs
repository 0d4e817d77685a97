//! Input of a tick (scene, points) and its report (records, health).
//!
//! These types are inputs and outputs of the tick, and are sent on the link unchanged: a change to
//! one of them needs a new protocol version.

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

/// A field, its placement under the arm, and its surface parameters. It is validated as a whole
/// before use.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Identifier of this field, placement and surface parameters; tile messages repeat it.
    pub epoch: u32,
    /// Decimation level of the tiles, 0 the finest.
    pub level: u8,
    /// Size in cells.
    pub size: FieldSize,
    /// Upper bound of all samples, whole cells.
    pub top: i32,
    /// Coarse fallback for tiles that have not arrived; `None` if ticks wait for their tiles.
    pub fallback: Option<Fallback>,
    /// Device millimetres per cell.
    pub cell_mm: f32,
    /// Point of the terrain at the tip in the home pose.
    pub home: GridPoint,
    /// Stiffness, friction, damping, texture and shading.
    pub params: SurfaceParams,
    /// Source of the haptic interface point (HIP).
    pub source: Source,
    /// True if an emulated board stops its clock while a requested tile is missing, so that a slow
    /// host machine does not affect the contact.
    pub hold_clock: bool,
    /// Check sum of the scene's table of materials
    /// ([`MaterialTable::check_sum`](crate::force::MaterialTable::check_sum)); `None` if the
    /// surface parameters are its only material. Tiles of a scene with materials have a material
    /// for each sample; its fallback has none.
    pub materials: Option<u32>,
}

impl Scene {
    /// Returns true if every number is valid for the loop.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let top_ok = self.top.unsigned_abs() <= MAX_CELL.unsigned_abs() + 1;
        let cell_ok = self.cell_mm.is_finite() && self.cell_mm > 0.0;
        // A point is rendered from tiles alone, so that its answer does not depend on when they
        // arrived.
        let fallback_ok = self.fallback.is_none_or(|fallback| {
            fallback.is_valid(self.level) && self.source == Source::Encoders
        });
        self.size.is_valid() && top_ok && cell_ok && fallback_ok && self.params.is_valid()
    }
}

/// Change of placement for an arm that stays armed: another place, scale, height or stiffness.
///
/// It is set while the clutch is open, and rendered when the clutch closes. With
/// [`Self::in_contact`] it is rendered under the pressing hand, from the present force on, as soon
/// as the fallback of the new scene has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneChange {
    /// Number of the placement in its scene, from 1, wrapping; tick records repeat it.
    pub number: u8,
    /// The field, its scale and the surface parameters. A restarted device starts at its home; a
    /// running device computes its position from [`SceneChange::hip`].
    pub scene: Scene,
    /// The haptic interface point (HIP) in the new placement, cells, for the tip's position when
    /// the clutch opened, or when it closes ([`ClutchMode`](crate::clutch::ClutchMode)). In contact
    /// the device sets its height: as deep as before.
    pub hip: GridPoint,
    /// True if the tiles on the device stay valid: only place and surface parameters differ.
    pub keeps_tiles: bool,
    /// Set for a change under a pressing hand, with the clutch closed: where the new placement is
    /// touched.
    pub in_contact: Option<ContactMap>,
}

impl SceneChange {
    /// Maximum ratio of the force before a change under a pressing hand to that of the new surface.
    pub const MAX_FORCE_RATIO: f32 = 10.0;

    /// Returns true if the force can turn from a surface's to that of this placement under a
    /// pressing hand. Otherwise the clutch has to be open.
    #[must_use]
    pub fn may_turn_from(&self, before: &SurfaceParams) -> bool {
        let after = &self.scene.params;
        let [soft, hard] = [before, after].map(|params| params.stiffness_n_per_mm);
        // With tiles that blend, the force would rise as fast as they do.
        let is_harder = hard > soft || after.max_force_n > before.max_force_n;
        (self.keeps_tiles || !is_harder) && soft <= Self::MAX_FORCE_RATIO * hard
    }
}

/// Map of the proxy to the place where a new placement is touched: the point `from` of the old
/// placement is at `to` in the new one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactMap {
    /// The proxy when the host computed the change, cells of the old placement.
    pub from: GridPoint,
    /// The same place, cells of the new placement.
    pub to: GridPoint,
    /// Cells of the new placement for a cell of the old one: east, north and up.
    pub scale: Vec3,
}

impl ContactMap {
    /// Returns the place in the new placement for a proxy of the old one.
    #[must_use]
    pub fn place(&self, proxy: &GridPoint) -> GridPoint {
        // The link can deliver any bits.
        let moved = self.from.normalised().to(proxy) * self.scale;
        GridPoint::new(self.to.cell(), self.to.frac() + moved).normalised()
    }
}

/// Time for which the mark pin of a board is high, ms.
pub const MARK_PULSE_MS: u32 = 10;
/// Time for which the mark pin is low after that, ms, before the next mark.
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
    /// Number of the tick since the scene was set.
    pub tick: u32,
    /// Haptic interface point (HIP), cells over the terrain.
    pub hip: GridPoint,
    /// Proxy, cells over the terrain.
    pub proxy: GridPoint,
    /// Commanded force, newtons: east, north, up. Zero while the amplifiers are off; in a replay,
    /// the force by the scene's surface parameters.
    pub force_n: Vec3,
    /// Number of the rendered placement ([`SceneChange::number`]); 0 for that of the scene.
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
    /// Work units spent by the contact.
    pub work: u32,
    /// Cost of the tick before this one, clock ticks.
    pub cost: u32,
    /// Maximum cost of a tick, clock ticks.
    pub worst_cost: u32,
    /// Number of ticks that began or ended too late.
    pub late: u32,
}

/// State of the loop: the guard, and the measured and commanded values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Health {
    /// The guard.
    pub report: Report,
    /// Encoders and safety inputs.
    pub sense: GuardInputs,
    /// Encoder counts in the zero pose, if the arm was zeroed.
    pub zero: Option<[i32; 3]>,
    /// Joint angles by the calibration, rad; for an arm that was not zeroed, as if zeroed at zero
    /// counts.
    pub angles_rad: Vec3,
    /// Motor currents commanded, A.
    pub currents_a: Vec3,
    /// Winding temperatures by the thermal model, °C.
    pub winding_c: Vec3,
    /// Energy leak at the tip that is not dissipated yet, mJ; zero if the passivity controller is
    /// off.
    pub created_mj: f32,
}
