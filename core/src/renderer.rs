//! The force of a HIP in a scene: contact and all effects, combined in one place for the arm's tick
//! and for replay.
//!
//! ```text
//! HIP ─▶ contact ─▶ shading, material, texture ─▶ spring ─▶ clutch's share ─▶ damping, controller
//!           ▲                   │
//!           └──── friction ─────┘ of the current material, from the next tick on
//! ```

use glam::Vec3;

use crate::contact::{Contact, ContactSettings};
use crate::force::{EffectContext, Effects, MaterialTable, PassivityInputs, Shares};
use crate::grid::GridPoint;
use crate::guard::Guard;
use crate::phantom::{Kinematics, Pose, to_terrain_frame};
use crate::rate::TickRate;
use crate::scene::{Scene, Source};
use crate::terrain::{TileIndex, Window};

/// Maximum number of tiles that one point of a replay may request, per slot of the window.
const TILES_PER_SLOT: u32 = 4;

/// Source of the HIP's motion.
#[derive(Clone, Copy)]
pub(crate) enum MotionSource<'a> {
    /// The host's points, each rendered with all of the terrain that it needs.
    Points,
    /// An arm.
    Arm {
        /// The guard, with velocity, last force and shares.
        guard: &'a Guard,
        /// The arm's settings.
        mechanism: &'a Kinematics,
        /// The arm's pose.
        pose: &'a Pose,
        /// The clutch's share of the force.
        clutch: f32,
    },
}

impl MotionSource<'_> {
    const fn clutch(&self) -> f32 {
        match self {
            Self::Points => 1.0,
            Self::Arm { clutch, .. } => *clutch,
        }
    }

    /// Returns the inputs of damping and passivity controller; `None` while no force follows the
    /// spring: with the amplifiers off, while the last force ramps down, or with an open clutch.
    fn passivity_inputs(
        &self,
        displacement_mm: Vec3,
        moved_mm: Vec3,
        rate: TickRate,
    ) -> Option<PassivityInputs> {
        Some(match *self {
            Self::Points => PassivityInputs {
                displacement_mm,
                moved_mm,
                velocity_mm_s: moved_mm * rate.hz() as f32,
                commanded_n: Vec3::ZERO,
                max_n: 0.0,
                shares: Shares::ALL,
            },
            Self::Arm {
                guard,
                mechanism,
                pose,
                clutch,
            } => {
                let [ramp, speed] = guard.shares().filter(|_| clutch > 0.0)?;
                PassivityInputs {
                    displacement_mm,
                    moved_mm,
                    velocity_mm_s: to_terrain_frame(guard.tip_velocity_mm_s(mechanism, pose)),
                    commanded_n: guard.force_n(),
                    max_n: guard.max_force_n(),
                    shares: Shares {
                        clutch,
                        ramp,
                        speed,
                    },
                }
            }
        })
    }
}

/// Contact that continues in another placement.
#[derive(Clone, Copy)]
pub(crate) struct ContactOnset {
    /// Place over or under the surface; the height does not count.
    pub at: GridPoint,
    /// Vector from the HIP to the proxy, cells.
    pub displacement: Vec3,
    /// Share of the force at the start.
    pub fade: f32,
}

/// State that a tick changes.
#[derive(Clone)]
struct RenderState {
    contact: Contact,
    /// Effects of the scene, if any.
    effects: Option<Effects>,
    /// The HIP of the last completed tick whose force followed the spring.
    before: Option<GridPoint>,
}

/// A point of a replay in progress.
struct PointInProgress {
    /// The state before it.
    before: RenderState,
    /// Number of times that another tile was missing.
    missing_count: u32,
    /// The last missing tile.
    tile: Option<TileIndex>,
}

/// Progress of a replay's point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Progress {
    /// The point was rendered; without this tile, if it needs more tiles than the window stores.
    Done(Option<TileIndex>),
    /// Work is left for the next tick.
    Continue,
    /// A tile is missing: the point will be rendered again, from the state before it.
    MissingTile(TileIndex),
}

/// Contact and effects of the current scene.
pub(crate) struct Renderer {
    state: RenderState,
    /// A point of a replay in progress.
    point: Option<PointInProgress>,
    progress: Progress,
    rate: TickRate,
    /// Time from the start of a tick until its force acts, s.
    latency_s: f32,
    /// The materials of the next scene with materials, and their check sum.
    materials: MaterialTable,
    materials_sum: u32,
}

