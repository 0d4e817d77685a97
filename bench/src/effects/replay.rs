//! Forces along a path of points, in lock-step.

use hapterra_core::force::SurfaceParams;
use hapterra_core::grid::GridPoint;
use hapterra_core::rate::TickRate;
use hapterra_core::scene::{HipCommand, Scene, Source};
use hapterra_core::terrain::{FieldSize, TILE_CELLS, Tile, TileKey};
use hapterra_core::tick::{Command, Haptics};

use super::SIDE;
use super::effect_tick::EffectTick;
use crate::grid::Grid;
use crate::product::{buffers, fill};
use crate::variant::Hip;

/// Tiles along the side of the window.
pub(super) const WINDOW: usize = SIDE / TILE_CELLS;
/// Most ticks of a point: more than any needs whose tiles are stored.
const MAX_TICKS: usize = 1000;

/// Allocates buffers for a loop's tiles.
pub(super) fn tiles() -> Vec<Tile> {
    buffers::<WINDOW>()
}

/// Returns a scene over the whole of a grid.
pub(super) fn scene(grid: &Grid, params: SurfaceParams, source: Source, home: GridPoint) -> Scene {
    Scene {
        epoch: 1,
        level: 0,
        size: FieldSize::new(grid.columns as i32, grid.rows as i32),
        top: grid.top().floor() as i32 + 1,
        fallback: None,
        cell_mm: 1.0,
        home,
        params,
        source,
        hold_clock: false,
        materials: None,
    }
}

/// Creates a loop that stores all tiles of a scene.
///
/// # Panics
/// If there are fewer buffers than [`tiles`] allocates, or the field is larger than the window.
pub(super) fn open<'t>(
    grid: &Grid,
    scene: Scene,
    tiles: &'t mut [Tile],
) -> Box<Haptics<'t, WINDOW>> {
    let mut tiles = tiles.iter_mut();
    let mut next = || tiles.next().expect("a buffer for every slot");
    let mut spare = next();
    let slots = std::array::from_fn(|_| std::array::from_fn(|_| next()));
    let mut haptics = Box::new(Haptics::new(slots, TickRate::DEFAULT, None));
    let _ = haptics.accept(Command::Scene(scene));
    for index in scene.size.tiles() {
        fill(grid, TileKey { level: 0, index }, spare);
        spare = haptics
            .accept(Command::Tile(spare))
            .expect("taken")
            .expect("the field fits the window");
    }
    haptics
}

/// Returns the force at each point with surface parameters.
pub(super) fn render(grid: &Grid, params: SurfaceParams, hips: &[Hip]) -> Vec<EffectTick> {
    let mut tiles = tiles();
    let scene = scene(grid, params, Source::Points, GridPoint::default());
    let mut haptics = open(grid, scene, &mut tiles);
    let mut result = |(seq, hip): (u32, &Hip)| {
        let point = HipCommand { seq, hip: hip.grid };
        let _ = haptics.accept(Command::Hip(point));
        let mut ticks = (0..MAX_TICKS).map(|_| haptics.tick(&Default::default(), true));
        let answered = ticks.find(|outcome| outcome.answered_seq.is_some());
        answered.map(|outcome| EffectTick::of(&outcome.sample))
    };
    (0..).zip(hips).map_while(&mut result).collect()
}
