//! The tick: one pure function from encoder counts to amplifier currents.
//!
//! It reads nothing and writes nothing but its own state, never blocks, and
//! does a bounded amount of work. Scenes, tiles, points and settings are
//! handed to it between ticks by [`Haptics::accept`] and
//! [`Haptics::configure`].

use glam::Vec3;

use crate::contact::{Contact, Felt, Pace};
use crate::grid::GridPoint;
use crate::guard::{Drive, Fault, Guard, Limits, Report, SceneKind, Sense, Surroundings, TickRate};
use crate::phantom::{Calibration, Mechanism, Pose, to_device_frame, to_terrain_frame};
use crate::terrain::{Tile, TileKey, Window};
use crate::wire::message::{Point, Sample, Scene, Source};
use crate::wire::status::Health;

/// What is handed to the loop between ticks.
pub enum Command<'t> {
    /// A scene, already checked ([`Scene::is_valid`]). The arm is disarmed,
    /// and force that was there goes out gently.
    Scene(Scene),
    /// No scene any more. The arm is disarmed likewise.
    DropScene,
    /// A filled tile.
    Tile(&'t mut Tile),
    /// A hand position to be felt, in a scene fed by points.
    Point(Point),
    /// Arm, once nothing is in the way and the dead-man switch is pressed.
    Arm,
    /// Disarm; force goes out gently.
    Disarm,
    /// These are the counts in the zero pose of the calibration record.
    Zero([i32; 3]),
    /// Clear a latched fault.
    ClearFault,
    /// Latch a fault found outside the tick.
    Trip(Fault),
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
pub struct Haptics<'t, const D: usize> {
    rate: TickRate,
    window: Window<'t, D>,
    contact: Contact,
    guard: Guard,
    mechanism: Option<Mechanism>,
    /// Counts in the zero pose, once they are known.
    zero: Option<[i32; 3]>,
    scene: Option<Scene>,
    point: Option<Point>,
    tick: u32,
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
            window: Window::new(tiles),
            contact: Contact::ticking(rate),
            guard: Guard::new(rate, found_at_boot),
            mechanism: None,
            zero: None,
            scene: None,
            point: None,
            tick: 0,
        }
    }

    /// Takes a command between ticks. Gives back a tile buffer that is free
    /// again, where the command brought one.
    #[must_use]
    pub fn accept(&mut self, command: Command<'t>) -> Option<&'t mut Tile> {
        match command {
            Command::Scene(scene) => self.take_scene(scene),
            Command::DropScene => self.drop_scene(),
            Command::Tile(tile) => return Some(self.take_tile(tile)),
            Command::Point(point) => self.point = Some(point),
            Command::Arm => self.guard.arm(),
            Command::Disarm => self.guard.disarm(),
            Command::Zero(counts) => self.take_zero(counts),
            Command::ClearFault => self.guard.clear(),
            Command::Trip(fault) => self.guard.trip(fault),
        }
        None
    }

    /// Swaps the arm's settings between ticks. Whoever hands them over sees to
    /// it that the arm is disarmed; if it is not, it is switched off.
    pub fn configure(&mut self, mechanism: Mechanism) {
        self.guard.stop();
        self.guard.configure(&mechanism);
        self.mechanism = Some(mechanism);
        self.contact = Contact::ticking(self.rate);
    }

    fn take_scene(&mut self, scene: Scene) {
        if !scene.is_valid() {
            return;
        }
        match scene.source {
            Source::Encoders => self.guard.disarm(),
            Source::Points => self.guard.stop(),
        }
        self.window.reset(scene.level, scene.size, scene.top);
        self.contact = Contact::ticking(self.rate);
        self.scene = Some(scene);
        self.point = None;
        self.tick = 0;
    }

    fn drop_scene(&mut self) {
        self.guard.disarm();
        self.contact = Contact::ticking(self.rate);
        self.scene = None;
        self.point = None;
    }

    /// Everything looks elsewhere from now on, so nothing is driven meanwhile.
    fn take_zero(&mut self, counts: [i32; 3]) {
        self.guard.stop();
        self.guard.restart_counts();
        self.contact = Contact::ticking(self.rate);
        self.zero = Some(counts);
    }

    /// Never lets a tile push out the one under the proxy.
    fn take_tile(&mut self, tile: &'t mut Tile) -> &'t mut Tile {
        let under_proxy = self
            .contact
            .patch()
            .map(|cell| TileKey::holding(self.window.level(), cell));
        let evicts = tile.key().is_some_and(|key| {
            key != under_proxy.unwrap_or(key) && self.window.occupant(key) == under_proxy
        });
        if evicts && under_proxy.is_some() {
            return tile;
        }
        self.window.install(tile)
    }

    /// The latched fault.
    #[must_use]
    pub const fn fault(&self) -> Option<Fault> {
        self.guard.fault()
    }

    /// The calibration in force.
    #[must_use]
    pub fn calibration(&self) -> Option<&Calibration> {
        self.mechanism.as_ref().map(Mechanism::calibration)
    }

    /// Where the guard stands and what was measured, after a tick.
    #[must_use]
    pub fn health(&self, sense: &Sense, drive: &Drive) -> Health {
        let zero = self.zero.unwrap_or_default();
        let angles = self
            .mechanism
            .as_ref()
            .map(|m| m.angles(sense.counts, zero));
        Health {
            report: self.guard.report(),
            sense: *sense,
            zero: self.zero,
            angles_rad: angles.unwrap_or_default(),
            currents_a: drive.currents_a,
            winding_c: self.guard.motors().winding_c(),
        }
    }

    /// Where the guard stands, after a tick.
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
        match &self.scene {
            Some(scene) if scene.source == Source::Points => self.feel_point(outcome),
            _ => self.feel_arm(sense, watchdog_live, outcome),
        }
    }

    /// The full path: counts, pose, haptic interface point, proxy, force,
    /// torques, currents.
    fn feel_arm(&mut self, sense: &Sense, watchdog_live: bool, outcome: &mut Outcome) {
        let zero = self.zero.unwrap_or_default();
        let mechanism = self.mechanism.as_ref();
        let pose = mechanism.map(|mechanism| mechanism.pose(sense.counts, zero));
        let around = Surroundings {
            arm: mechanism.zip(pose.as_ref()),
            zeroed: self.zero.is_some(),
            scene: self
                .scene
                .as_ref()
                .map_or(SceneKind::None, |_| SceneKind::Arm),
            watchdog_live,
        };
        let lost_counts = self.guard.watch(sense, &around);
        outcome.drive = Drive::default();
        outcome.answers = None;
        let sample = &mut outcome.sample;
        let (Some(mechanism), Some(pose)) = (mechanism, pose) else {
            tell_felt(GridPoint::default(), &Felt::default(), sample);
            return self.tell(Vec3::ZERO, sample);
        };
        let mut wanted = Vec3::ZERO;
        if let Some(scene) = &self.scene {
            let hip = place(mechanism, scene, &pose);
            let contact = &mut self.contact;
            let felt = contact.step(&self.window, &hip, scene.rule, Pace::RealTime);
            wanted = scene.law.force_n(felt.stretch * scene.cell_mm);
            tell_felt(hip, felt, sample);
        } else {
            tell_felt(GridPoint::default(), &Felt::default(), sample);
        }
        let force_n = self.guard.limit_force(wanted);
        if self.guard.mode().drives() {
            let weight = mechanism.gravity_nm(&pose) * self.guard.gain();
            let torques = pose.torques_nm(to_device_frame(force_n)) + weight;
            outcome.drive = self.guard.limit_currents(mechanism.currents_a(torques));
        }
        if lost_counts {
            self.zero = None;
        }
        self.tell(force_n, &mut outcome.sample);
    }

    /// Replay: the host's point in place of the arm, amplifiers off. The tick
    /// is repeated until nothing holds it up; only then is the point answered.
    fn feel_point(&mut self, outcome: &mut Outcome) {
        outcome.drive = Drive::default();
        outcome.answers = None;
        let sample = &mut outcome.sample;
        let (Some(scene), Some(point)) = (&self.scene, self.point) else {
            tell_felt(GridPoint::default(), &Felt::default(), sample);
            return self.tell(Vec3::ZERO, sample);
        };
        let contact = &mut self.contact;
        let felt = contact.step(&self.window, &point.hip, scene.rule, Pace::LockStep);
        let force_n = scene.law.force_n(felt.stretch * scene.cell_mm);
        tell_felt(point.hip, felt, sample);
        if felt.settled {
            outcome.answers = Some(point.seq);
            self.point = None;
        }
        self.tell(force_n, sample);
    }

    /// Writes where the loop stands into the sample, all but what was felt and
    /// what the loop around it measures.
    fn tell(&self, force_n: Vec3, sample: &mut Sample) {
        let mut limits = self.guard.limits();
        limits.set(Limits::TERRAIN_MISSING, sample.held_up_by.is_some());
        let fading = self.contact.presence() < 1.0;
        limits.set(Limits::PRESENCE_FADING, fading);
        sample.tick = self.tick;
        sample.force_n = force_n;
        sample.mode = self.guard.mode();
        sample.limits = limits;
        sample.fault = self.guard.fault();
    }
}

/// Writes what was felt into the sample.
fn tell_felt(hip: GridPoint, felt: &Felt, sample: &mut Sample) {
    sample.hip = hip;
    sample.proxy = felt.proxy;
    sample.state = felt.state;
    sample.held_up_by = felt.held_up_by;
    sample.work = felt.work;
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
