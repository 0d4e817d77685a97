//! The whole tick: encoder counts, pose, HIP, contact, force, guard, torques,
//! currents.

use hapterra::phantom::{ArmFrame, Encoder, PhantomModel, kinematics};
use hapterra_core::contact::ContactState;
use hapterra_core::force::{
    Controller, Damping, Material, Pattern, Shading, SurfaceParams, Texture,
};
use hapterra_core::grid::Cell;
use hapterra_core::scene::{Scene, Source};
use hapterra_core::terrain::{CoarseTile, Fallback};
use hapterra_lab::grid::Grid;
use hapterra_lab::path::Random;
use hapterra_lab::tick_states::{TICKS, terrain};
use hapterra_tests::instruction_counter::{CountingBoard, Samples};
use hapterra_tests::scene::materials::Materials;

use super::contact::{GridSamples, rough, scene, with_params};
use super::table::{Row, Target, Tick};

/// Ticks of the descent, which do not count.
const APPROACH: usize = 50;

/// The tick before which tiles arrive and begin to blend.
const ARRIVAL: Option<usize> = Some(APPROACH);
/// Height of the fallback above the tiles, motion of the surface in a tick, and ticks of a blend.
const FALLBACK_HEIGHT_MM: f64 = 3.0;
const STEP_MM: f64 = 0.05;
const BLEND_TICKS: usize = 60;
/// Number of blends.
const RUNS: u32 = 20;

/// A field in cells of a millimetre, and a fallback with an error.
struct Under<'g>(GridSamples<'g>);

impl Samples for Under<'_> {
    fn sample(&self, column: i32, row: i32) -> f32 {
        self.0.sample(column, row)
    }

    fn under(&self, column: i32, row: i32) -> f32 {
        self.sample(column, row) + FALLBACK_HEIGHT_MM as f32
    }
}

/// An arm over the middle of the terrain.
struct Arm<'g> {
    grid: &'g Grid,
    model: PhantomModel,
    placement: ArmFrame,
}

