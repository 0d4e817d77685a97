//! The boards' tick around a virtual arm over a level plane.

use std::collections::VecDeque;

use hapterra_core::Vec3;
use hapterra_core::clutch::ClutchMode;
use hapterra_core::force::{Damping, SurfaceParams, Texture};
use hapterra_core::grid::GridPoint;
use hapterra_core::phantom::{Calibration, Kinematics};
use hapterra_core::rate::TickRate;
use hapterra_core::scene::{Scene, Source, TickRecord};
use hapterra_core::terrain::{FieldSize, RequestHint, Tile, TileKey, TileRequester};
use hapterra_core::tick::{Board, Command, Haptics};

use super::surface_work::SurfaceWork;
use hapterra::phantom::{ArmFrame, Encoder, HeldPhantom, PhantomModel, kinematics};

/// Tiles along a side of the loop's window, and size of the plane's cells, mm.
const WINDOW: usize = 4;
const CELLS: i32 = 64;
pub(super) const CELL_MM: f64 = 4.0;
/// The plane's height, and the position of the arm's home pose: in its middle, close above it.
pub(super) const PLANE_MM: f64 = 20.0;
pub(super) const HOME: ArmFrame = ArmFrame {
    home_mm: [128.0, 128.0, 24.0],
};
/// Largest force, N, as in every other scene.
const MAX_N: f32 = SurfaceParams::PREMIUM.max_force_n;

/// Record of one tick.
pub(super) struct LoopTick {
    /// Report of the tick.
    pub(super) sample: TickRecord,
    /// Height of the tip by its encoders at the start of the tick, mm.
    pub(super) encoder_height_mm: f64,
    /// True position of the tip after the tick, east, north and up, mm.
    pub(super) tip_mm: [f64; 3],
    /// Energy from the surface to the arm in the tick, mJ: the work of its part of the motors'
    /// torques.
    pub(super) gained_mj: f64,
}

/// Settings of a loop and its surface.
pub(super) struct LoopSettings {
    pub(super) rate: TickRate,
    pub(super) stiffness_n_per_mm: f64,
    pub(super) damping: Damping,
    pub(super) texture: Texture,
    /// Delay from the encoders to the amplifiers, s.
    pub(super) delay_s: f64,
    /// Times at which the clutch is held and released, s after the script's start.
    pub(super) clutch_s: Option<[f64; 2]>,
}

/// Runs an arm in an arming hand until its script ends, and calls `observe` for every tick with the
/// time since the script's start, s. Ends early if `observe` requests it.
pub(super) fn run(
    settings: &LoopSettings,
    mut arm: HeldPhantom,
    observe: &mut dyn FnMut(f64, &LoopTick) -> bool,
) {
    let mut tiles = vec![Tile::VACANT; WINDOW * WINDOW + 1];
    let mut spare: Vec<_> = tiles.iter_mut().collect();
    let slots = std::array::from_fn(|_| {
        std::array::from_fn(|_| spare.pop().unwrap_or_else(|| unreachable!("a tile a slot")))
    });
    // The amplifiers' lag in the plant is added to this.
    let lag_s = arm.plant().model().drive[0].motor.current_lag_s;
    let board = Board {
        rate: settings.rate,
        latency_s: (settings.delay_s + lag_s) as f32,
        motors: None,
        fault: None,
    };
    let mut haptics = Haptics::<WINDOW>::on_board(slots, &board);
    let kinematics = Kinematics::new(&Calibration::PREMIUM_1_5).ok();
    if let Some(kinematics) = kinematics {
        haptics.configure(kinematics);
    }
    let scene = scene(settings);
    for command in [Command::Scene(scene), Command::Zero([0; 3]), Command::Arm] {
        let _ = haptics.accept(command);
    }
    let mut requester = TileRequester::<WINDOW>::new();
    requester.reset(scene.level, scene.size);

    let begin_s = arm.begin_s();
    let tick_s = 1.0 / f64::from(settings.rate.hz());
    let mut command_delay = CommandDelay::new(settings.delay_s, tick_s, arm.plant().model());
    let ticks = ((begin_s + arm.script_s()) / tick_s) as u32;
    let at = |s: f64| ((begin_s + s) / tick_s) as u32;
    for tick in 0..ticks {
        if let Some([held_s, release_s]) = settings.clutch_s {
            let hold = [
                (held_s, ClutchMode::WithHand),
                (release_s, ClutchMode::Released),
            ];
            for (_, hold) in hold.into_iter().filter(|(s, _)| at(*s) == tick) {
                let _ = haptics.accept(Command::Clutch(hold));
            }
        }
        let inputs = arm.guard_inputs();
        let encoder_height_mm = encoder_height_mm(&arm, inputs.counts);
        let outcome = haptics.tick(&inputs, true);
        let sample = outcome.sample;
        let hint = RequestHint {
            missing_tile: sample.missing_tile,
            proxy: sample.proxy.column(),
            hip: sample.hip.column(),
            velocity: [0.0; 2],
        };
        while let Some(key) = requester.next_request(sample.tick, &hint) {
            let Some(tile) = spare.pop() else { break };
            fill(tile, key, scene.size);
            requester.received(key);
            spare.extend(haptics.accept(Command::Tile(tile)).ok().flatten());
        }
        let weight_a = kinematics.map_or(Vec3::ZERO, |kinematics| {
            let pose = kinematics.pose(inputs.counts, [0; 3]);
            kinematics.currents_a(kinematics.gravity_nm(&pose))
        });
        let currents_a = outcome.drive.currents_a;
        let commands = MotorCommands {
            currents_a: currents_a.to_array().map(f64::from),
            surface_currents_a: match sample.force_n == Vec3::ZERO {
                true => [0.0; 3],
                false => (currents_a - weight_a).to_array().map(f64::from),
            },
        };
        let gained_mj = command_delay.advance(commands, &mut arm);
        let step = LoopTick {
            sample,
            encoder_height_mm,
            tip_mm: tip_mm(&arm),
            gained_mj,
        };
        if !observe(f64::from(tick) * tick_s - begin_s, &step) {
            return;
        }
    }
}