impl Renderer {
    /// Creates a renderer without a scene.
    pub(crate) fn new(rate: TickRate, latency_s: f32) -> Self {
        Self {
            state: RenderState {
                contact: Contact::new(ContactSettings::AT_1_KHZ.at_rate(rate)),
                effects: None,
                before: None,
            },
            point: None,
            progress: Progress::Done(None),
            rate,
            latency_s,
            materials: MaterialTable::EMPTY,
            materials_sum: MaterialTable::EMPTY.check_sum(),
        }
    }

    /// Stores the table of materials for the next scene.
    pub(crate) fn set_materials(&mut self, table: &MaterialTable) {
        self.materials_sum = table.check_sum();
        self.materials.clone_from(table);
    }

    /// Returns true if a scene's numbers are valid and its materials are stored.
    pub(crate) fn can_render(&self, scene: &Scene) -> bool {
        let is_here = |sum: u32| sum == self.materials_sum && self.materials.is_valid();
        scene.is_valid() && scene.materials.is_none_or(is_here)
    }

    /// Sets a scene that [`Self::can_render`] accepts, or none. All effects are created here.
    /// `onset` is the contact that continues after a change of placement.
    pub(crate) fn set_scene(&mut self, scene: Option<&Scene>, onset: Option<ContactOnset>) {
        self.state.effects = scene.and_then(|scene| self.effects_of(scene));
        self.restart_contact(scene, onset);
    }

    /// Restarts the contact in the same scene, because the HIP has jumped.
    pub(crate) fn restart(&mut self, scene: Option<&Scene>) {
        self.restart_contact(scene, None);
    }

    fn restart_contact(&mut self, scene: Option<&Scene>, onset: Option<ContactOnset>) {
        let settings = ContactSettings::AT_1_KHZ
            .at_rate(self.rate)
            .on_cells_of(scene.map_or(1.0, |scene| scene.cell_mm));
        (self.point, self.progress) = (None, Progress::Done(None));
        self.state.contact = match onset {
            Some(ContactOnset {
                at,
                displacement,
                fade,
            }) => Contact::onset(settings, at, displacement, fade),
            None => Contact::new(settings),
        };
        if let Some(scene) = scene {
            if scene.materials.is_some() {
                // On its first material with friction a proxy needs its previous position.
                let friction = self.materials.some_friction();
                self.state.contact.set_friction(friction);
            }
            let params = self
                .state
                .effects
                .as_ref()
                .map_or(&scene.params, |it| it.params(&scene.params));
            self.state.contact.set_friction(params.friction);
        }
        self.state.before = None;
    }

    fn effects_of(&self, scene: &Scene) -> Option<Effects> {
        let context = EffectContext {
            cell_mm: scene.cell_mm,
            rate: self.rate,
            latency_s: self.latency_s,
            arm: scene.source == Source::Encoders,
        };
        match scene.materials {
            Some(_) => Effects::with_materials(&self.materials, &scene.params, &context),
            None => Effects::of(&scene.params, &context),
        }
    }