/// Returns all rows.
pub(crate) fn rows(board: &CountingBoard) -> Vec<Row> {
    let grid = terrain();
    let arm = Arm::over(&grid);
    let mut random = Random(21);
    let mut heading = 0.3_f64;
    let mut at = [0.0, 0.0];
    let mut slide = |speed: f64| {
        heading += random.between(-0.05, 0.05);
        // Within 40 mm of home: turned back at this border.
        if f64::hypot(at[0], at[1]) > 40.0 {
            heading = f64::atan2(-at[1], -at[0]);
        }
        at = [at[0] + speed * heading.cos(), at[1] + speed * heading.sin()];
        at
    };
    let free: Vec<_> = (0..TICKS).map(|_| arm.counts(slide(0.05), 1.5)).collect();
    let sliding: Vec<_> = (0..TICKS).map(|_| arm.counts(slide(0.05), -0.4)).collect();
    let fast: Vec<_> = (0..TICKS).map(|_| arm.counts(slide(0.5), -0.4)).collect();
    let rested = arm.counts([3.0, 4.0], -0.4);
    let mut random = Random(22);
    let mut tremble = || random.between(-1.5, 1.5).round() as i32;
    let resting = (0..TICKS).map(|_| rested.map(|count| count + tremble()));
    let resting: Vec<_> = resting.collect();
    let in_contact = Target {
        median: Some(2500),
        p99: Some(3500),
        max: Some(10_000),
    };
    let in_the_air = Target {
        median: None,
        p99: None,
        ..in_contact
    };
    let row = |name, target, counts: &[_], state| {
        arm.row(board, name, target, (counts, arm.scene()), state)
    };
    let fast_rough = (&fast[..], rough(arm.scene()));
    let smooth = |params| SurfaceParams {
        shading: Shading::Smooth,
        ..params
    };
    let damped = |params| SurfaceParams {
        damping: Damping {
            ns_per_m: 2.0,
            controller: Controller::On,
        },
        ..params
    };
    let grained = |params| SurfaceParams {
        texture: Texture {
            pattern: Pattern::Grain,
            amplitude_mm: 0.1,
            wavelength_mm: 1.0,
            direction_deg: 0.0,
            seed: 1,
        },
        ..params
    };
    let grated = |params| {
        let mut params = grained(params);
        (params.texture.pattern, params.texture.direction_deg) = (Pattern::Grating, 30.0);
        params
    };
    let grain = (&sliding[..], with_params(arm.scene(), grained));
    let grating = (&sliding[..], with_params(arm.scene(), grated));
    let shaded = (&sliding[..], with_params(arm.scene(), smooth));
    let damping = (&sliding[..], with_params(arm.scene(), damped));
    let controlled = |scene| with_params(scene, |params| with_controller(params, Controller::On));
    let all = with_params(with_params(rough(arm.scene()), smooth), damped);
    // Slower than half a cell a tick, at which the texture has faded.
    let coarse = |params| {
        let mut params = grained(params);
        params.texture.wavelength_mm = 8.0;
        params
    };
    let all = with_params(all, coarse);
    let hard = |params| SurfaceParams {
        stiffness_n_per_mm: 0.8,
        ..params
    };
    let two = arm.classes(&[arm.scene().params, hard(arm.scene().params)]);
    let other = |params: SurfaceParams| {
        let mut params = hard(params);
        params.texture.pattern = Pattern::Grating;
        params.friction.dynamic_mu = 0.1;
        params.damping.ns_per_m = 1.0;
        params
    };
    let each = arm.classes(&[all.params, other(all.params), arm.scene().params]);
    let on = |scene: Scene, materials: &Materials| Scene {
        materials: Some(materials.reported().check_sum()),
        ..scene
    };
    let on_two = (&sliding[..], on(arm.scene(), &two), Some(&two));
    let on_two_controlled = (&sliding[..], on(controlled(arm.scene()), &two), Some(&two));
    let each_controlled = |name, (counts, scene): (_, Scene), state| {
        arm.row(board, name, in_the_air, (counts, controlled(scene)), state)
    };
    let on_each = (&fast[..], on(all, &each), Some(&each));
    let all = (&fast[..], all);
    vec![
        row("chain, free", in_the_air, &free, ContactState::Free),
        row(
            "chain, sliding",
            in_contact,
            &sliding,
            ContactState::Touching,
        ),
        row(
            "chain, sliding fast",
            in_contact,
            &fast,
            ContactState::Touching,
        ),
        arm.row(
            board,
            "chain, sliding fast, rough",
            in_the_air,
            fast_rough,
            ContactState::Touching,
        ),
        arm.row(
            board,
            "chain, sliding, shaded",
            in_the_air,
            shaded,
            ContactState::Touching,
        ),
        arm.row(
            board,
            "chain, sliding, grain",
            in_the_air,
            grain,
            ContactState::Touching,
        ),
        arm.row(
            board,
            "chain, sliding, grating",
            in_the_air,
            grating,
            ContactState::Touching,
        ),
        arm.row(
            board,
            "chain, sliding, damped",
            in_the_air,
            damping,
            ContactState::Touching,
        ),
        arm.row(
            board,
            "chain, sliding fast, all effects",
            in_the_air,
            all,
            ContactState::Touching,
        ),
        arm.row_on(
            board,
            "chain, sliding, materials",
            in_the_air,
            on_two,
            ContactState::Touching,
        ),
        arm.row_on(
            board,
            "chain, sliding fast, all effects and materials",
            in_the_air,
            on_each,
            ContactState::Touching,
        ),
        arm.settling(
            board,
            "chain, sliding, fallback",
            in_the_air,
            (arm.scene(), None),
        ),
        arm.settling(
            board,
            "chain, sliding, settling",
            in_the_air,
            (arm.scene(), ARRIVAL),
        ),
        arm.settling(
            board,
            "chain, sliding, settling, all effects",
            in_the_air,
            (all.1, ARRIVAL),
        ),
        row(
            "chain, resting",
            in_contact,
            &resting,
            ContactState::Touching,
        ),
        each_controlled(
            "chain, free, controller",
            (&free[..], arm.scene()),
            ContactState::Free,
        ),
        each_controlled(
            "chain, sliding, controller",
            (&sliding[..], arm.scene()),
            ContactState::Touching,
        ),
        each_controlled(
            "chain, sliding fast, controller",
            (&fast[..], arm.scene()),
            ContactState::Touching,
        ),
        each_controlled(
            "chain, sliding fast, rough, controller",
            fast_rough,
            ContactState::Touching,
        ),
        each_controlled(
            "chain, sliding, shaded, controller",
            shaded,
            ContactState::Touching,
        ),
        each_controlled(
            "chain, sliding, grain, controller",
            grain,
            ContactState::Touching,
        ),
        arm.row_on(
            board,
            "chain, sliding, materials, controller",
            in_the_air,
            on_two_controlled,
            ContactState::Touching,
        ),
        arm.settling(
            board,
            "chain, sliding, settling, controller",
            in_the_air,
            (controlled(arm.scene()), ARRIVAL),
        ),
        each_controlled(
            "chain, resting, controller",
            (&resting[..], arm.scene()),
            ContactState::Touching,
        ),
    ]
}

