//! Properties of the tick on small terrains that proptest generates and, after a failure,
//! simplifies as far as it can.
//!
//! The checks of each tick are in `hapterra_tests::invariants`. Failures are kept in
//! `properties.proptest-regressions` and run first the next time; each has a test of its own in
//! `regressions.rs`.

use hapterra_core::terrain::MAX_STEP_CELLS;
use hapterra_tests::scene::hip_path::GRAIN;
use hapterra_tests::scene::run::{Execution, Scene};
use hapterra_tests::scene::terrain::{Kind, Terrain};
use hapterra_tests::scene::tile_supply::{Buffers, Supply};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{FileFailurePersistence, RngSeed};

const REGRESSIONS: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/tests/contact/properties.proptest-regressions"
);
/// Patches along a side.
const SIDE: usize = 6;
const TILE_SAMPLES: usize = (SIDE + 1) * (SIDE + 1);

fn terrain(heights: &[f32]) -> Terrain {
    let side = SIDE as i32;
    Terrain::from_fn(Kind::Rough, [side, side], |x, y| {
        heights[(y * (side + 1) + x) as usize]
    })
}

/// Ground with slopes up to four.
fn gentle() -> impl Strategy<Value = Vec<f32>> {
    let height = prop_oneof![
        Just(0.0_f32),
        (-8..8_i32).prop_map(|h| h as f32 / 4.0),
        -2.0..2.0_f32,
    ];
    vec(height, TILE_SAMPLES)
}

/// As steep as a tile may be, with no-data.
fn wild() -> impl Strategy<Value = Vec<f32>> {
    let height = prop_oneof![
        4 => Just(0.0_f32),
        4 => 0.0..2.0_f32,
        1 => Just(MAX_STEP_CELLS),
        1 => 0.0..MAX_STEP_CELLS,
        1 => Just(f32::NAN),
        1 => Just(f32::INFINITY),
        1 => Just(f32::MIN_POSITIVE / 4.0),
    ];
    vec(height, TILE_SAMPLES)
}

/// A coordinate on grid lines, between them, or off the field.
fn coordinate() -> impl Strategy<Value = f64> {
    let side = SIDE as i32;
    prop_oneof![
        (0..=side).prop_map(f64::from),
        (-4..=4 * side + 4).prop_map(|quarters| f64::from(quarters) / 4.0),
        (0.0..f64::from(side)).prop_map(|c| (c / GRAIN).round() * GRAIN),
    ]
}

fn path() -> impl Strategy<Value = Vec<[f64; 3]>> {
    let height = prop_oneof![
        (-8..=12_i32).prop_map(|quarters| f64::from(quarters) / 4.0),
        (-3.0..3.0_f64).prop_map(|z| (z / GRAIN).round() * GRAIN),
    ];
    let hip = (coordinate(), coordinate(), height).prop_map(|(x, y, z)| [x, y, z]);
    // First, above everything.
    vec(hip, 1..30).prop_map(|mut path| {
        path.insert(0, [3.5, 3.5, 1.5 * f64::from(MAX_STEP_CELLS)]);
        path.insert(1, [3.5, 3.5, 4.0]);
        path
    })
}

fn execution() -> impl Strategy<Value = Execution> {
    prop_oneof![Just(Execution::RealTime), Just(Execution::LockStep)]
}

fn check_scene(scene: &Scene) -> Result<(), TestCaseError> {
    let ran = scene.run(&mut Buffers::default());
    ran.map(drop)
        .map_err(|violation| TestCaseError::fail(violation.to_string()))
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 400,
        // The same cases everywhere: `PROPTEST_RNG_SEED` selects others.
        rng_seed: std::env::var("PROPTEST_RNG_SEED")
            .ok()
            .and_then(|seed| seed.parse().ok())
            .map_or(RngSeed::Fixed(2026), RngSeed::Fixed),
        failure_persistence: Some(Box::new(FileFailurePersistence::Direct(REGRESSIONS))),
        ..ProptestConfig::default()
    })]

    #[test]
    fn invariants_hold_on_gentle_ground(
        heights in gentle(), path in path(), execution in execution(),
    ) {
        check_scene(&Scene::new(terrain(&heights), path, execution, Supply::Preloaded))?;
    }

    #[test]
    fn invariants_hold_on_wild_ground(
        heights in wild(), path in path(), execution in execution(),
    ) {
        check_scene(&Scene::new(terrain(&heights), path, execution, Supply::Preloaded))?;
    }

    #[test]
    fn invariants_hold_while_tiles_arrive(
        heights in gentle(), path in path(), execution in execution(), latency in 0..4_u32,
    ) {
        let supply = Supply::OnDemand { latency };
        check_scene(&Scene::new(terrain(&heights), path, execution, supply))?;
    }
}
