//! The product's contact while the next tile comes late.

use hapterra_core::contact::{Contact, ContactSettings, ContactState};
use hapterra_core::terrain::{FieldSize, TILE_CELLS, TileDemand, TileKey, TileRequester};

use super::row::{DEPTH, Row, SIDE, STEP};
use crate::compare::SWEPT;
use crate::grid::Grid;
use crate::haptics::{Answer, Hip};
use crate::path::{over, way_in};
use crate::product::{buffers, empty, fill};

/// Where the HIP begins to slide, cells before the next tile.
const BEFORE: f64 = 1.0;
/// Ticks it slides eastward.
const TICKS: u32 = 400;

/// The same way with every tile here, and with the next tile coming when the HIP
/// is so far beyond its border.
pub(super) fn measure() -> Vec<Row> {
    let late = |beyond: f64| ((BEFORE + beyond) / STEP) as u32;
    [
        ("every tile here", 0),
        ("tile 0.2 cell late", late(0.2)),
        ("tile 0.45 cell late", late(0.45)),
        ("tile 1 cell late", late(1.0)),
    ]
    .map(|(name, due)| Row::of(name, SWEPT, &[&felt(due)]))
    .to_vec()
}

/// What is felt from where the HIP begins to slide.
fn felt(due: u32) -> Vec<Answer> {
    let grid = Grid::from_fn("two tiles", [2 * TILE_CELLS, TILE_CELLS], |x, y| {
        (1.5 * (0.2 * x as f64).sin() * (0.17 * y as f64).cos()) as f32
    });
    let mut tiles = buffers::<SIDE>();
    let (mut window, mut spare) = empty::<SIDE>(&grid, &mut tiles);
    let size = FieldSize::new(grid.columns as i32, grid.rows as i32);
    let mut requester = TileRequester::<SIDE>::new();
    requester.reset(0, size);

    let (hips, approach) = hips(&grid);
    let mut contact = Contact::new(ContactSettings::REAL_TIME);
    let mut coming: Vec<TileKey> = Vec::new();
    let mut answers = Vec::new();
    for (tick, hip) in (0..).zip(&hips) {
        let felt = *contact.step(&window, &hip.grid);
        answers.push(Answer {
            touching: felt.state == ContactState::Touching,
            converged: felt.converged,
            displacement: felt.displacement.to_array(),
        });
        let focus = TileDemand {
            missing_tile: felt.missing_tile,
            proxy: felt.proxy.column(),
            hip: hip.grid.column(),
            velocity: [STEP as f32, 0.0],
        };
        coming.extend(std::iter::from_fn(|| requester.next_request(tick, &focus)));
        // The tile that the HIP begins over comes at once.
        let is_here = |key: &TileKey| key.index.col == 0 || tick >= approach + due;
        for key in coming.extract_if(.., |key| is_here(key)) {
            requester.received(key);
            fill(&grid, key, spare);
            spare = window.install(spare);
        }
    }
    answers.split_off(approach as usize - 1)
}

/// Down, and after a while to see and to wait, eastward.
fn hips(grid: &Grid) -> (Vec<Hip>, u32) {
    let start = [TILE_CELLS as f64 - BEFORE, 16.3];
    let mut hips = vec![over(grid, start, 2.0); 20];
    hips.extend(way_in(grid, start, -DEPTH));
    let approach = hips.len() as u32;
    let slid = (1..=TICKS).map(|tick| {
        let at = [start[0] + STEP * f64::from(tick), start[1]];
        over(grid, at, -DEPTH)
    });
    hips.extend(slid);
    (hips, approach)
}
