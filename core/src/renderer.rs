//! The force of a HIP in a scene: contact and all effects, put together once. The arm's tick and
//! replay both use it.
//!
//! ```text
//! HIP ─▶ contact ─▶ shading, material, texture ─▶ spring ─▶ clutch's share ─▶ damping, controller
//!           ▲                   │
//!           └──── friction ─────┘ of the material in force, from the next tick on
//! ```

use glam::Vec3;

use crate::contact::{Contact, ContactSettings};
use crate::force::{EffectContext, Effects, MaterialTable, Moment, Shares};
use crate::grid::GridPoint;
use crate::guard::Guard;
use crate::phantom::{Kinematics, Pose, to_terrain_frame};
use crate::rate::TickRate;
use crate::scene::{Scene, Source};
use crate::terrain::{TileIndex, Window};

/// Tiles that one point of a replay may ask for, for each that the window holds.
const TILES_PER_SLOT: u32 = 4;

/// Source of the HIP's motion.
#[derive(Clone, Copy)]
pub(crate) enum Mover<'a> {
    /// The host's points, each rendered with all of the terrain that it needs.
    Points,
    /// An arm.
    Arm {
        /// The guard, with velocity, last force and shares.
        guard: &'a Guard,
        /// The arm's settings.
        mechanism: &'a Kinematics,
        /// Its pose.
        pose: &'a Pose,
        /// The clutch's share of the force.
        clutch: f32,
    },
}