    /// Runs one tick. Returns the requested force at a HIP, N, terrain frame.
    #[inline(always)]
    pub(crate) fn step<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        scene: &Scene,
        hip: GridPoint,
        motion: &MotionSource<'_>,
    ) -> Vec3 {
        self.state.contact.step(window, &hip);
        self.force_n(window, scene, hip, motion)
    }

    /// Runs one tick for a point of a replay, as a transaction: if a tile is missing, it is
    /// requested and the state stays as it was. A point that needs more tiles than the window
    /// stores is rendered with the stored ones, as for an arm.
    #[inline(never)]
    pub(crate) fn step_to_point<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        scene: &Scene,
        hip: GridPoint,
    ) -> Vec3 {
        let state = &self.state;
        let point = self.point.get_or_insert_with(|| PointInProgress {
            before: state.clone(),
            missing_count: 0,
            tile: None,
        });
        let (missing_count, last) = (point.missing_count, point.tile);
        // The HIP is the point's, not the one that the contact onset returns.
        let _ = self.state.contact.place_on_surface(window);
        let output = *self.state.contact.step(window, &hip);
        let may_request = missing_count < TILES_PER_SLOT * (D * D) as u32;
        let missing = output.missing_tile.filter(|_| may_request);
        if missing.is_none() && !output.converged {
            self.state.contact.resume(point.before.contact.output());
            self.progress = Progress::Continue;
            return Vec3::ZERO;
        }
        let force_n = match missing {
            Some(_) => Vec3::ZERO,
            None => self.force_n(window, scene, hip, &MotionSource::Points),
        };
        let Some(tile) = missing.or_else(|| self.missing().filter(|_| may_request)) else {
            self.point = None;
            self.progress = Progress::Done(last.filter(|_| !may_request));
            return force_n;
        };
        if let Some(point) = &mut self.point {
            point.missing_count += u32::from(self.progress != Progress::MissingTile(tile));
            point.tile = Some(tile);
            self.state = point.before.clone();
        }
        self.progress = Progress::MissingTile(tile);
        Vec3::ZERO
    }

    fn force_n<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        scene: &Scene,
        hip: GridPoint,
        motion: &MotionSource<'_>,
    ) -> Vec3 {
        match self.state.effects {
            Some(_) => self.with_effects(window, scene, hip, motion),
            None => {
                let displacement_mm = self.contact().output().displacement * scene.cell_mm;
                scene.params.spring().force_n(displacement_mm) * motion.clutch()
            }
        }
    }

    // Not inlined: the tick of a scene without effects does not need it.
    #[cold]
    #[inline(never)]
    fn with_effects<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        scene: &Scene,
        hip: GridPoint,
        motion: &MotionSource<'_>,
    ) -> Vec3 {
        let RenderState {
            contact,
            effects,
            before,
        } = &mut self.state;
        let Some(effects) = effects else {
            return Vec3::ZERO;
        };
        let displacement = effects.displacement(window, contact, &self.materials);
        let displacement_mm = displacement * scene.cell_mm;
        let spring = effects.params(&scene.params).spring();
        let spring_n = spring.force_n(displacement_mm) * motion.clutch();
        if let Some(friction) = effects.friction() {
            contact.set_friction(friction);
        }
        let Some(damper) = &mut effects.damper else {
            return spring_n;
        };
        let moved = before.map_or(Vec3::ZERO, |before| before.to(&hip));
        match motion.passivity_inputs(displacement_mm, moved * scene.cell_mm, self.rate) {
            Some(passivity_inputs) => {
                *before = Some(hip);
                damper.observe(&passivity_inputs);
                damper.force_n(spring_n, passivity_inputs.velocity_mm_s)
            }
            None => {
                damper.reset();
                *before = None;
                spring_n
            }
        }
    }

    /// Returns the contact of the last tick.
    pub(crate) const fn contact(&self) -> &Contact {
        &self.state.contact
    }

    /// Returns the contact, for the clutch and for tiles that move the surface.
    pub(crate) const fn contact_mut(&mut self) -> &mut Contact {
        &mut self.state.contact
    }

    /// Returns true if the scene has effects.
    pub(crate) const fn has_effects(&self) -> bool {
        self.state.effects.is_some()
    }

    /// Returns a tile that was missing for the last tick's effects, if any.
    fn missing(&self) -> Option<TileIndex> {
        self.state.effects.as_ref().and_then(Effects::missing)
    }

    /// Returns the tile that was missing in the last tick, for an arm or a point.
    pub(crate) fn missing_tile(&self) -> Option<TileIndex> {
        match self.progress {
            Progress::MissingTile(tile) | Progress::Done(Some(tile)) => Some(tile),
            Progress::Done(None) | Progress::Continue => {
                let missing = self.contact().output().missing_tile;
                missing.or_else(|| self.missing())
            }
        }
    }

    /// Returns true if a replay's point was rendered.
    pub(crate) fn is_done(&self) -> bool {
        matches!(self.progress, Progress::Done(_))
    }

    /// Returns the energy leak that is not dissipated yet, mJ.
    pub(crate) fn created_mj(&self) -> f32 {
        let effects = self.state.effects.as_ref();
        let damper = effects.and_then(|it| it.damper.as_ref());
        damper.map_or(0.0, |damper| damper.created_mj())
    }
}
