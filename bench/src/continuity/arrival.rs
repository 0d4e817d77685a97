//! The product's contact while the next tile is late.

use hapterra_core::contact::{Contact, ContactSettings, ContactState};
use hapterra_core::grid::Cell;
use hapterra_core::terrain::{
    BLEND_MM_S, CoarseTile, Fallback, FieldSize, RequestHint, TILE_CELLS, Tile, TileKey,
    TileRequester,
};

use super::row::{DEPTH, Row, SIDE, STEP};
use crate::compare::DEFAULT_VARIANT;
use crate::grid::Grid;
use crate::path::{approach_hips, over};
use crate::product::{buffers, empty, fill};
use crate::variant::{ContactResult, Hip};

/// Start of the slide, cells before the next tile.
const START_CELLS: f64 = 1.0;
/// Motion of the surface in a tick, cells, from the fallback to a tile that arrived: at 1 kHz, with
/// cells of a millimetre.
const BLEND_CELLS_PER_TICK: f32 = BLEND_MM_S / 1_000.0;
/// Ticks of the slide eastward.
const TICKS: u32 = 400;

/// Measures the same path with all tiles, and with a next tile that arrives when the HIP is some
/// way beyond its border.
pub(super) fn measure() -> Vec<Row> {
    let late = |beyond: f64| ((START_CELLS + beyond) / STEP) as u32;
    let fallback_tile = Some(FALLBACK);
    [
        ("every tile here", 0, None),
        ("tile 0.2 cell late", late(0.2), None),
        ("tile 0.45 cell late", late(0.45), None),
        ("tile 1 cell late", late(1.0), None),
        (
            "0.2 cell late over a coarse fallback",
            late(0.2),
            fallback_tile,
        ),
        (
            "0.45 cell late over a coarse fallback",
            late(0.45),
            fallback_tile,
        ),
        (
            "1 cell late over a coarse fallback",
            late(1.0),
            fallback_tile,
        ),
    ]
    .map(|(name, delay_ticks, fallback)| {
        Row::of(name, DEFAULT_VARIANT, &[&output(delay_ticks, fallback)])
    })
    .to_vec()
}

/// The fallback, under both tiles.
const FALLBACK: Fallback = Fallback {
    wide: CoarseTile {
        first: Cell::new(0, 0),
        shift: 3,
    },
    near: None,
};

/// Returns the fallback's tile; beyond the field it has the border's heights.
fn coarse(grid: &Grid, fallback: &Fallback) -> Tile {
    let mut tile = Tile::VACANT;
    let side = fallback.wide.spacing() as usize;
    let height = |col: usize, row: usize| {
        grid.post((col * side).min(grid.columns), (row * side).min(grid.rows))
    };
    tile.fill(fallback.wide.key(0), 0, height)
        .expect("in range");
    tile
}

/// Returns the results from the start of the slide.
fn output(delay_ticks: u32, fallback: Option<Fallback>) -> Vec<ContactResult> {
    let grid = Grid::from_fn("two tiles", [2 * TILE_CELLS, TILE_CELLS], |x, y| {
        (1.5 * (0.2 * x as f64).sin() * (0.17 * y as f64).cos()) as f32
    });
    let mut fallback_tile;
    let mut tiles = buffers::<SIDE>();
    let (mut window, mut spare) = empty::<SIDE>(&grid, &mut tiles);
    let size = FieldSize::new(grid.columns as i32, grid.rows as i32);
    let mut requester = TileRequester::<SIDE>::new();
    requester.reset(0, size);
    window.set_fallback(fallback);
    fallback_tile = fallback.map(|fallback| coarse(&grid, &fallback));
    if let Some(tile) = &mut fallback_tile {
        assert!(window.take(tile, [Cell::new(0, 0); 2]).is_none());
    }

    let (hips, approach) = hips(&grid);
    let mut contact = Contact::new(ContactSettings::AT_1_KHZ);
    let mut requested: Vec<TileKey> = Vec::new();
    let mut results = Vec::new();
    for (tick, hip) in (0..).zip(&hips) {
        if window.blend_tiles(BLEND_CELLS_PER_TICK) {
            contact.surface_moved(&window);
        }
        let output = *contact.step(&window, &hip.grid);
        results.push(ContactResult {
            touching: output.state == ContactState::Touching,
            converged: output.converged,
            displacement: output.displacement.to_array(),
        });
        let hint = RequestHint {
            missing_tile: output.missing_tile,
            proxy: output.proxy.column(),
            hip: hip.grid.column(),
            velocity: [STEP as f32, 0.0],
        };
        requested.extend(std::iter::from_fn(|| requester.next_request(tick, &hint)));
        // The tile at the start arrives at once.
        let has_arrived = |key: &TileKey| key.index.col == 0 || tick >= approach + delay_ticks;
        for key in requested.extract_if(.., |key| has_arrived(key)) {
            requester.received(key);
            fill(&grid, key, spare);
            let at = [output.proxy.column(), hip.grid.column()];
            spare = window.take(spare, at).expect("one comes back for one");
        }
    }
    results.split_off(approach as usize - 1)
}

/// Returns the HIPs: down and, after a rest, eastward. Also returns the start of the slide.
fn hips(grid: &Grid) -> (Vec<Hip>, u32) {
    let start = [TILE_CELLS as f64 - START_CELLS, 16.3];
    let mut hips = vec![over(grid, start, 2.0); 20];
    hips.extend(approach_hips(grid, start, -DEPTH));
    let approach = hips.len() as u32;
    let slid = (1..=TICKS).map(|tick| {
        let at = [start[0] + STEP * f64::from(tick), start[1]];
        over(grid, at, -DEPTH)
    });
    hips.extend(slid);
    (hips, approach)
}
