//! A segment of the campaign: one device, one arm, and one injected fault of each kind in random
//! order. It depends only on the seed.

use hapterra::materials::Materials;
use hapterra::phantom::PhantomModel;
use hapterra::synth::{Kind as Look, Synth};
use hapterra::terrain::{HapticCells, HapticGrid, Scale, Terrain};
use hapterra_core::Vec3;
use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::guard::{GuardInputs, GuardOutputs, Mode};
use hapterra_core::phantom::Calibration;
use hapterra_core::scene::{HipCommand, Scene, Source};
use hapterra_core::wire::message::ToDevice;
use hapterra_core::wire::request::Request;
use hapterra_core::wire::status::{ResetCause, Status};
use heightfield::Raster;

use super::arm::{Arm, HandMotion};
use super::board::{self, Board};
use super::clock::{Reading, SetClock};
use super::fault_effect::{Core, InjectedFault};
use super::fault_kind::Kind;
use super::fault_outcomes::{LinkStats, Outcome};
use super::faulty_pipe::LinkDisturbance;
use super::force_invariants::ForceChecks;
use super::ground::{Effects, Ground, SceneSurfaces};
use super::host::{Host, Tiles};
use super::hostile_calibrations;
use super::tick_invariants::{TickChecks, Truth};
use crate::random::Random;

/// Samples along the side of the terrain, and the side of a cell, mm.
const SAMPLES: u32 = 512;
const CELL_MM: f64 = 0.5;
/// Armed ticks between two faults, shortest and longest.
const CALM_TICKS: (usize, usize) = (200, 1_500);
/// Ticks between the end of a fault and the check of its outcome.
const SETTLING_TICKS: u64 = 400;
/// Ticks that an answer may take.
const STATUS_TIMEOUT: u64 = 5_000;
/// Ticks of one attempt to arm, and the number of attempts before a violation: hot motors must
/// cool.
const ARMING_TIMEOUT: u64 = 4_000;
const MAX_ATTEMPTS: u64 = 40;
/// The ticks of an attempt at which the host sends the request and the switch is pressed.
const ARM_REQUEST_TICK: u64 = 60;
const PRESS_TICK: u64 = 200;

/// Violation of an invariant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Violation {
    /// The segment.
    pub segment: u64,
    /// Surface of its ground.
    pub ground: Ground,
    /// Its tick in the segment.
    pub tick: u64,
    /// Its description.
    pub what: String,
}