fn with_controller(mut params: SurfaceParams, controller: Controller) -> SurfaceParams {
    params.damping.controller = controller;
    params
}

impl<'g> Arm<'g> {
    fn over(grid: &'g Grid) -> Self {
        let (x, y) = (0.5 * grid.columns as f64, 0.5 * grid.rows as f64);
        Self {
            grid,
            model: PhantomModel::premium_1_5(),
            placement: ArmFrame {
                home_mm: [x, y, grid.height(x, y).floor()],
            },
        }
    }

    /// Returns the materials of these surface parameters, in squares of five samples: during a
    /// slide the material almost always changes.
    fn classes(&self, all_params: &[SurfaceParams]) -> Materials {
        let table: Vec<Material> = all_params.iter().map(Material::of).collect();
        let size = [self.grid.columns as i32, self.grid.rows as i32];
        let count = table.len() as i32;
        Materials::from_fn(&table, size, |x, y| ((x / 5 + y / 5) % count) as u8)
    }

    /// Returns the counts with the tip `above` mm over the surface, `off` mm from home.
    fn counts(&self, off: [f64; 2], above: f64) -> [i32; 3] {
        let home = self.placement.home_mm;
        let (x, y) = (home[0] + off[0], home[1] + off[1]);
        self.counts_at([x, y, self.grid.height(x, y) + above])
    }

    fn counts_at(&self, terrain_mm: [f64; 3]) -> [i32; 3] {
        let device_m = self.placement.to_device_m(&self.model, terrain_mm);
        let angles = kinematics::inverse(&self.model, device_m).expect("in reach");
        let read = |axis: usize| Encoder::new(&self.model.drive[axis]).counts(angles[axis]);
        [read(0), read(1), read(2)]
    }

    fn scene(&self) -> Scene {
        let [x, y, z] = self.placement.home_mm;
        let home = hapterra_lab::variant::Hip::at([x, y, z]).grid;
        let arm = Scene {
            home,
            source: Source::Encoders,
            ..scene(self.grid)
        };
        // Only the rows that name the controller have it.
        with_params(arm, |params| with_controller(params, Controller::Off))
    }

