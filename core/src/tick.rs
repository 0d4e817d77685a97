//! The tick: one pure function from encoder counts to amplifier currents.
//!
//! ```text
//! counts ─▶ pose ─▶ HIP ─▶ force ─▶ guard ─▶ currents
//! ```
//!
//! It reads and writes only its own state and arguments, never blocks, and does a bounded amount of
//! work. [`Haptics::accept`] and [`Haptics::configure`] set scenes, tiles, points and settings
//! between ticks.

use glam::Vec3;

use crate::contact::ContactOutput;
use crate::grid::GridPoint;
use crate::guard::{GuardInputs, GuardOutputs, Limits, Report, SceneKind, Surroundings};
pub use crate::haptics::{Board, Command, Haptics, HipSource, LATENCY_S, RefusedScene};
use crate::phantom::{Kinematics, Pose, to_device_frame, to_terrain_frame};
use crate::renderer::{MotionSource, Renderer};
use crate::scalar::smaller;
use crate::scene::{Scene, Source, TickRecord};
use crate::terrain::BLEND_MM_S;

/// One tick's result.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Outputs to the amplifiers.
    pub drive: GuardOutputs,
    /// Record for telemetry.
    pub sample: TickRecord,
    /// Number of the point that this tick answers.
    pub answered_seq: Option<u32>,
}