/// Runs a segment of a campaign and adds it to `stats`.
///
/// # Errors
/// The first [`Violation`].
pub fn run(
    seed: u64,
    segment: u64,
    ground: Ground,
    stats: &mut LinkStats,
) -> Result<(), Violation> {
    let mut random = Random::new(seed ^ segment.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let raster = terrain(&mut random);
    let scale = Scale::new(CELL_MM, 1.0).expect("a scale");
    // From a generator of its own, so that frictionless segments stay as they were.
    let effects = (ground == Ground::Drawn).then(|| Effects::drawn(seed, segment));
    let materials = effects
        .as_ref()
        .and_then(|effects| effects.materials(&raster, SAMPLES));
    let grid = HapticGrid::new(&raster, HapticCells::default()).with_materials(materials.as_ref());
    let terrain = Terrain::over(grid, scale, 0).expect("a terrain");
    let mut running = Segment::new(&terrain, effects, random);
    let played = running.play(stats);
    let forces = &running.forces;
    running.tick_checks.extremes.gained_mj = forces.max_gained_mj;
    running.tick_checks.extremes.watched_ticks = forces.watched_ticks;
    running.tick_checks.extremes.ramp_ticks = forces.ramp_ticks;
    running.tick_checks.extremes.clutch_ticks = forces.clutch_ticks;
    running.tick_checks.extremes.turns = forces.max_turns;
    stats.add(running.now, running.armed, &running.tick_checks.extremes);
    played.map_err(|what| Violation {
        segment,
        ground,
        tick: running.now,
        what,
    })
}

/// Returns hills with no-data among them.
fn terrain(random: &mut Random) -> Raster {
    let kinds = [Look::Fractal, Look::Ridge, Look::Steps, Look::Fractal];
    let amplitude_mm = random.between(6.0, 20.0);
    let synth = Synth::new(kinds[random.below(4)], random.bits(), amplitude_mm);
    let no_data_center = [150.0, 350.0].map(|at| at + random.between(-40.0, 40.0));
    let raster = Raster::from_fn(SAMPLES, SAMPLES, |column, row| {
        let [east, north] = [
            f64::from(column) - no_data_center[0],
            f64::from(row) - no_data_center[1],
        ];
        match libm::hypot(east, north) < 25.0 {
            true => f32::NAN,
            false => synth.height(column, row),
        }
    });
    raster.expect("a terrain")
}

struct Segment<'t> {
    terrain: &'t Terrain<'t>,
    /// Effects besides the spring.
    effects: Option<Effects>,
    forces: ForceChecks,
    /// The tick from which no fault is active.
    calm_from: u64,
    /// True if the device may store poisoned tiles, whose borders are open.
    poisoned: bool,
    random: Random,
    clock: SetClock,
    device: Board,
    host: Host<'t>,
    scene: Scene,
    arm: Arm<'t>,
    tick_checks: TickChecks,
    /// The encoders' permanent errors, counts.
    count_offset: [i32; 3],
    /// Counts of the zero pose, as sent to the device.
    zero: [i32; 3],
    dead_man: bool,
    /// Readings of the current monitors in the last tick, mA.
    measured_ma: [i16; 3],
    outputs: GuardOutputs,
    now: u64,
    /// Ticks with the amplifiers on.
    armed: u64,
}

impl<'t> Segment<'t> {
    fn new(terrain: &'t Terrain<'t>, effects: Option<Effects>, mut random: Random) -> Self {
        let record = Calibration::PREMIUM_1_5;
        let clock = SetClock::default();
        let device = board::new(clock.clone());
        let arm = Arm::new(terrain, &mut random);
        let scene = scene(terrain, &arm, effects.as_ref(), &mut random);
        let forces = ForceChecks::new(forces(terrain, &scene), scene.cell_mm);
        let host = Host::new(terrain, scene, random.bits());
        Self {
            terrain,
            effects,
            forces,
            calm_from: 0,
            poisoned: false,
            random,
            clock,
            device,
            host,
            scene,
            arm,
            tick_checks: TickChecks::new(record, PhantomModel::premium_1_5()),
            count_offset: [0; 3],
            zero: [0; 3],
            dead_man: false,
            measured_ma: [0; 3],
            outputs: GuardOutputs::default(),
            now: 0,
            armed: 0,
        }
    }

    fn play(&mut self, stats: &mut LinkStats) -> Result<(), String> {
        let mut deck = Kind::ALL;
        for left in (1..deck.len()).rev() {
            deck.swap(left, self.random.below(left + 1));
        }
        for kind in deck {
            if !self.outputs.enabled || self.status()?.health.report.mode != Mode::Armed {
                self.arm_device()?;
            }
            let calm = CALM_TICKS.0 + self.random.below(CALM_TICKS.1 - CALM_TICKS.0);
            for _ in 0..calm {
                self.tick(None)?;
            }
            if !self.outputs.enabled {
                return Err(format!(
                    "the arm is off without a mishap: {:?}",
                    self.status()?
                ));
            }
            let (outcome, reaction) = self.inject(kind)?;
            stats.count(kind, outcome, reaction)?;
        }
        Ok(())
    }

