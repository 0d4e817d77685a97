//! The boards' tick around a virtual arm over a level plane.

use std::collections::VecDeque;

use hapterra_core::Vec3;
use hapterra_core::clutch::ClutchHold;
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
pub(super) struct Step {
    /// Report of the tick.
    pub(super) sample: TickRecord,
    /// Height of the tip by its encoders at the start of the tick, mm.
    pub(super) read_up_mm: f64,
    /// True position of the tip after the tick, east, north and up, mm.
    pub(super) tip_mm: [f64; 3],
    /// Energy from the surface to the arm in the tick, mJ: the work of its part of the motors'
    /// torques.
    pub(super) given_mj: f64,
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

/// Runs an arm in an arming hand until its script ends, and calls `look` for every tick with the
/// time since the script's start, s. Ends early if `look` requests it.
pub(super) fn run(
    settings: &LoopSettings,
    mut arm: HeldPhantom,
    look: &mut dyn FnMut(f64, &Step) -> bool,
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
    let mechanism = Kinematics::new(&Calibration::PREMIUM_1_5).ok();
    if let Some(mechanism) = mechanism {
        haptics.configure(mechanism);
    }
    let scene = scene(settings);
    for command in [Command::Scene(scene), Command::Zero([0; 3]), Command::Arm] {
        let _ = haptics.accept(command);
    }
    let mut requester = TileRequester::<WINDOW>::new();
    requester.reset(scene.level, scene.size);

    let begin_s = arm.begin_s();
    let tick_s = 1.0 / f64::from(settings.rate.hz());
    let mut wire = Wire::new(settings.delay_s, tick_s, arm.plant().model());
    let ticks = ((begin_s + arm.script_s()) / tick_s) as u32;
    let at = |s: f64| ((begin_s + s) / tick_s) as u32;
    for tick in 0..ticks {
        if let Some([held_s, let_go_s]) = settings.clutch_s {
            let hold = [
                (held_s, ClutchHold::WithHand),
                (let_go_s, ClutchHold::LetGo),
            ];
            for (_, hold) in hold.into_iter().filter(|(s, _)| at(*s) == tick) {
                let _ = haptics.accept(Command::Clutch(hold));
            }
        }
        let sense = arm.guard_inputs();
        let read_up_mm = read_up_mm(&arm, sense.counts);
        let outcome = haptics.tick(&sense, true);
        let sample = outcome.sample;
        let demand = RequestHint {
            missing_tile: sample.missing_tile,
            proxy: sample.proxy.column(),
            hip: sample.hip.column(),
            velocity: [0.0; 2],
        };
        while let Some(key) = requester.next_request(sample.tick, &demand) {
            let Some(tile) = spare.pop() else { break };
            fill(tile, key, scene.size);
            requester.received(key);
            spare.extend(haptics.accept(Command::Tile(tile)).ok().flatten());
        }
        let weight_a = mechanism.map_or(Vec3::ZERO, |mechanism| {
            let pose = mechanism.pose(sense.counts, [0; 3]);
            mechanism.currents_a(mechanism.gravity_nm(&pose))
        });
        let currents_a = outcome.drive.currents_a;
        let sent = Sent {
            currents_a: currents_a.to_array().map(f64::from),
            of_surface_a: match sample.force_n == Vec3::ZERO {
                true => [0.0; 3],
                false => (currents_a - weight_a).to_array().map(f64::from),
            },
        };
        let given_mj = wire.carry(sent, &mut arm);
        let step = Step {
            sample,
            read_up_mm,
            tip_mm: tip_mm(&arm),
            given_mj,
        };
        if !look(f64::from(tick) * tick_s - begin_s, &step) {
            return;
        }
    }
}

/// Currents from a tick to the motors, A.
#[derive(Clone, Copy, Default)]
struct Sent {
    currents_a: [f64; 3],
    /// The surface's part of them; the rest holds the arm's weight.
    of_surface_a: [f64; 3],
}

/// The delay of a board from its encoders to its amplifiers.
struct Wire {
    /// Commands in transit: the motors' present ones, then later ones.
    sent: VecDeque<Sent>,
    /// Part of a tick during which the motors still have the previous commands, s.
    late_s: f64,
    tick_s: f64,
    work: SurfaceWork,
}

impl Wire {
    fn new(delay_s: f64, tick_s: f64, model: &PhantomModel) -> Self {
        let whole = (delay_s / tick_s).floor();
        Self {
            sent: VecDeque::from(vec![Sent::default(); whole as usize + 1]),
            late_s: delay_s - whole * tick_s,
            tick_s,
            work: SurfaceWork::new(model),
        }
    }

    /// Sends a tick's commands, and moves the arm for the duration of the tick. Returns the energy
    /// from the surface to the arm, mJ.
    fn carry(&mut self, sent: Sent, arm: &mut HeldPhantom) -> f64 {
        self.sent.push_back(sent);
        let before = self.sent.pop_front().unwrap_or(sent);
        let now = self.sent.front().copied().unwrap_or(sent);
        let parts = [(before, self.late_s), (now, self.tick_s - self.late_s)];
        let given_mj = parts.map(|(sent, for_s)| match for_s > 0.0 {
            true => self
                .work
                .step(sent.currents_a, sent.of_surface_a, for_s, arm),
            false => 0.0,
        });
        given_mj.iter().sum()
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
fn read_up_mm(arm: &HeldPhantom, counts: [i32; 3]) -> f64 {
    let model = arm.plant().model();
    let q = std::array::from_fn(|axis| Encoder::new(&model.drive[axis]).angle_rad(counts[axis]));
    HOME.to_terrain_mm(model, kinematics::tip(model, q))[2]
}

/// Returns the true position of the tip, mm, its height over the terrain's datum.
fn tip_mm(arm: &HeldPhantom) -> [f64; 3] {
    let plant = arm.plant();
    HOME.to_terrain_mm(plant.model(), plant.tip_m())
}
