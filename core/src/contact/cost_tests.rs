//! Costs of a tick by the motion of the HIP: patches searched, and
//! evaluations of the distance there.

use core::cell::Cell;
use std::vec::Vec;

use glam::Vec3;

use super::budget::FAST_PATH;
use super::test_random::{Random, wander};
use super::{Contact, ContactSettings, ContactState};
use crate::cases::cases;
use crate::grid::GridPoint;
use crate::terrain::FieldSize;
use crate::terrain::testing::{Field, buffers};

std::thread_local! {
    /// Patches and evaluations of the searches.
    static SEARCHED: Cell<[u32; 2]> = const { Cell::new([0; 2]) };
}

/// Counts a searched patch.
pub(super) fn searched(evaluations: u32) {
    SEARCHED.with(|stats| {
        let [patches, all] = stats.get();
        stats.set([patches + 1, all + evaluations]);
    });
}

const SIZE: i32 = 60;
const TICKS: u32 = cases(4_000, 60);

/// Hills three cells high, each patch with its own twist.
fn height(x: i32, y: i32) -> f32 {
    let rough = (x * 7 + y * 13) % 10;
    let hills = (0.2 * f64::from(x)).sin() + (0.3 * f64::from(y)).cos();
    (1.5 * hills) as f32 + 0.02 * rough as f32
}

/// A HIP `above` cells over a place, or under it.
fn hip([x, y]: [f64; 2], above: f64) -> GridPoint {
    let cell = [x, y].map(|c| c as i32);
    let [u, v] = [x - x.floor(), y - y.floor()];
    let post = |i: i32, j: i32| f64::from(height(cell[0] + i, cell[1] + j));
    let row = |j: i32| post(0, j) * (1.0 - u) + post(1, j) * u;
    let z = row(0) * (1.0 - v) + row(1) * v + above;
    GridPoint::new(
        [cell[0], cell[1], 0],
        Vec3::new(u as f32, v as f32, z as f32),
    )
}

/// Consecutive places `step` cells apart.
fn places(step: f64) -> impl Iterator<Item = [f64; 2]> {
    wander(Random(71), TICKS, SIZE, step, 0.05)
}

/// Median and 99th percentile of the patches and of the evaluations, over the ticks that end in a
/// state.
fn search_cost(hips: impl Iterator<Item = GridPoint>, state: ContactState) -> [[u32; 2]; 2] {
    let mut tiles = buffers::<2>();
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(SIZE, SIZE), height);
    let mut contact = Contact::new(ContactSettings::AT_1_KHZ);
    let above = GridPoint::new([30, 30, 9], Vec3::ZERO);
    let mut step = |hip: &GridPoint| *contact.step(&field.window, hip);
    step(&above);
    let (mut patches, mut evaluations) = (Vec::new(), Vec::new());
    for hip in hips {
        SEARCHED.set([0; 2]);
        let output = step(&hip);
        let searched = match SEARCHED.get() {
            // The fast path: one evaluation.
            [0, _] if output.state == ContactState::Touching && output.work == FAST_PATH => [1, 1],
            searched => searched,
        };
        if output.state == state {
            patches.push(searched[0]);
            evaluations.push(searched[1]);
        }
    }
    [patches, evaluations].map(|mut counts| {
        counts.sort_unstable();
        let last = counts.len() - 1;
        [counts[last / 2], counts[last * 99 / 100]]
    })
}

#[test]
fn patches_and_evaluations_per_tick_are_bounded() {
    let high = |[x, y]: [f64; 2]| GridPoint::new([x as i32, y as i32, 9], Vec3::ZERO);
    let above_ground = |above: f64| places(0.5).map(move |at| hip(at, above));
    let sliding = |step: f64| places(step).map(|at| hip(at, -0.1));
    let taps = places(0.03).flat_map(|at| [hip(at, 0.2), hip(at, -0.1)]);
    // One encoder count, 0.03 cell, in either direction.
    let mut random = Random(72);
    let mut count = || 0.03 * random.between(-1.5, 1.5).round();
    let trembling = (0..TICKS).map(|_| hip([30.4 + count(), 30.5 + count()], count() - 0.1));
    let unmoved = (0..TICKS).map(|_| hip([30.4, 30.5], -0.1));
    let states = [
        (
            "unmoved",
            search_cost(unmoved, ContactState::Touching),
            [[0, 0], [0, 0]],
        ),
        (
            "free high",
            search_cost(places(0.5).map(high), ContactState::Free),
            [[0, 0], [0, 0]],
        ),
        (
            "free low",
            search_cost(above_ground(1.0), ContactState::Free),
            [[0, 0], [0, 0]],
        ),
        (
            "first contact",
            search_cost(taps, ContactState::Touching),
            [[1, 2], [2, 5]],
        ),
        (
            "slides 0.01",
            search_cost(sliding(0.01), ContactState::Touching),
            [[1, 2], [1, 2]],
        ),
        (
            "slides 0.5",
            search_cost(sliding(0.5), ContactState::Touching),
            [[2, 4], [2, 8]],
        ),
        (
            "trembles",
            search_cost(trembling, ContactState::Touching),
            [[1, 1], [1, 1]],
        ),
    ];
    for (state, [patches, evaluations], max) in states {
        std::println!("{state}: patches {patches:?}, evaluations {evaluations:?}");
        let within = |is: [u32; 2], max: [u32; 2]| is[0] <= max[0] && is[1] <= max[1];
        assert!(
            within(patches, max[0]) && within(evaluations, max[1]),
            "{state}"
        );
    }
}
