//! The force of a HIP in a scene: contact and all effects, put together once. The arm's tick and
//! replay both use it.
//!
//! ```text
//! HIP ─▶ contact ─▶ shading, material, texture ─▶ spring ─▶ clutch's share ─▶ damping, controller
//!           ▲                   │
//!           └──── friction ─────┘ of the material in force, from the next tick on
//! ```

use glam::Vec3;

use crate::contact::{Contact, ContactSettings, Execution};
use crate::force::{Effects, FeltWith, MaterialTable, Moment, Shares};
use crate::grid::GridPoint;
use crate::guard::Guard;
use crate::phantom::{Mechanism, Pose, to_terrain_frame};
use crate::rate::TickRate;
use crate::scene::{Scene, Source};
use crate::terrain::{TileIndex, Window};

/// What moves the HIP.
#[derive(Clone, Copy)]
pub(crate) enum Mover<'a> {
    /// The host's points, one a tick. A tick is repeated until it is done.
    Points,
    /// An arm.
    Arm {
        /// The guard, which knows velocity, last force and shares.
        guard: &'a Guard,
        /// The arm's settings.
        mechanism: &'a Mechanism,
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

/// Contact and effects of the scene in force.
pub(crate) struct Feel {
    contact: Contact,
    /// What the scene adds to the spring's force, if anything.
    effects: Option<Effects>,
    /// The HIP of the last tick that was done and driven.
    before: Option<GridPoint>,
    rate: TickRate,
    /// From the beginning of a tick until its force acts, s.
    latency_s: f32,
    /// The materials of the next scene that has some, and their check sum.
    materials: MaterialTable,
    materials_sum: u32,
}

impl Feel {
    /// Without a scene.
    pub(crate) fn new(rate: TickRate, latency_s: f32) -> Self {
        Self {
            contact: Contact::new(ContactSettings::REAL_TIME.at_rate(rate)),
            effects: None,
            before: None,
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

    /// Takes a scene that it can take, or none. The one door for all effects. `landing` is the HIP of
    /// another view, and the displacement with which the proxy begins on its surface, cells.
    pub(crate) fn take(&mut self, scene: Option<&Scene>, landing: Option<(GridPoint, Vec3)>) {
        self.effects = scene.and_then(|scene| self.effects_of(scene));
        self.begin(scene, landing);
    }

    /// Begins the contact of the same scene anew: the HIP is somewhere else.
    pub(crate) fn restart(&mut self, scene: Option<&Scene>) {
        self.begin(scene, None);
    }

    fn begin(&mut self, scene: Option<&Scene>, landing: Option<(GridPoint, Vec3)>) {
        let is_replay = scene.is_some_and(|scene| scene.source == Source::Points);
        let settings = ContactSettings {
            rule: scene.map_or_else(Default::default, |scene| scene.rule),
            execution: match is_replay {
                true => Execution::LockStep,
                false => Execution::RealTime,
            },
            ..ContactSettings::REAL_TIME.at_rate(self.rate)
        };
        self.contact = match landing {
            Some((hip, stretch)) => {
                let at = GridPoint::new(hip.cell(), hip.frac() + stretch);
                Contact::landing(settings, at, stretch)
            }
            None => Contact::new(settings),
        };
        if let Some(scene) = scene {
            if scene.materials.is_some() {
                // A proxy that meets its first rough material has to know where it was before.
                self.contact.feels_friction(self.materials.some_friction());
            }
            let law = self
                .effects
                .as_ref()
                .map_or(&scene.law, |it| it.law(&scene.law));
            self.contact.feels_friction(law.friction);
        }
        self.before = None;
    }

    fn effects_of(&self, scene: &Scene) -> Option<Effects> {
        let felt = FeltWith {
            cell_mm: scene.cell_mm,
            rate: self.rate,
            latency_s: self.latency_s,
            arm: scene.source == Source::Encoders,
        };
        match scene.materials {
            Some(_) => Effects::with_materials(&self.materials, &scene.law, &felt),
            None => Effects::of(&scene.law, &felt),
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
        match mover {
            Mover::Points => self.step_to_point(window, &hip),
            Mover::Arm { .. } => drop(self.contact.step(window, &hip)),
        }
        match self.effects {
            Some(_) => self.with_effects(window, scene, hip, mover),
            None => {
                let displacement_mm = self.contact.output().displacement * scene.cell_mm;
                scene.law.spring().force_n(displacement_mm) * mover.clutch()
            }
        }
    }

    /// A repeated tick that only waits for a tile of an effect has its contact.
    fn step_to_point<const D: usize>(&mut self, window: &Window<'_, D>, hip: &GridPoint) {
        if self.missing().is_none() || !self.contact.has_answered(hip) {
            // Where the HIP is follows from the point.
            let _ = self.contact.land(window);
            self.contact.step(window, hip);
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
        let Some(effects) = &mut self.effects else {
            return Vec3::ZERO;
        };
        let displacement = effects.displacement(window, &self.contact, &self.materials);
        let displacement_mm = displacement * scene.cell_mm;
        let spring = effects.law(&scene.law).spring();
        let spring_n = spring.force_n(displacement_mm) * mover.clutch();
        let is_done = self.contact.is_felt()
            && (effects.missing().is_none() || !self.contact.is_in_lock_step());
        if is_done && let Some(friction) = effects.friction() {
            self.contact.feels_friction(friction);
        }
        let Some(damper) = &mut effects.damper else {
            return spring_n;
        };
        let moved = self.before.map_or(Vec3::ZERO, |before| before.to(&hip));
        match mover.moment(displacement_mm, moved * scene.cell_mm, self.rate) {
            Some(moment) => {
                if is_done {
                    self.before = Some(hip);
                }
                damper.observe(&moment);
                damper.force_n(spring_n, moment.velocity_mm_s)
            }
            None => {
                damper.rest();
                self.before = None;
                spring_n
            }
        }
    }

    /// The contact of the last tick.
    pub(crate) const fn contact(&self) -> &Contact {
        &self.contact
    }

    /// The same, for the clutch and for tiles that move the surface.
    pub(crate) const fn contact_mut(&mut self) -> &mut Contact {
        &mut self.contact
    }

    /// Returns true if the scene adds something to the spring's force.
    pub(crate) const fn has_effects(&self) -> bool {
        self.effects.is_some()
    }

    /// A tile without which the last force is not that of the whole terrain, besides the contact's.
    pub(crate) fn missing(&self) -> Option<TileIndex> {
        self.effects.as_ref().and_then(Effects::missing)
    }

    /// Returns true if a replay's tick is done.
    pub(crate) fn is_done(&self) -> bool {
        self.contact.output().converged && self.missing().is_none()
    }

    /// The energy that the ticks have created and that was not taken back yet, mJ.
    pub(crate) fn created_mj(&self) -> f32 {
        let damper = self.effects.as_ref().and_then(|it| it.damper.as_ref());
        damper.map_or(0.0, |damper| damper.created_mj())
    }
}
