//! The states of the contact alone: the same paths of the HIP as for the counts on the host, and
//! the long sweeps.

use hapterra_core::contact::Friction;
use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::scene::{Scene, Source};
use hapterra_core::terrain::{FieldSize, TileKey};
use hapterra_lab::grid::Grid;
use hapterra_lab::path;
use hapterra_lab::tick_states::{STATES, Step, TICKS, terrain};
use hapterra_lab::variant::Hip;
use hapterra_tests::instruction_counter::{CountingBoard, Event, Replay, Samples, tiles};

use super::table::{Row, Target, Tick};

/// The friction of rough surfaces.
pub(crate) const ROUGH: Friction = Friction {
    static_mu: 0.5,
    dynamic_mu: 0.3,
    viscous_s: 0.001,
};
/// The states that are also counted on rough surfaces.
const IN_CONTACT: [&str; 4] = ["first contact", "sliding", "sliding fast", "resting"];

/// Returns the target of a state.
fn target(state: &str) -> Target {
    let of = |median, p99| Target {
        median,
        p99,
        max: Some(10_000),
    };
    match state {
        "unmoved" => of(Some(80), None),
        "free high" | "free low" => of(Some(200), None),
        "sliding" => of(Some(300), Some(1500)),
        // The target without friction, plus 2,500 instructions.
        "first contact, rough" => of(None, Some(2_391 + 2_500)),
        "sliding, rough" => of(None, Some(1_488 + 2_500)),
        "sliding fast, rough" => of(None, Some(2_373 + 2_500)),
        "resting, rough" => of(None, Some(291 + 2_500)),
        _ => of(None, None),
    }
}

/// Returns all rows.
pub(crate) fn rows(board: &CountingBoard) -> Vec<Row> {
    let grid = terrain();
    let mut rows: Vec<Row> = STATES
        .iter()
        .map(|(state, make)| {
            row(
                board,
                &grid,
                state,
                &make(&grid),
                tiles(size(&grid)),
                scene(&grid),
            )
        })
        .collect();
    rows.extend(
        STATES
            .iter()
            .filter(|(state, _)| IN_CONTACT.contains(state))
            .map(|(state, make)| {
                let scene = rough(scene(&grid));
                let name = format!("{state}, rough");
                row(board, &grid, &name, &make(&grid), tiles(size(&grid)), scene)
            }),
    );
    // As far as a device's window reaches.
    let wide = Grid::fractal("512 × 512", [512, 512], 6, 1.0);
    let sweeps = path::sweep(&wide, "", 500.0, TICKS).expect("500 cells fit");
    let sweeps: Vec<Step> = every(&sweeps.hips);
    rows.push(row(
        board,
        &wide,
        "sweep 500, miss",
        &sweeps,
        tiles(size(&wide)),
        scene(&wide),
    ));
    // Beyond it the tiles are missing, and the path stops.
    let long = Grid::fractal("5120 × 64", [5120, 64], 6, 1.0);
    let near = tiles(FieldSize::new(512, 64));
    let (state, steps) = ("sweep 5000, held up", sweep_5000(&long));
    rows.push(row(board, &long, state, &steps, near, scene(&long)));
    rows
}

fn row(
    board: &CountingBoard,
    grid: &Grid,
    state: &str,
    steps: &[Step],
    tiles: impl Iterator<Item = TileKey>,
    scene: Scene,
) -> Row {
    let hips = steps.iter().map(|step| Event::Hip(step.hip.grid));
    let events: Vec<Event> = tiles.map(Event::Tile).chain(hips).collect();
    let replay = Replay {
        scene: &scene,
        field: &GridSamples(grid),
        events: &events,
        materials: None,
    };
    let ticks = board.contact(&[replay]).concat();
    let counted = steps.iter().zip(ticks.iter().enumerate());
    let counted = counted.filter(|(step, _)| step.counts);
    let ticks = counted.map(|(_, (index, tick))| Tick {
        instructions: tick.instructions,
        cycles: tick.cycles,
        units: tick.work,
        scene: None,
        index,
    });
    Row::new(state, target(state), ticks.collect())
}

/// A grid, cut into tiles for the board.
pub(crate) struct GridSamples<'g>(pub(crate) &'g Grid);

impl Samples for GridSamples<'_> {
    fn sample(&self, column: i32, row: i32) -> f32 {
        self.0.post(column as usize, row as usize)
    }
}

/// Returns steps that all count except the first.
fn every(hips: &[Hip]) -> Vec<Step> {
    let step = |(tick, hip): (usize, &Hip)| Step {
        hip: *hip,
        counts: tick > 0,
    };
    hips.iter().enumerate().map(step).collect()
}

/// Returns a path down at the western end, then 5,000 cells east at once, and back.
fn sweep_5000(grid: &Grid) -> Vec<Step> {
    let sky = f64::from(grid.top()) + 2.0;
    let mut random = path::Random(16);
    let mut steps = Vec::new();
    for _ in 0..TICKS / 8 {
        let at = [random.between(4.0, 60.0), random.between(4.0, 60.0)];
        let low = f64::from(grid.top()) - 0.5;
        let mut step = |x: f64, z: f64, counts| {
            let hip = Hip::at([x, at[1], z]);
            steps.push(Step { hip, counts });
        };
        step(at[0], sky, false);
        step(at[0], low, false);
        step(at[0] + 5000.0, low, true);
    }
    steps
}

fn size(grid: &Grid) -> FieldSize {
    FieldSize::new(grid.columns as i32, grid.rows as i32)
}

/// Returns the scene with a rough surface.
pub(crate) fn rough(scene: Scene) -> Scene {
    with_params(scene, |params| SurfaceParams {
        friction: ROUGH,
        ..params
    })
}

/// Returns the scene with other surface parameters.
pub(crate) fn with_params(
    scene: Scene,
    change: impl FnOnce(SurfaceParams) -> SurfaceParams,
) -> Scene {
    let params = change(scene.params);
    Scene { params, ..scene }
}

/// Returns a scene of points over the field.
pub(crate) fn scene(grid: &Grid) -> Scene {
    Scene {
        epoch: 1,
        level: 0,
        size: size(grid),
        top: grid.top().floor() as i32 + 1,
        fallback: None,
        cell_mm: 1.0,
        home: GridPoint::default(),
        params: SurfaceParams::PREMIUM,
        source: Source::Points,
        hold_clock: false,
        materials: None,
    }
}