impl Mover<'_> {
    const fn clutch(&self) -> f32 {
        match self {
            Self::Points => 1.0,
            Self::Arm { clutch, .. } => *clutch,
        }
    }

    /// The inputs of damping and controller; none while no force follows the spring: with the
    /// amplifiers off, while the last force goes out, and with an open clutch.
    fn moment(&self, displacement_mm: Vec3, moved_mm: Vec3, rate: TickRate) -> Option<Moment> {
        Some(match *self {
            Self::Points => Moment {
                displacement_mm,
                moved_mm,
                velocity_mm_s: moved_mm * rate.hz() as f32,
                asked_n: Vec3::ZERO,
                most_n: 0.0,
                shares: Shares::ALL,
            },
            Self::Arm {
                guard,
                mechanism,
                pose,
                clutch,
            } => {
                let [ramp, speed] = guard.shares().filter(|_| clutch > 0.0)?;
                Moment {
                    displacement_mm,
                    moved_mm,
                    velocity_mm_s: to_terrain_frame(guard.tip_velocity_mm_s(mechanism, pose)),
                    asked_n: guard.force_n(),
                    most_n: guard.most_force_n(),
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

/// State that a tick changes.
#[derive(Clone)]
struct RenderState {
    contact: Contact,
    /// Effects of the scene, if any.
    effects: Option<Effects>,
    /// The HIP of the last tick that was done and driven.
    before: Option<GridPoint>,
}

/// A replay's point that is not done.
struct BegunPoint {
    /// The state before it.
    before: RenderState,
    /// Number of times that it lacked another tile.
    lacked: u32,
    /// The last tile that it lacked.
    tile: Option<TileIndex>,
}

/// Progress of a replay's point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Progress {
    /// The point was rendered: without this tile where it needs more than the window holds.
    Done(Option<TileIndex>),
    /// Work is left for the next tick.
    GoesOn,
    /// A tile is missing: the point will be rendered again, from the state before it.
    Lacks(TileIndex),
}

/// Contact and effects of the scene in force.
pub(crate) struct Renderer {
    state: RenderState,
    /// A replay's point that is not done.
    point: Option<BegunPoint>,
    progress: Progress,
    rate: TickRate,
    /// From the beginning of a tick until its force acts, s.
    latency_s: f32,
    /// The materials of the next scene that has some, and their check sum.
    materials: MaterialTable,
    materials_sum: u32,
}

impl Renderer {
    /// Without a scene.
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

    /// Takes a table of materials for the next scene.
    pub(crate) fn take_materials(&mut self, table: &MaterialTable) {
        self.materials_sum = table.check_sum();
        self.materials.clone_from(table);
    }

    /// Returns true if a scene's numbers are valid and its materials are here.
    pub(crate) fn can_take(&self, scene: &Scene) -> bool {
        let is_here = |sum: u32| sum == self.materials_sum && self.materials.is_valid();
        scene.is_valid() && scene.materials.is_none_or(is_here)
    }

    /// Takes a scene that it can take, or none. The one door for all effects. `landing` is the HIP
    /// of another view, and the displacement with which the proxy begins on its surface, cells.
    pub(crate) fn take(&mut self, scene: Option<&Scene>, landing: Option<(GridPoint, Vec3)>) {
        self.state.effects = scene.and_then(|scene| self.effects_of(scene));
        self.begin(scene, landing);
    }

    /// Begins the contact of the same scene anew: the HIP is somewhere else.
    pub(crate) fn restart(&mut self, scene: Option<&Scene>) {
        self.begin(scene, None);
    }

    fn begin(&mut self, scene: Option<&Scene>, landing: Option<(GridPoint, Vec3)>) {
        let settings = ContactSettings::AT_1_KHZ
            .at_rate(self.rate)
            .on_cells_of(scene.map_or(1.0, |scene| scene.cell_mm));
        (self.point, self.progress) = (None, Progress::Done(None));
        self.state.contact = match landing {
            Some((hip, displacement)) => {
                let at = GridPoint::new(hip.cell(), hip.frac() + displacement);
                Contact::landing(settings, at, displacement)
            }
            None => Contact::new(settings),
        };
        if let Some(scene) = scene {
            if scene.materials.is_some() {
                // A proxy that meets its first rough material has to know where it was before.
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

    /// The force that a HIP wants, N, terrain frame: one tick.
    #[inline(always)]
    pub(crate) fn step<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        scene: &Scene,
        hip: GridPoint,
        mover: &Mover<'_>,
    ) -> Vec3 {
        self.state.contact.step(window, &hip);
        self.force_n(window, scene, hip, mover)
    }

    /// The same for a replay's point, as a transaction: where a tile is missing, nothing has
    /// happened but that it is asked for. A point that needs more tiles than the window holds is
    /// rendered as for an arm, with those that are here.
    #[inline(never)]
    pub(crate) fn step_to_point<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        scene: &Scene,
        hip: GridPoint,
    ) -> Vec3 {
        let state = &self.state;
        let point = self.point.get_or_insert_with(|| BegunPoint {
            before: state.clone(),
            lacked: 0,
            tile: None,
        });
        let (lacked, last) = (point.lacked, point.tile);
        // Where the HIP is follows from the point.
        let _ = self.state.contact.land(window);
        let output = *self.state.contact.step(window, &hip);
        let may_lack = lacked < TILES_PER_SLOT * (D * D) as u32;
        let missing = output.missing_tile.filter(|_| may_lack);
        if missing.is_none() && !output.converged {
            self.state.contact.resume(point.before.contact.output());
            self.progress = Progress::GoesOn;
            return Vec3::ZERO;
        }
        let force_n = match missing {
            Some(_) => Vec3::ZERO,
            None => self.force_n(window, scene, hip, &Mover::Points),
        };
        let Some(tile) = missing.or_else(|| self.missing().filter(|_| may_lack)) else {
            self.point = None;
            self.progress = Progress::Done(last.filter(|_| !may_lack));
            return force_n;
        };
        if let Some(point) = &mut self.point {
            point.lacked += u32::from(self.progress != Progress::Lacks(tile));
            point.tile = Some(tile);
            self.state = point.before.clone();
        }
        self.progress = Progress::Lacks(tile);
        Vec3::ZERO
    }

    fn force_n<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        scene: &Scene,
        hip: GridPoint,
        mover: &Mover<'_>,
    ) -> Vec3 {
        match self.state.effects {
            Some(_) => self.with_effects(window, scene, hip, mover),
            None => {
                let displacement_mm = self.contact().output().displacement * scene.cell_mm;
                scene.params.spring().force_n(displacement_mm) * mover.clutch()
            }
        }
    }

    // Apart, so that the tick of a scene without effects has nothing of them.
    #[cold]
    #[inline(never)]
    fn with_effects<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        scene: &Scene,
        hip: GridPoint,
        mover: &Mover<'_>,
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
        let spring_n = spring.force_n(displacement_mm) * mover.clutch();
        if let Some(friction) = effects.friction() {
            contact.set_friction(friction);
        }
        let Some(damper) = &mut effects.damper else {
            return spring_n;
        };
        let moved = before.map_or(Vec3::ZERO, |before| before.to(&hip));
        match mover.moment(displacement_mm, moved * scene.cell_mm, self.rate) {
            Some(moment) => {
                *before = Some(hip);
                damper.observe(&moment);
                damper.force_n(spring_n, moment.velocity_mm_s)
            }
            None => {
                damper.rest();
                *before = None;
                spring_n
            }
        }
    }

    /// The contact of the last tick.
    pub(crate) const fn contact(&self) -> &Contact {
        &self.state.contact
    }

    /// The same, for the clutch and for tiles that move the surface.
    pub(crate) const fn contact_mut(&mut self) -> &mut Contact {
        &mut self.state.contact
    }

    /// Returns true if the scene adds something to the spring's force.
    pub(crate) const fn has_effects(&self) -> bool {
        self.state.effects.is_some()
    }

    /// A tile without which the last force is not that of the whole terrain, besides the contact's.
    fn missing(&self) -> Option<TileIndex> {
        self.state.effects.as_ref().and_then(Effects::missing)
    }

    /// The tile that the last tick lacked, of an arm or a point.
    pub(crate) fn missing_tile(&self) -> Option<TileIndex> {
        match self.progress {
            Progress::Lacks(tile) | Progress::Done(Some(tile)) => Some(tile),
            Progress::Done(None) | Progress::GoesOn => {
                let missing = self.contact().output().missing_tile;
                missing.or_else(|| self.missing())
            }
        }
    }

    /// Returns true if a replay's point was rendered.
    pub(crate) fn is_done(&self) -> bool {
        matches!(self.progress, Progress::Done(_))
    }

    /// The energy that the ticks have created and that was not taken back yet, mJ.
    pub(crate) fn created_mj(&self) -> f32 {
        let effects = self.state.effects.as_ref();
        let damper = effects.and_then(|it| it.damper.as_ref());
        damper.map_or(0.0, |damper| damper.created_mj())
    }
}
