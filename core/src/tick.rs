//! The tick: one pure function from encoder counts to amplifier currents.
//!
//! It reads nothing and writes nothing but its own state, never blocks, and
//! does a bounded amount of work. Scenes, tiles, points and settings are
//! handed to it between ticks by [`Haptics::accept`] and
//! [`Haptics::configure`].

use glam::Vec3;

use crate::clutch::{Clutch, ClutchHold};
use crate::contact::{Contact, ContactOutput, ContactSettings, Execution, Friction};
use crate::force::{Damper, Effects, FeltWith, MaterialTable, Moment};
use crate::grid::GridPoint;
use crate::guard::thermal::Temperatures;
use crate::guard::{
    Drive, Fault, Guard, Jog, Limits, Mode, Report, SceneKind, Sense, Surroundings,
};
use crate::phantom::{Calibration, Mechanism, Pose, to_device_frame, to_terrain_frame};
use crate::rate::TickRate;
use crate::scalar::smaller;
use crate::scene::{Health, Point, Sample, Scene, Source, View};
use crate::terrain::{SETTLING_MM_S, Tile, TileKey, Window};

/// From the beginning of a tick until its force acts, s, where a board says nothing else.
pub const LATENCY_S: f32 = 0.1e-3;

/// What is handed to the loop between ticks.
pub enum Command<'t> {
    /// A scene, already checked ([`Scene::is_valid`]). The arm is disarmed,
    /// and force that was there goes out gently.
    Scene(Scene),
    /// No scene any more. The arm is disarmed likewise.
    DropScene,
    /// Another view of the scene, already checked. The arm stays armed where the clutch is
    /// open; else it is as another scene.
    View(View),
    /// Hold the clutch, or let it go.
    Clutch(ClutchHold),
    /// The board's clutch input is held from now on, or no longer.
    ClutchInput(bool),
    /// A filled tile.
    Tile(&'t mut Tile),
    /// A haptic interface point for one tick, in a scene fed by points.
    Point(Point),
    /// Arm, once nothing blocks it and the dead-man switch is pressed.
    Arm,
    /// Drop the scene and arm for a jog in its place: a small current in one motor
    /// for a limited time.
    Jog(Jog),
    /// Disarm; force goes out gently.
    Disarm,
    /// These are the counts in the zero pose of the calibration record.
    Zero([i32; 3]),
    /// Clear the latched fault, if it is this one.
    ClearFault(Option<Fault>),
    /// Latch a fault found outside the tick.
    Trip(Fault),
    /// Hold the outputs at these shares of full scale, -1 to 1, with the amplifiers off,
    /// or no longer ([`Guard::hold`]).
    HoldOutputs(Option<[f32; 3]>),
}

/// One tick's result.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// For the amplifiers.
    pub drive: Drive,
    /// For telemetry.
    pub sample: Sample,
    /// The number of the point that this tick answers.
    pub answers: Option<u32>,
}

