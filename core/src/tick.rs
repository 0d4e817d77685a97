//! The tick: one pure function from encoder counts to amplifier currents.
//!
//! It reads nothing and writes nothing but its own state, never blocks, and
//! does a bounded amount of work. Scenes, tiles and points are handed to it
//! between ticks by [`Haptics::accept`].

use glam::Vec3;

use crate::contact::{Contact, Felt, Pace};
use crate::grid::GridPoint;
use crate::guard::thermal::Rating;
use crate::guard::{Drive, Fault, Guard};
use crate::phantom::{Calibration, Pose, to_device_frame, to_terrain_frame};
use crate::terrain::{Tile, TileKey, Window};
use crate::wire::message::{Point, Sample, Scene, Source};

/// Length of a tick, seconds.
pub const TICK_S: f32 = 1e-3;

/// What is handed to the loop between ticks.
pub enum Command<'t> {
    /// A scene, already checked ([`Scene::is_valid`]).
    Scene(Scene),
    /// A filled tile.
    Tile(&'t mut Tile),
    /// A hand position to be felt, in a scene fed by points.
    Point(Point),
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
    window: Window<'t, D>,
    contact: Contact,
    guard: Guard,
    calibration: Calibration,
    scene: Option<Scene>,
    point: Option<Point>,
    tick: u32,
}

impl<'t, const D: usize> Haptics<'t, D> {
    /// A loop without a scene: amplifiers off.
    #[must_use]
    pub fn new(tiles: [[&'t mut Tile; D]; D], calibration: Calibration) -> Self {
        Self {
            window: Window::new(tiles),
            contact: Contact::new(),
            guard: Guard::default(),
            calibration,
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
            Command::Tile(tile) => return Some(self.take_tile(tile)),
            Command::Point(point) => self.point = Some(point),
            Command::ClearFault => self.guard.clear(),
            Command::Trip(fault) => self.guard.trip(fault),
        }
        None
    }

    fn take_scene(&mut self, scene: Scene) {
        if !scene.is_valid() {
            return;
        }
        self.window.reset(scene.level, scene.size, scene.top);
        self.contact = Contact::new();
        self.scene = Some(scene);
        self.point = None;
        self.tick = 0;
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

    /// One tick. `counts` are the three encoders'.
    pub fn tick(&mut self, counts: [i32; 3]) -> Outcome {
        self.tick = self.tick.wrapping_add(1);
        match self.scene {
            Some(scene) if scene.source == Source::Encoders => self.feel_arm(&scene, counts),
            Some(scene) => self.feel_point(&scene),
            None => self.outcome(GridPoint::default(), Felt::default(), Vec3::ZERO),
        }
    }

    /// The full path: counts, pose, haptic interface point, proxy, force,
    /// torques, currents.
    fn feel_arm(&mut self, scene: &Scene, counts: [i32; 3]) -> Outcome {
        self.guard.watch(counts);
        let pose = Pose::from_counts(&self.calibration, counts);
        let hip = self.place(scene, &pose);
        let felt = *self
            .contact
            .step(&self.window, hip, scene.rule, Pace::RealTime);
        let wanted = scene.law.force_n(felt.stretch * scene.cell_mm);
        let force_n = self.guard.limit_force(wanted);
        let torques = pose.torques_nm(to_device_frame(force_n));
        let currents = torques / (self.calibration.ratio * self.calibration.torque_constant);
        let rating = Rating {
            peak_a: self.calibration.peak_current_a,
            continuous_a: self.calibration.continuous_current_a,
        };
        let drive = self.guard.limit_currents(currents, rating, TICK_S);
        let mut outcome = self.outcome(hip, felt, force_n);
        outcome.drive = drive;
        outcome
    }

    /// Replay: the host's point in place of the arm, amplifiers off. The tick
    /// is repeated until nothing holds it up; only then is the point answered.
    fn feel_point(&mut self, scene: &Scene) -> Outcome {
        let Some(point) = self.point else {
            return self.outcome(GridPoint::default(), Felt::default(), Vec3::ZERO);
        };
        let felt = *self
            .contact
            .step(&self.window, point.hip, scene.rule, Pace::LockStep);
        let force_n = scene.law.force_n(felt.stretch * scene.cell_mm);
        let mut outcome = self.outcome(point.hip, felt, force_n);
        if felt.settled {
            outcome.answers = Some(point.seq);
            self.point = None;
        }
        outcome
    }

    /// Where the tip is over the terrain.
    fn place(&self, scene: &Scene, pose: &Pose) -> GridPoint {
        let home = Pose::from_angles(&self.calibration, Vec3::ZERO);
        let moved_mm = to_terrain_frame(pose.tip_mm() - home.tip_mm());
        GridPoint::new(
            scene.home.cell(),
            scene.home.frac() + moved_mm / scene.cell_mm,
        )
    }

    fn outcome(&self, hip: GridPoint, felt: Felt, force_n: Vec3) -> Outcome {
        Outcome {
            drive: Drive::default(),
            sample: Sample {
                tick: self.tick,
                hip,
                proxy: felt.proxy,
                force_n,
                state: felt.state,
                held_up_by: felt.held_up_by,
                fault: self.guard.fault(),
                work: felt.work,
                ..Sample::default()
            },
            answers: None,
        }
    }
}

#[cfg(test)]
#[path = "tick_tests.rs"]
mod tests;