    /// Injects one fault. Returns its outcome, and for how many ticks after its first one the
    /// amplifiers stayed on.
    fn inject(&mut self, kind: Kind) -> Result<(Outcome, Option<u64>), String> {
        let mut injected = InjectedFault::of(kind, self.now, &mut self.random);
        let began = self.now;
        let mut off = None;
        match kind {
            Kind::Goodbye => self.host.leave(self.now, &mut self.random),
            Kind::HostRestarted => {
                let effects = self.effects.as_ref();
                self.scene = scene(self.terrain, &self.arm, effects, &mut self.random);
                self.restart_host(self.scene);
            }
            Kind::ReplayThenRun => self.restart_host(Scene {
                source: Source::Points,
                epoch: self.scene.epoch.wrapping_add(1),
                ..self.scene
            }),
            // In a new session: a misplaced request may have had any number, and the device ignores
            // older numbers in its session.
            Kind::HostileCalibration => self.host.greet(self.now, &mut self.random),
            _ => {}
        }
        let end = injected.ticks.end + SETTLING_TICKS;
        while self.now < end {
            let at = self.now - began;
            let is_active = injected.ticks.contains(&self.now);
            self.act(kind, at, injected.ticks.end.saturating_sub(self.now));
            self.tick(is_active.then_some(&mut injected))?;
            if !self.outputs.enabled {
                off.get_or_insert(at);
            }
        }
        let status = self.status()?;
        self.check_outcome(kind, &status)?;
        let report = status.health.report;
        let outcome = match (report.fault, report.mode) {
            (Some(fault), _) => Outcome::Latched(fault),
            (None, Mode::Armed) if off.is_none() => Outcome::Ridden,
            (None, _) => Outcome::Disarmed,
        };
        Ok((outcome, off))
    }

    /// Acts as host and user during a fault of several ticks, `at` ticks after its first one and
    /// with `left` ticks left.
    fn act(&mut self, kind: Kind, at: u64, left: u64) {
        match kind {
            Kind::ReplayThenRun if left == 1 => {
                self.scene.epoch = self.scene.epoch.wrapping_add(2);
                self.restart_host(self.scene);
            }
            Kind::ReplayThenRun if left > 1 && at.is_multiple_of(3) => {
                let hip = GridPoint::new(self.scene.home.cell(), Vec3::splat(0.5));
                let seq = at as u32;
                self.send(&ToDevice::Hip(HipCommand { seq, hip }));
            }
            Kind::HostileCalibration if at == 30 => self.host.request(Request::Disarm),
            // The force has faded.
            Kind::HostileCalibration if at == 180 => self.dead_man = false,
            Kind::HostileCalibration if at > 180 && left > 0 && at.is_multiple_of(20) => {
                let store = self.random.below(2) == 0;
                let calibration = match self.random.below(5) {
                    0 => hostile_calibrations::harmless(),
                    _ => hostile_calibrations::calibration(&mut self.random),
                };
                self.send_raw_request(Request::SetCalibration { calibration });
                if store {
                    self.send_raw_request(Request::StoreCalibration);
                }
            }
            _ => {}
        }
    }

    /// Makes a request under any number, which a correct host never does.
    fn send_raw_request(&mut self, request: Request) {
        let number = self.random.bits() as u8;
        self.send(&ToDevice::Request { number, request });
    }

    /// Sends a message that the real client would not send.
    fn send(&mut self, message: &ToDevice<'_>) {
        let (now, kind) = (self.now, LinkDisturbance::default());
        self.host.send(message, now, &kind, &mut self.random);
    }

    /// Checks the conditions after a fault besides [`Kind::expectation`].
    fn check_outcome(&self, kind: Kind, status: &Status) -> Result<(), String> {
        let zero = status.health.zero;
        if kind == Kind::ReplayThenRun && zero != Some(self.zero) {
            return Err(format!("a replay lost the zero: {zero:?}"));
        }
        if *self.device.memory() != board::STORED {
            return Err("a calibration was stored without consent".into());
        }
        Ok(())
    }

    /// Restarts the host with a scene.
    fn restart_host(&mut self, scene: Scene) {
        self.host.restart(scene, self.now, &mut self.random);
        self.tick_checks.reset();
        self.forces.set_surfaces(forces(self.terrain, &scene));
        self.poisoned = false;
    }