    /// Slides over the fallback, which is [`FALLBACK_HEIGHT_MM`] off, at half a cell a tick, once
    /// in each of several directions. Counts the ticks from the arrival of tiles to the end of the
    /// blend, or as many without tiles.
    fn settling(
        &self,
        board: &CountingBoard,
        name: &str,
        target: Target,
        (scene, late): (Scene, Option<usize>),
    ) -> Row {
        let spacing = |shift: u8| CoarseTile {
            first: Cell::new(0, 0),
            shift,
        };
        let near = CoarseTile {
            first: Cell::new(64, 64),
            ..spacing(2)
        };
        let scene = Scene {
            fallback: Some(Fallback {
                wide: spacing(3),
                near: Some(near),
            }),
            ..scene
        };
        let field = Under(GridSamples(self.grid));
        let counted = APPROACH..APPROACH + BLEND_TICKS;
        let runs = (0..RUNS).flat_map(|run| {
            let heading = f64::from(run) * 0.7;
            let along = |tick: usize| 0.5 * (tick as f64 - 0.5 * counted.end as f64);
            let surface = |tick: usize| match late {
                Some(late) => FALLBACK_HEIGHT_MM - STEP_MM * tick.saturating_sub(late) as f64,
                None => FALLBACK_HEIGHT_MM,
            };
            let above = |tick: usize| 2.0 * (1.0 - tick as f64 / APPROACH as f64) - 0.4;
            let counts: Vec<_> = (0..counted.end)
                .map(|tick| {
                    let off = [heading.cos(), heading.sin()].map(|part| part * along(tick));
                    self.counts(off, surface(tick) + above(tick).max(-0.4))
                })
                .collect();
            let late = late.map(|late| late as u32);
            let ticks = board.chain_over_fallback(&scene, &field, (late, &counts));
            ticks.into_iter().enumerate().skip(counted.start)
        });
        let touching = ContactState::Touching as u32;
        let there = runs.filter(|(_, tick)| tick.state == touching && tick.converged);
        let there: Vec<Tick> = there.map(|(index, tick)| Tick::of(&tick, index)).collect();
        assert!(
            there.len() > RUNS as usize * BLEND_TICKS * 9 / 10,
            "{name}: {}",
            there.len()
        );
        Row::new(name, target, there)
    }

    /// Runs the counts after a descent to the first of them, and counts the ticks in which the
    /// proxy is in `state`: nearly all of them.
    fn row(
        &self,
        board: &CountingBoard,
        name: &str,
        target: Target,
        (counts, scene): (&[[i32; 3]], Scene),
        state: ContactState,
    ) -> Row {
        self.row_on(board, name, target, (counts, scene, None), state)
    }

    /// Same as `row`, on materials if there are some.
    fn row_on(
        &self,
        board: &CountingBoard,
        name: &str,
        target: Target,
        (counts, scene, materials): (&[[i32; 3]], Scene, Option<&Materials>),
        state: ContactState,
    ) -> Row {
        let pose = |counts: &[i32; 3]| {
            let angle = |axis: usize| Encoder::new(&self.model.drive[axis]).angle_rad(counts[axis]);
            let tip = kinematics::tip(&self.model, [angle(0), angle(1), angle(2)]);
            self.placement.to_terrain_mm(&self.model, tip)
        };
        let [x, y, z] = pose(&counts[0]);
        let down = (0..APPROACH).map(|i| {
            let above = 2.0 * (1.0 - i as f64 / APPROACH as f64);
            self.counts_at([x, y, z + above])
        });
        let all: Vec<_> = down.chain(counts.iter().copied()).collect();
        let ground = (&GridSamples(self.grid) as _, materials);
        let ticks = board.chain(&scene, ground, &all);
        assert_eq!(ticks.len(), all.len());
        let ticks = ticks.iter().enumerate().skip(APPROACH);
        let there = ticks.filter(|(_, tick)| tick.state == state as u32 && tick.converged);
        let there: Vec<Tick> = there.map(|(index, tick)| Tick::of(tick, index)).collect();
        assert!(
            there.len() > counts.len() * 9 / 10,
            "{name}: {}",
            there.len()
        );
        Row::new(name, target, there)
    }
}