/// All state of the loop over a window of `D × D` tiles.
///
/// Fed by points, it is a replay: no arm is needed, and no force reaches one.
///
/// ```
/// use hapterra_core::Vec3;
/// use hapterra_core::contact::{ContactState, Rule};
/// use hapterra_core::force::ForceLaw;
/// use hapterra_core::grid::GridPoint;
/// use hapterra_core::guard::Sense;
/// use hapterra_core::rate::TickRate;
/// use hapterra_core::scene::{Point, Scene, Source};
/// use hapterra_core::terrain::{FieldSize, FieldStorage, Tile, TileKey};
/// use hapterra_core::tick::{Command, Haptics};
///
/// let size = FieldSize::new(32, 32);
/// let (mut storage, mut tile) = (FieldStorage::<1>::new(), Tile::VACANT);
/// tile.fill_from(TileKey::new(0, 0, 0), 0, size, |_x, _y| 2.0).expect("in range");
///
/// let mut haptics = Haptics::new(storage.slots(), TickRate::DEFAULT, None);
/// let scene = Scene {
///     epoch: 1,
///     level: 0,
///     size,
///     top: 3,
///     underlay: None,
///     cell_mm: 1.0,
///     home: GridPoint::default(),
///     law: ForceLaw::PREMIUM,
///     rule: Rule::Swept,
///     source: Source::Points,
///     hold_clock: false,
///     materials: None,
/// };
/// assert!(haptics.accept(Command::Scene(scene)).is_none());
/// assert!(haptics.accept(Command::Tile(&mut tile)).is_some());
/// let mut sample = Default::default();
/// for (seq, height) in [(0, 5.0), (1, 1.0)] {
///     let hip = GridPoint::new([10, 10, 0], Vec3::new(0.5, 0.5, height));
///     assert!(haptics.accept(Command::Point(Point { seq, hip })).is_none());
///     let outcome = haptics.tick(&Sense::default(), true);
///     assert_eq!(outcome.answers, Some(seq));
///     sample = outcome.sample;
/// }
/// // One millimetre deep: half a newton up.
/// assert_eq!((sample.state, sample.force_n), (ContactState::Touching, Vec3::Z * 0.5));
/// ```
pub struct Haptics<'t, const D: usize> {
    contact: Contact,
    guard: Guard,
    scene: Option<Scene>,
    clutch: Clutch,
    mechanism: Option<Mechanism>,
    /// Counts in the zero pose, once they are known.
    zero: Option<[i32; 3]>,
    tick: u32,
    rate: TickRate,
    /// From the beginning of a tick until its force acts, s.
    latency_s: f32,
    /// Number of the view that is felt.
    view: u8,
    point: Option<Point>,
    /// Where the point before was, in a scene fed by points.
    before: Option<GridPoint>,
    /// What the scene adds to the spring's force, if anything.
    effects: Option<Effects>,
    window: Window<'t, D>,
    /// The materials of the next scene that has some, and their check sum.
    materials: MaterialTable,
    materials_sum: u32,
}