/// Currents from a tick to the motors, A.
#[derive(Clone, Copy, Default)]
struct MotorCommands {
    currents_a: [f64; 3],
    /// The surface's part of them; the rest holds the arm's weight.
    surface_currents_a: [f64; 3],
}

/// The delay of a board from its encoders to its amplifiers.
struct CommandDelay {
    /// Commands in transit: the motors' present ones, then later ones.
    commands: VecDeque<MotorCommands>,
    /// Part of a tick during which the motors still have the previous commands, s.
    partial_delay_s: f64,
    tick_s: f64,
    work: SurfaceWork,
}

impl CommandDelay {
    fn new(delay_s: f64, tick_s: f64, model: &PhantomModel) -> Self {
        let whole = (delay_s / tick_s).floor();
        Self {
            commands: VecDeque::from(vec![MotorCommands::default(); whole as usize + 1]),
            partial_delay_s: delay_s - whole * tick_s,
            tick_s,
            work: SurfaceWork::new(model),
        }
    }

    /// Sends a tick's commands, and moves the arm for the duration of the tick. Returns the energy
    /// from the surface to the arm, mJ.
    fn advance(&mut self, commands: MotorCommands, arm: &mut HeldPhantom) -> f64 {
        self.commands.push_back(commands);
        let before = self.commands.pop_front().unwrap_or(commands);
        let now = self.commands.front().copied().unwrap_or(commands);
        let parts = [
            (before, self.partial_delay_s),
            (now, self.tick_s - self.partial_delay_s),
        ];
        let gained_mj = parts.map(|(commands, duration_s)| match duration_s > 0.0 {
            true => self.work.step(
                commands.currents_a,
                commands.surface_currents_a,
                duration_s,
                arm,
            ),
            false => 0.0,
        });
        gained_mj.iter().sum()
    }
}

fn scene(settings: &LoopSettings) -> Scene {
    let [east, north, up] = HOME.home_mm.map(|mm| mm / CELL_MM);
    Scene {
        epoch: 1,
        level: 0,
        size: FieldSize::new(CELLS, CELLS),
        top: 64,
        fallback: None,
        cell_mm: CELL_MM as f32,
        home: GridPoint::new([east as i32, north as i32, up as i32], Vec3::ZERO),
        params: SurfaceParams {
            stiffness_n_per_mm: settings.stiffness_n_per_mm as f32,
            max_force_n: MAX_N,
            damping: settings.damping,
            texture: settings.texture,
            ..SurfaceParams::PREMIUM
        },
        source: Source::Encoders,
        hold_clock: false,
        materials: None,
    }
}

fn fill(tile: &mut Tile, key: TileKey, size: FieldSize) {
    // A level plane fits into every tile.
    let _ = tile.fill_from(key, 0, size, |_, _| (PLANE_MM / CELL_MM) as f32);
}

/// Returns the height of the tip by its encoders, mm.
fn encoder_height_mm(arm: &HeldPhantom, counts: [i32; 3]) -> f64 {
    let model = arm.plant().model();
    let q = std::array::from_fn(|axis| Encoder::new(&model.drive[axis]).angle_rad(counts[axis]));
    HOME.to_terrain_mm(model, kinematics::tip(model, q))[2]
}

/// Returns the true position of the tip, mm, its height over the terrain's datum.
fn tip_mm(arm: &HeldPhantom) -> [f64; 3] {
    let plant = arm.plant();
    HOME.to_terrain_mm(plant.model(), plant.tip_m())
}
