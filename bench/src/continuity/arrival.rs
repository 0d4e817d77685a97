//! The product's contact while the next tile comes late.

use hapterra_core::contact::{Contact, Pace, Rule, State};
use hapterra_core::terrain::{Focus, Puller, TILE_CELLS, TileKey, Window};

use super::{DEPTH, Row, SIDE, STEP};
use crate::compare::SWEPT;
use crate::grid::Grid;
use crate::haptics::{Answer, Hand};
use crate::path::{over, way_in};
use crate::product::{buffers, fill};

/// Where the hand begins to slide, cells before the next tile.
const BEFORE: f64 = 1.0;
/// Ticks it slides eastward.
const TICKS: u32 = 400;

/// The same way with every tile here, and with the next tile coming when the hand
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

/// What is felt from where the hand begins to slide.
fn felt(due: u32) -> Vec<Answer> {
    let grid = Grid::from_fn("two tiles", [2 * TILE_CELLS, TILE_CELLS], |x, y| {
        (1.5 * (0.2 * x as f64).sin() * (0.17 * y as f64).cos()) as f32
    });
    let mut tiles = buffers::<SIDE>();
    let mut free = tiles.iter_mut();
    let mut next = || free.next().expect("one for every slot, and one");
    let slots = std::array::from_fn(|_| std::array::from_fn(|_| next()));
    let mut window: Box<Window<'_, SIDE>> = Box::new(Window::new(slots));
    let mut spare = next();
    let size = [grid.columns as i32, grid.rows as i32];
    window.reset(0, size, 3);
    let mut puller = Puller::<SIDE>::new();
    puller.reset(0, size);

    let (hands, approach) = hands(&grid);
    let mut contact = Contact::new();
    let mut coming: Vec<TileKey> = Vec::new();
    let mut answers = Vec::new();
    for (tick, hand) in (0..).zip(&hands) {
        let felt = *contact.step(&window, &hand.grid, Rule::Swept, Pace::RealTime);
        answers.push(Answer {
            touching: felt.state == State::Touching,
            settled: felt.settled,
            stretch: felt.stretch.to_array(),
        });
        let focus = Focus {
            held_up_by: felt.held_up_by,
            proxy: felt.proxy.column(),
            hip: hand.grid.column(),
            velocity: [STEP as f32, 0.0],
        };
        coming.extend(std::iter::from_fn(|| puller.next_request(tick, &focus)));
        // The tile that the hand begins over comes at once.
        let is_here = |key: &TileKey| key.col == 0 || tick >= approach + due;
        for key in coming.extract_if(.., |key| is_here(key)) {
            puller.received(key);
            fill(&grid, key, spare);
            spare = window.install(spare);
        }
    }
    answers.split_off(approach as usize - 1)
}

/// Down, and after a while to see and to wait, eastward.
fn hands(grid: &Grid) -> (Vec<Hand>, u32) {
    let start = [TILE_CELLS as f64 - BEFORE, 16.3];
    let mut hands = vec![over(grid, start, 2.0); 20];
    hands.extend(way_in(grid, start, -DEPTH));
    let approach = hands.len() as u32;
    let slid = (1..=TICKS).map(|tick| {
        let at = [start[0] + STEP * f64::from(tick), start[1]];
        over(grid, at, -DEPTH)
    });
    hands.extend(slid);
    (hands, approach)
}