impl<'t, const D: usize> Haptics<'t, D> {
    /// A loop at this rate without calibration and scene: disarmed, with a
    /// fault that was found at boot.
    #[must_use]
    pub fn new(
        tiles: [[&'t mut Tile; D]; D],
        rate: TickRate,
        found_at_boot: Option<Fault>,
    ) -> Self {
        Self {
            rate,
            latency_s: LATENCY_S,
            window: Window::new(tiles),
            contact: Contact::new(ContactSettings::REAL_TIME.at_rate(rate)),
            guard: Guard::new(rate, found_at_boot),
            mechanism: None,
            zero: None,
            scene: None,
            point: None,
            tick: 0,
            clutch: Clutch::new(rate),
            view: 0,
            effects: None,
            before: None,
            materials: MaterialTable::EMPTY,
            materials_sum: MaterialTable::EMPTY.check_sum(),
        }
    }

    /// Begins with motors as warm as this; [`Haptics::new`] takes them to be as cold as
    /// the air.
    pub fn begin_at(&mut self, temperatures: Temperatures) {
        self.guard.begin_at(temperatures);
    }

    /// States how long after the beginning of a tick its force acts, s: what the board and its
    /// amplifiers take. [`Haptics::new`] takes it to be [`LATENCY_S`].
    pub const fn acts_after(&mut self, latency_s: f32) {
        self.latency_s = latency_s;
    }

    /// The scene in force: the last one that was accepted, unless it was dropped. A scene that
    /// cannot be felt is refused, and the one before stays.
    #[must_use]
    pub const fn scene(&self) -> Option<&Scene> {
        self.scene.as_ref()
    }

    /// Whether a point waits for its answer.
    #[must_use]
    pub const fn has_point(&self) -> bool {
        self.point.is_some()
    }

    /// How warm the motors are: what a board keeps over a reset.
    #[must_use]
    pub const fn temperatures(&self) -> Temperatures {
        self.guard.motors().temperatures()
    }

    /// Takes a command between ticks. Gives back a tile buffer that is free again, if there is
    /// one: most tiles bring one in the place of another, those of an underlay stay besides, and
    /// their buffers come back one by one under a scene that has none.
    #[must_use]
    pub fn accept(&mut self, command: Command<'t>) -> Option<&'t mut Tile> {
        let mut back = None;
        match command {
            Command::Scene(scene) => self.take_scene(Some(scene)),
            Command::DropScene => self.take_scene(None),
            Command::View(view) => self.take_view(&view),
            Command::Clutch(hold) => self.clutch.hold(hold),
            Command::ClutchInput(held) => self.clutch.press(held),
            Command::Tile(tile) => back = self.take_tile(tile),
            Command::Point(Point { seq, hip }) => {
                // Whatever bits came over the wire.
                let hip = hip.normalised();
                self.point = Some(Point { seq, hip });
            }
            Command::Arm => self.guard.arm(),
            Command::Jog(jog) => {
                self.take_scene(None);
                self.guard.jog(jog);
            }
            Command::Disarm => self.guard.disarm(),
            Command::Zero(counts) => self.take_zero(counts),
            Command::ClearFault(seen) => self.guard.clear_seen(seen),
            Command::Trip(fault) => self.guard.trip(fault),
            Command::HoldOutputs(shares) => self.guard.hold(shares),
        }
        back.or_else(|| self.window.take_spare())
    }

    /// Swaps the arm's settings between ticks. Whoever hands them over sees to
    /// it that the arm is disarmed; if it is not, it is switched off.
    pub fn configure(&mut self, mechanism: Mechanism) {
        self.guard.stop();
        self.guard.configure(&mechanism);
        self.mechanism = Some(mechanism);
        self.contact = self.contact_of(self.scene.as_ref());
    }

    /// Takes a table of materials, already checked ([`MaterialTable::is_valid`]): that of the
    /// scene which follows with [`Haptics::accept`] before another tick.
    pub fn take_materials(&mut self, table: &MaterialTable) {
        self.materials_sum = table.check_sum();
        self.materials.clone_from(table);
    }

    /// Whether a scene can be felt: by its numbers, and because its materials are here.
    fn can_take(&self, scene: &Scene) -> bool {
        let is_here = |sum: u32| sum == self.materials_sum && self.materials.is_valid();
        scene.is_valid() && scene.materials.is_none_or(is_here)
    }

    /// A contact that has felt nothing yet, as a scene wants it.
    fn contact_of(&self, scene: Option<&Scene>) -> Contact {
        let mut contact = Contact::new(self.settings_of(scene));
        self.rub(&mut contact);
        contact
    }

    /// Lets the contact of a scene with materials feel the one in force.
    fn rub(&self, contact: &mut Contact) {
        if let Some(friction) = self.effects.as_ref().and_then(Effects::friction) {
            contact.feels_friction(friction);
        }
    }

    /// How a scene is felt: points in lock-step, an arm in real time.
    fn settings_of(&self, scene: Option<&Scene>) -> ContactSettings {
        let rule = scene.map_or_else(Default::default, |scene| scene.rule);
        let from_points = scene.is_some_and(|scene| scene.source == Source::Points);
        ContactSettings {
            rule,
            execution: if from_points {
                Execution::LockStep
            } else {
                Execution::RealTime
            },
            friction: match scene {
                // A contact that was made without friction would never know any.
                Some(Scene {
                    materials: Some(_), ..
                }) => self.materials.some_friction(),
                Some(scene) => scene.law.friction,
                None => Friction::NONE,
            },
            ..ContactSettings::REAL_TIME.at_rate(self.rate)
        }
    }

    /// What a scene adds to the spring's force.
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

    /// Takes a scene, or drops the one there is: force that was there goes out.
    fn take_scene(&mut self, scene: Option<Scene>) {
        match scene {
            Some(scene) if !self.can_take(&scene) => return,
            Some(scene) if scene.source == Source::Points => self.guard.stop(),
            _ => self.guard.disarm(),
        }
        if let Some(scene) = scene {
            self.window.reset(scene.level, scene.size, scene.top);
            self.window.lay(scene.underlay);
            self.tick = 0;
        }
        self.effects = scene.and_then(|scene| self.effects_of(&scene));
        self.contact = self.contact_of(scene.as_ref());
        self.scene = scene;
        (self.point, self.before) = (None, None);
        let of_arm = scene.is_some_and(|scene| scene.source == Source::Encoders);
        self.clutch.begin(self.rate, of_arm);
        self.view = 0;
    }

    /// Puts another view in. Nothing is felt of the change: the clutch of an arm is open,
    /// and in a replay no arm is driven. A proxy that touched begins on the surface
    /// where it was in the hand, as deep as before.
    fn take_view(&mut self, view: &View) {
        let &View { scene, hip, .. } = view;
        let before = self.scene.as_ref();
        let may_change = before.is_some_and(|before| {
            before.source == scene.source
                && (scene.source == Source::Points || self.clutch.is_open())
        });
        let stretch = before
            .zip(self.contact.stretch())
            .map(|(before, stretch)| stretch * (before.cell_mm / scene.cell_mm));
        if !may_change || !self.can_take(&scene) {
            return self.take_scene(Some(scene));
        }
        if !view.keeps_tiles {
            self.window.reset(scene.level, scene.size, scene.top);
        }
        let has_other_underlay = before.is_none_or(|before| before.underlay != scene.underlay);
        if has_other_underlay || !view.keeps_tiles {
            self.window.lay(scene.underlay);
        }
        // Whatever bits came over the wire.
        let hip = hip.normalised();
        let settings = self.settings_of(Some(&scene));
        self.effects = self.effects_of(&scene);
        let mut contact = match stretch {
            Some(stretch) => {
                let at = GridPoint::new(hip.cell(), hip.frac() + stretch);
                Contact::landing(settings, at, stretch)
            }
            None => Contact::new(settings),
        };
        self.rub(&mut contact);
        self.contact = contact;
        self.clutch.put(hip);
        self.scene = Some(scene);
        (self.point, self.before) = (None, None);
        self.view = view.number;
    }

    /// The tip is somewhere else from now on, so nothing is driven meanwhile.
    fn take_zero(&mut self, counts: [i32; 3]) {
        self.guard.stop();
        self.guard.restart_counts();
        self.contact = self.contact_of(self.scene.as_ref());
        self.zero = Some(counts);
    }

    /// Never lets a tile of the field push out the one under the proxy, nor, where an arm is felt, one
    /// beside that: it comes too late then, for a place that the proxy has left.
    fn take_tile(&mut self, tile: &'t mut Tile) -> Option<&'t mut Tile> {
        let level = self.window.level();
        let under_proxy = self.contact.patch();
        let under_proxy = under_proxy.map(|cell| TileKey::holding(level, cell));
        if let (Some(under_proxy), Some(key)) = (under_proxy, tile.key())
            && key != under_proxy
            && self.window.expects(key)
            && let Some(occupant) = self.window.occupant(key)
            && (occupant == under_proxy
                || (!self.contact.is_in_lock_step()
                    && occupant.index.is_beside(under_proxy.index)
                    && !key.index.is_beside(under_proxy.index)))
        {
            return Some(tile);
        }
        let felt = [self.contact.output().proxy, *self.contact.hip()];
        self.window.take(tile, felt.map(|point| point.column()))
    }

    /// Lets the surface of a scene with an underlay move on to the tiles that have come.
    // Apart, so that the tick of a scene without underlay has nothing of it.
    #[cold]
    #[inline(never)]
    fn settle(&mut self, cell_mm: f32) {
        // An infinite step would leave no trace of which tiles settle.
        let step = smaller(SETTLING_MM_S * self.rate.tick_s() / cell_mm, f32::MAX);
        if self.window.settle(step) {
            self.contact.surface_moved(&self.window);
        }
    }

    /// The energy that the ticks have created and that was not taken back yet, mJ.
    fn created_mj(&self) -> f32 {
        let damper = self
            .effects
            .as_ref()
            .and_then(|effects| effects.damper.as_ref());
        damper.map_or(0.0, Damper::created_mj)
    }

    /// The contact of the last tick.
    #[must_use]
    pub const fn contact(&self) -> &Contact {
        &self.contact
    }

    /// The calibration in force.
    #[must_use]
    pub fn calibration(&self) -> Option<&Calibration> {
        self.mechanism.as_ref().map(Mechanism::calibration)
    }

    /// The state of the guard and what was measured, after a tick.
    #[must_use]
    pub fn health(&self, sense: &Sense, drive: &Drive) -> Health {
        let angles = |m: &Mechanism| m.angles(sense.counts, self.zero.unwrap_or_default());
        Health {
            report: self.guard.report(),
            sense: *sense,
            zero: self.zero,
            angles_rad: self.mechanism.as_ref().map(angles).unwrap_or_default(),
            currents_a: drive.currents_a,
            winding_c: self.guard.motors().winding_c(),
            created_mj: self.created_mj(),
        }
    }

    /// The state of the guard after a tick.
    #[must_use]
    pub const fn report(&self) -> Report {
        self.guard.report()
    }

    /// One tick with what the encoders and safety inputs say. `watchdog_live`:
    /// whether the board's watchdog is being fed.
    pub fn tick(&mut self, sense: &Sense, watchdog_live: bool) -> Outcome {
        let mut outcome = Outcome::default();
        self.tick_into(sense, watchdog_live, &mut outcome);
        outcome
    }

    /// As [`Haptics::tick`], into a place that stays: nothing is copied.
    pub fn tick_into(&mut self, sense: &Sense, watchdog_live: bool, outcome: &mut Outcome) {
        self.tick = self.tick.wrapping_add(1);
        let pose = self.watch(sense, watchdog_live);
        match &self.scene {
            Some(scene) if scene.source == Source::Points => self.tick_point(outcome),
            _ => self.tick_arm(pose.as_ref(), outcome),
        }
    }

    /// Follows the arm while nothing of it is felt, in place of a tick: an arm that
    /// somebody moves meanwhile keeps its zero, a jump of its encoders is noticed, and
    /// its motors cool. Nothing is driven.
    ///
    /// A board calls it in every tick of a replay in which no point is under way;
    /// [`Haptics::tick_into`] sees to the others.
    pub fn follow(&mut self, sense: &Sense, watchdog_live: bool) {
        self.watch(sense, watchdog_live);
    }

    /// Where the arm is, and what the guard makes of it.
    fn watch(&mut self, sense: &Sense, watchdog_live: bool) -> Option<Pose> {
        let zero = self.zero.unwrap_or_default();
        let mechanism = self.mechanism.as_ref();
        let pose = mechanism.map(|mechanism| mechanism.pose(sense.counts, zero));
        let around = Surroundings {
            arm: mechanism.zip(pose.as_ref()),
            zeroed: self.zero.is_some(),
            scene: match &self.scene {
                Some(scene) if scene.source == Source::Points => SceneKind::Points,
                Some(_) => SceneKind::Arm,
                None => SceneKind::None,
            },
            watchdog_live,
        };
        if self.guard.watch(sense, &around) {
            self.zero = None;
        }
        pose
    }

    /// The full path: pose, haptic interface point, proxy, force, torques, currents.
    fn tick_arm(&mut self, pose: Option<&Pose>, outcome: &mut Outcome) {
        if let Some(scene) = &self.scene
            && scene.underlay.is_some()
        {
            self.settle(scene.cell_mm);
        }
        outcome.answers = None;
        // The option is tested once: otherwise the compiler tests it where each number is used.
        let Some(pose) = pose else {
            return self.tick_without_arm(outcome);
        };
        let sample = &mut outcome.sample;
        let mut wanted = Vec3::ZERO;
        if let (Some(mechanism), Some(scene)) = (&self.mechanism, &mut self.scene) {
            let mut hip = place(mechanism, scene, pose);
            let contact = &mut self.contact;
            if !self.clutch.is_closed() {
                let felt = (&mut *contact, &self.window);
                let drives = self.guard.mode().drives();
                hip = self.clutch.tick(hip, scene, felt, drives);
            }
            let output = contact.step(&self.window, &hip);
            wanted = scene.law.force_n(output.displacement * scene.cell_mm) * self.clutch.share();
            write_output(hip, output, sample);
            if self.effects.is_some() {
                wanted = self.force_with_effects(pose, sample);
            }
        } else {
            write_nothing(sample);
        }
        let force_n = self.guard.limit_force(wanted);
        outcome.drive = match &self.mechanism {
            Some(mechanism) if self.guard.mode().drives() => {
                let wanted_a = self.guard.jog_currents_a().unwrap_or_else(|| {
                    let weight = mechanism.gravity_nm(pose) * self.guard.gain();
                    let torques = pose.torques_nm(to_device_frame(force_n)) + weight;
                    mechanism.currents_a(torques)
                });
                self.guard.limit_currents(wanted_a)
            }
            _ => Drive::default(),
        };
        if !outcome.drive.enabled {
            outcome.drive.held = self.guard.held();
        }
        self.write_state(force_n, &mut outcome.sample);
    }

    /// The same without a calibration: nothing is felt, and nothing driven.
    #[cold]
    #[inline(never)]
    fn tick_without_arm(&mut self, outcome: &mut Outcome) {
        let sample = &mut outcome.sample;
        write_nothing(sample);
        outcome.drive = Drive {
            held: self.guard.held(),
            ..Drive::default()
        };
        self.write_state(Vec3::ZERO, sample);
    }

    /// The force of a scene with effects, after the contact's tick.
    // Apart, so that the tick of a scene without them has nothing of them.
    #[cold]
    #[inline(never)]
    fn force_with_effects(&mut self, pose: &Pose, sample: &mut Sample) -> Vec3 {
        let (Some(mechanism), Some(scene), Some(effects)) =
            (&self.mechanism, &self.scene, &mut self.effects)
        else {
            return Vec3::ZERO;
        };
        let displacement = effects.displacement(&self.window, &self.contact, &self.materials);
        let displacement_mm = displacement * scene.cell_mm;
        sample.missing_tile = sample.missing_tile.or(effects.missing());
        let spring_n = effects.law(&scene.law).force_n(displacement_mm) * self.clutch.share();
        if let Some(friction) = effects.friction() {
            self.contact.feels_friction(friction);
        }
        let Some(damper) = &mut effects.damper else {
            return spring_n;
        };
        if self.guard.mode() != Mode::Armed || !self.clutch.is_closed() {
            damper.rest();
            return spring_n;
        }
        let velocity_mm_s = to_terrain_frame(self.guard.tip_velocity_mm_s(mechanism, pose));
        damper.observe(&Moment {
            displacement_mm,
            tip_mm: scene.home.to(&sample.hip) * scene.cell_mm,
            velocity_mm_s,
            asked_n: self.guard.force_n(),
            most_n: self.guard.most_force_n(),
        });
        if damper.created_mj() > 0.0 {
            self.guard.says(Limits::ENERGY_TAKEN_BACK);
        }
        damper.force_n(spring_n, velocity_mm_s)
    }

    /// Replay: the host's point in place of the arm, amplifiers off. The tick
    /// is repeated until no tile is missing and no work is left; only then is the
    /// point answered.
    fn tick_point(&mut self, outcome: &mut Outcome) {
        outcome.drive = Drive::default();
        outcome.answers = None;
        let sample = &mut outcome.sample;
        let mut force_n = Vec3::ZERO;
        if let (Some(scene), Some(point)) = (&self.scene, self.point) {
            let contact = &mut self.contact;
            let waited = self.effects.as_ref().and_then(Effects::missing);
            // What only waited for an effect's tile has its contact.
            if waited.is_none() || !contact.has_answered(&point.hip) {
                // Where the HIP is follows from the point.
                let _ = contact.land(&self.window);
                contact.step(&self.window, &point.hip);
            }
            write_output(point.hip, contact.output(), sample);
            let mut displacement = contact.output().displacement;
            let (mut law, mut missing) = (&scene.law, None);
            if let Some(effects) = &mut self.effects {
                displacement = effects.displacement(&self.window, contact, &self.materials);
                missing = effects.missing();
                sample.missing_tile = sample.missing_tile.or(missing);
                law = effects.law(law);
                if let Some(friction) = effects.friction()
                    && contact.output().converged
                    && missing.is_none()
                {
                    contact.feels_friction(friction);
                }
            }
            force_n = law.force_n(displacement * scene.cell_mm);
            if let Some(damper) = self.effects.as_ref().and_then(|e| e.damper.as_ref()) {
                let from = self.before.unwrap_or(point.hip);
                let velocity_mm_s = from.to(&point.hip) * (scene.cell_mm * self.rate.hz() as f32);
                force_n = damper.force_n(force_n, velocity_mm_s);
            }
            if contact.output().converged && missing.is_none() {
                self.before = Some(point.hip);
                outcome.answers = Some(point.seq);
                self.point = None;
            }
        } else {
            write_nothing(sample);
        }
        self.write_state(force_n, sample);
    }

    /// Writes the loop's state into the sample: all but the contact's output and what
    /// the caller measures.
    fn write_state(&self, force_n: Vec3, sample: &mut Sample) {
        let Report {
            mode,
            mut limits,
            fault,
            ..
        } = self.guard.report();
        limits.set(Limits::TERRAIN_MISSING, sample.missing_tile.is_some());
        limits.set(Limits::BOUNDARY_FADING, self.contact.boundary_fade() < 1.0);
        limits |= self.clutch.limits();
        let is_coarse = self.is_over_coarse_ground(sample);
        limits.set(Limits::TERRAIN_COARSE, is_coarse);
        sample.tick = self.tick;
        sample.view = self.view;
        sample.force_n = force_n;
        (sample.mode, sample.limits, sample.fault) = (mode, limits, fault);
    }

    /// Whether the proxy is over the underlay, over a tile that has not settled, or over nothing
    /// where an underlay is on its way.
    fn is_over_coarse_ground(&self, sample: &Sample) -> bool {
        let cell = sample.proxy.column();
        let scene = self.scene.as_ref();
        scene.is_some_and(|scene| scene.underlay.is_some() && scene.size.has_cell(cell))
            && !self.window.is_settled(cell)
    }
}

/// Writes the contact's output into the sample.
// A call: it is needed in several places.
#[inline(never)]
fn write_output(hip: GridPoint, output: &ContactOutput, sample: &mut Sample) {
    sample.hip = hip;
    sample.proxy = output.proxy;
    sample.state = output.state;
    sample.missing_tile = output.missing_tile;
    sample.work = output.work;
}

/// Nothing is felt.
#[cold]
#[inline(never)]
fn write_nothing(sample: &mut Sample) {
    write_output(GridPoint::default(), &ContactOutput::default(), sample);
}

/// Where the tip is over the terrain.
fn place(mechanism: &Mechanism, scene: &Scene, pose: &Pose) -> GridPoint {
    let moved_mm = to_terrain_frame(pose.tip_mm() - mechanism.home_mm());
    GridPoint::new(
        scene.home.cell(),
        scene.home.frac() + moved_mm / scene.cell_mm,
    )
}

#[cfg(test)]
#[path = "tick_tests.rs"]
mod tests;