impl<const D: usize> Haptics<'_, D> {
    /// Runs one tick with the encoders and safety inputs. `watchdog_live` is true if the board's
    /// watchdog is being fed.
    pub fn tick(&mut self, sense: &GuardInputs, watchdog_live: bool) -> Outcome {
        let mut outcome = Outcome::default();
        self.tick_into(sense, watchdog_live, &mut outcome);
        outcome
    }

    /// Runs [`Haptics::tick`] and writes its outcome in place, without a copy.
    pub fn tick_into(&mut self, sense: &GuardInputs, watchdog_live: bool, outcome: &mut Outcome) {
        self.tick = self.tick.wrapping_add(1);
        let pose = self.watch(sense, watchdog_live);
        match &self.scene {
            Some(scene) if scene.source == Source::Points => self.tick_point(outcome),
            _ => self.tick_arm(pose.as_ref(), outcome),
        }
    }

    /// Monitors the arm in place of a tick, while nothing is rendered: an arm that is moved keeps
    /// its zero, a jump of its encoders is detected, and its motors cool. Nothing is driven.
    ///
    /// A board calls it in every tick of a replay in which no point is in progress, and
    /// [`Haptics::tick_into`] in the others.
    pub fn monitor(&mut self, sense: &GuardInputs, watchdog_live: bool) {
        self.watch(sense, watchdog_live);
    }

    /// Reads the pose of the arm and updates the guard.
    fn watch(&mut self, sense: &GuardInputs, watchdog_live: bool) -> Option<Pose> {
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

    /// Runs the full path: pose, haptic interface point, force, torques, currents.
    fn tick_arm(&mut self, pose: Option<&Pose>, outcome: &mut Outcome) {
        if let Some(scene) = &self.scene
            && scene.fallback.is_some()
        {
            self.blend_tiles(scene.cell_mm);
        }
        outcome.answered_seq = None;
        // Tested once here: otherwise the compiler tests the option where each number is used.
        let Some(pose) = pose else {
            return self.tick_without_arm(outcome);
        };
        let target_n = self.target_n(pose, &mut outcome.sample);
        let force_n = self.guard.limit_force(target_n);
        self.command_motors(pose, force_n, &mut outcome.drive);
        self.write_state(force_n, &mut outcome.sample);
    }

    /// Returns the requested force at the HIP, N, terrain frame.
    fn target_n(&mut self, pose: &Pose, sample: &mut TickRecord) -> Vec3 {
        let placed = match self.clutch.is_closed() {
            true => None,
            false => self.tick_clutch(pose),
        };
        let (Some(mechanism), Some(scene)) = (&self.mechanism, &self.scene) else {
            write_empty(sample);
            return Vec3::ZERO;
        };
        let hip = placed.unwrap_or_else(|| place(mechanism, scene, pose));
        let arm = MotionSource::Arm {
            guard: &self.guard,
            mechanism,
            pose,
            clutch: self.clutch.share(),
        };
        let target_n = self.renderer.step(&self.window, scene, hip, &arm);
        write_output(hip, &self.renderer, sample);
        if self.renderer.has_effects() && self.renderer.created_mj() > 0.0 {
            self.guard.add_limits(Limits::ENERGY_DISSIPATED);
        }
        match self.clutch.is_closed() {
            true => target_n,
            false => {
                let patch = self.renderer.contact().patch();
                let has_tile = patch.is_none_or(|cell| self.window.has_tile(cell));
                self.clutch.turned(target_n, has_tile)
            }
        }
    }

    /// Sets the currents, A, for a force and for the arm's weight.
    #[inline]
    fn command_motors(&mut self, pose: &Pose, force_n: Vec3, drive: &mut GuardOutputs) {
        *drive = match &self.mechanism {
            Some(mechanism) if self.guard.mode().is_driving() => {
                let target_a = self.guard.jog_currents_a().unwrap_or_else(|| {
                    let weight = mechanism.gravity_nm(pose) * self.guard.gain();
                    let torques = pose.torques_nm(to_device_frame(force_n)) + weight;
                    mechanism.currents_a(torques)
                });
                self.guard.limit_currents(target_a)
            }
            _ => GuardOutputs::default(),
        };
        if !drive.enabled {
            drive.held = self.guard.held_shares();
        }
    }

    /// Runs a tick without a calibration: no force is rendered, and nothing is driven.
    #[cold]
    #[inline(never)]
    fn tick_without_arm(&mut self, outcome: &mut Outcome) {
        let sample = &mut outcome.sample;
        write_empty(sample);
        outcome.drive = GuardOutputs {
            held: self.guard.held_shares(),
            ..GuardOutputs::default()
        };
        self.write_state(Vec3::ZERO, sample);
    }

    /// Blends the surface of a scene with a fallback to the tiles that have arrived.
    // Not inlined: the tick of a scene without fallback does not need it.
    #[cold]
    #[inline(never)]
    fn blend_tiles(&mut self, cell_mm: f32) {
        // An infinite step would erase the record of the tiles that blend in.
        let step = smaller(BLEND_MM_S * self.rate.tick_s() / cell_mm, f32::MAX);
        if self.window.blend_tiles(step) {
            self.renderer.contact_mut().surface_moved(&self.window);
        }
    }

    /// Writes the loop's state into the record, without the contact's output and the caller's
    /// measurements.
    pub(crate) fn write_state(&self, force_n: Vec3, sample: &mut TickRecord) {
        let Report {
            mode,
            mut limits,
            fault,
            ..
        } = self.guard.report();
        limits.set(Limits::TERRAIN_MISSING, sample.missing_tile.is_some());
        limits.set(
            Limits::EDGE_FADING,
            self.renderer.contact().edge_fade() < 1.0,
        );
        limits |= self.clutch.limits();
        let is_coarse = self.is_over_coarse_ground(sample);
        limits.set(Limits::TERRAIN_COARSE, is_coarse);
        sample.tick = self.tick;
        sample.view = self.view;
        sample.force_n = force_n;
        (sample.mode, sample.limits, sample.fault) = (mode, limits, fault);
    }

    /// Returns true if the proxy is over the fallback, over a tile that still blends in, or over
    /// missing terrain before the fallback arrives.
    fn is_over_coarse_ground(&self, sample: &TickRecord) -> bool {
        let cell = sample.proxy.column();
        let scene = self.scene.as_ref();
        scene.is_some_and(|scene| scene.fallback.is_some() && scene.size.has_cell(cell))
            && !self.window.is_blended(cell)
    }
}

/// Writes the contact's output into the record.
pub(crate) fn write_output(hip: GridPoint, renderer: &Renderer, sample: &mut TickRecord) {
    write_contact(hip, renderer.contact().output(), sample);
    sample.missing_tile = renderer.missing_tile();
}

// Not inlined: it has several callers.
#[inline(never)]
fn write_contact(hip: GridPoint, output: &ContactOutput, sample: &mut TickRecord) {
    sample.hip = hip;
    sample.proxy = output.proxy;
    sample.state = output.state;
    sample.work = output.work;
}

/// Writes a record without contact and force.
#[cold]
#[inline(never)]
pub(crate) fn write_empty(sample: &mut TickRecord) {
    write_contact(GridPoint::default(), &ContactOutput::default(), sample);
}

/// Returns the tip's position over the terrain.
pub(crate) fn place(mechanism: &Kinematics, scene: &Scene, pose: &Pose) -> GridPoint {
    let moved_mm = to_terrain_frame(pose.tip_mm() - mechanism.home_mm());
    GridPoint::new(
        scene.home.cell(),
        scene.home.frac() + moved_mm / scene.cell_mm,
    )
}

#[cfg(test)]
#[path = "tick_tests.rs"]
mod tests;