    /// Resets the device. Its encoders count from the arm's present position.
    fn reset(&mut self, cause: ResetCause) {
        let clock = self.clock.clone();
        self.device = board::reset(&self.device, clock, cause, &mut self.random);
        self.count_offset = self.arm.counts().map(i32::wrapping_neg);
        self.tick_checks.reset();
    }

    /// Queries the status until it is answered.
    fn status(&mut self) -> Result<Status, String> {
        self.host.status = None;
        let began = self.now;
        while self.now < began + STATUS_TIMEOUT {
            if (self.now - began).is_multiple_of(100) {
                self.host.greet_if_closed(self.now, &mut self.random);
                self.host.query_status();
            }
            self.tick(None)?;
            if let Some(status) = self.host.status.take() {
                self.tick_checks
                    .check_created_energy(status.health.created_mj)?;
                return Ok(status);
            }
        }
        Err("the device does not report its status".into())
    }

    /// Clears faults, zeroes and arms as a user would, until the force is ramped up.
    fn arm_device(&mut self) -> Result<(), String> {
        for _ in 0..MAX_ATTEMPTS {
            if self.try_to_arm()? {
                return Ok(());
            }
        }
        Err(format!("the arm cannot be armed: {:?}", self.status()?))
    }

    fn try_to_arm(&mut self) -> Result<bool, String> {
        let began = self.now;
        self.dead_man = false;
        self.host.greet(self.now, &mut self.random);
        while self.now < began + ARMING_TIMEOUT {
            let at = self.now - began;
            match at {
                30 => self.host.request(Request::Disarm),
                40 => {
                    let fault = self.host.fault;
                    self.host.request(Request::ClearFault { fault });
                }
                50 => self.send_zero(),
                ARM_REQUEST_TICK => self.host.request(Request::Arm),
                PRESS_TICK => self.dead_man = true,
                _ => {}
            }
            let hand_motion = if at > PRESS_TICK + 300 {
                HandMotion::Wander
            } else {
                HandMotion::Lifted
            };
            self.tick_with(hand_motion, None)?;
            let latest = self.tick_checks.latest();
            if at > PRESS_TICK && self.outputs.enabled && latest == Some(Mode::Armed) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Sends the zero pose: in it the encoders would read their permanent errors.
    fn send_zero(&mut self) {
        self.zero = self.count_offset;
        self.host.request(Request::Zero { counts: self.zero });
    }

    fn tick(&mut self, injected: Option<&mut InjectedFault>) -> Result<(), String> {
        let hand_motion = injected
            .as_ref()
            .map_or(HandMotion::Wander, |injected| injected.hand_motion());
        self.tick_with(hand_motion, injected)
    }

    /// Advances everything by one tick.
    fn tick_with(
        &mut self,
        hand_motion: HandMotion,
        injected: Option<&mut InjectedFault>,
    ) -> Result<(), String> {
        self.arm
            .break_amplifier(injected.as_ref().and_then(|injected| injected.amplifier()));
        let mut inputs = GuardInputs {
            counts: self.arm.counts(),
            dead_man: self.dead_man,
            emergency_stop: false,
            hardware_failed: false,
            outputs_not_as_set: false,
            amplifier_not_ready: !self.arm.plant().amplifiers_are_ready(),
            measured_ma: Some(self.measured_ma),
            clutch: false,
        };
        self.measured_ma = self.arm.plant().monitors_ma();
        for (count, count_offset) in inputs.counts.iter_mut().zip(self.count_offset) {
            *count += count_offset;
        }
        let (mut disturbance, mut tiles) = (LinkDisturbance::default(), Tiles::Sent);
        let (mut reading, mut stalls) = (Reading::default(), false);
        let mut core = Core::Runs;
        if let Some(injected) = injected {
            if injected.kind != Kind::Clutch {
                self.calm_from = injected.ticks.end + SETTLING_TICKS;
            }
            injected.apply_to_inputs(
                &mut inputs,
                &mut self.count_offset,
                self.now,
                &mut self.random,
            );
            (disturbance, tiles) = (injected.disturbance(), injected.tiles());
            (reading, stalls) = (injected.reading(self.now), injected.stalls());
            self.poisoned |= tiles == Tiles::Poisoned;
            core = injected.core(self.now);
            if injected.unplugs(self.now) || injected.halts_endpoint(&mut self.random) {
                self.device.link.interrupted();
            }
            if let Some(message) = injected.misplaced(&mut self.random, self.scene.epoch) {
                self.host
                    .send(&message, self.now, &disturbance, &mut self.random);
            }
        }
        self.clock.set(reading);
        let mut output = [0; 1024];
        let length = self.run_core(core, inputs, stalls, &mut output);
        let output = &output[..length];
        self.host
            .receive(output, self.now, &disturbance, tiles, &mut self.random);
        self.check_tick(core, &inputs)?;
        let currents = self.outputs.currents_a.to_array().map(f64::from);
        self.arm.step(currents, hand_motion);
        self.armed += u64::from(self.outputs.enabled);
        self.now += 1;
        Ok(())
    }

    /// Runs the core for a tick. Returns the number of bytes it sent.
    fn run_core(
        &mut self,
        core: Core,
        inputs: GuardInputs,
        stalls: bool,
        output: &mut [u8],
    ) -> usize {
        match core {
            Core::Runs if stalls => self.outputs = self.device.tick_alone(inputs),
            Core::Runs => {
                let device = &mut self.device;
                self.host
                    .deliver(self.now, &mut |bytes| device.receive(bytes));
                self.outputs = device.tick(inputs);
                return device.link.transmit(output);
            }
            // The last command stays on.
            Core::Halted => {}
            Core::Down => self.outputs = GuardOutputs::default(),
            Core::Resets(cause) => {
                self.reset(cause);
                self.outputs = GuardOutputs::default();
            }
        }
        0
    }

    fn check_tick(&mut self, core: Core, inputs: &GuardInputs) -> Result<(), String> {
        if let Some(error) = self.host.failed.take() {
            return Err(format!("the link broke: {error}"));
        }
        let plant = self.arm.plant();
        let truth = Truth {
            q_rad: plant.q_rad(),
            counts: plant.counts(),
            winding_c: plant.winding_c(),
        };
        if core == Core::Halted {
            self.tick_checks.check_held(&self.outputs, &truth)?;
        } else {
            self.tick_checks
                .check_outputs(&self.outputs, inputs, self.zero, &truth)?;
        }
        if core == Core::Runs {
            let believed_c = self.device.temperatures().winding_c();
            self.tick_checks.check_temperature(believed_c, &truth)?;
            self.device
                .calibration()
                .map_or(Ok(()), hostile_calibrations::check_limits)?;
        }
        for sample in std::mem::take(&mut self.host.samples) {
            self.tick_checks
                .check_sample(&sample, self.scene.params.max_force_n)?;
            let is_calm = self.now >= self.calm_from && !self.poisoned;
            self.forces.check(&sample, is_calm)?;
        }
        Ok(())
    }
}

/// Returns the possible surfaces of a scene.
fn forces(terrain: &Terrain<'_>, scene: &Scene) -> SceneSurfaces {
    let materials = terrain.grid().materials();
    SceneSurfaces::of(&scene.params, materials.map(Materials::table))
}

fn scene(
    terrain: &Terrain<'_>,
    arm: &Arm<'_>,
    effects: Option<&Effects>,
    random: &mut Random,
) -> Scene {
    let stiffness_n_per_mm = random.between(0.3, 0.8) as f32;
    let params = match effects {
        // A new scene each time.
        Some(effects) => effects.params(0.5 + stiffness_n_per_mm),
        None => SurfaceParams {
            stiffness_n_per_mm,
            max_force_n: 8.5,
            ..SurfaceParams::PREMIUM
        },
    };
    let home = terrain.scale().to_grid(arm.home_mm()).expect("in range");
    Scene {
        // Real time: the device does not wait for the host.
        hold_clock: false,
        ..terrain.scene(params, Source::Encoders, home)
    }
}
