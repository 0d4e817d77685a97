//! Random walks checked a second time: with a list of all points where a proxy may rest
//! (`hapterra_tests::local_minima`), and with a dense search along the HIP's paths.

use hapterra::terrain::{HapticCells, HapticGrid};
use hapterra_core::contact::ContactState;
use hapterra_tests::invariants::observed_tick::ObservedTick;
use hapterra_tests::invariants::oracle::TickOracle;
use hapterra_tests::invariants::surface::{Patch, distance};
use hapterra_tests::invariants::{Invariant, descent};
use hapterra_tests::local_minima;
use hapterra_tests::random::Random;
use hapterra_tests::scene::hip_path;
use hapterra_tests::scene::run::{Execution, Scene};
use hapterra_tests::scene::terrain::{Kind, Terrain};
use hapterra_tests::scene::tile_supply::{Buffers, Supply};
use hapterra_tests::shared;
use heightfield::{OpenOptions, Raster, Wait};

/// Findings of the second check in a scene.
#[derive(Debug, Default)]
struct Found {
    /// Proxies at rest that were checked.
    judged: u64,
    /// Those of `judged` that are not at any local closest point, by tick.
    wrong: Vec<usize>,
    /// Those that only one of the two checks calls wrong, by tick.
    disputed: Vec<usize>,
    /// Contacts that began.
    began: u64,
    /// Those of `began` farther from the HIP than the first point of its path below ground.
    late: Vec<usize>,
    /// Free paths that are below ground somewhere: around or over an obstacle.
    dipped: u64,
}

impl Found {
    fn add(&mut self, other: &Self) {
        self.judged += other.judged;
        self.began += other.began;
        self.dipped += other.dipped;
    }
}

fn examine(scene: &Scene, buffers: &mut Buffers) -> Found {
    let mut oracle = TickOracle::new(&scene.terrain);
    let mut found = Found::default();
    let seen = scene.render(buffers, [0; 3], scene.supply, |_| Ok(()));
    let seen = seen.expect("it settles");
    for (tick, now) in seen.iter().enumerate() {
        let reported = oracle.violations(now);
        let reported = reported
            .iter()
            .any(|v| v.invariant == Invariant::LocalMinimum);
        if let Some(is_right) = is_at_minimum(&scene.terrain, now) {
            found.judged += 1;
            if !is_right {
                found.wrong.push(tick);
            }
            if is_right == reported {
                found.disputed.push(tick);
            }
        }
        if let Some(before) = tick.checked_sub(1).map(|last| &seen[last]) {
            check_path(&scene.terrain, before, now, tick, &mut found);
        }
    }
    found
}

/// Returns true if a proxy at rest is at a local closest point, within the oracle's bound; `None`
/// if nothing can be checked.
fn is_at_minimum(terrain: &Terrain, seen: &ObservedTick) -> Option<bool> {
    let displacement = distance(seen.proxy, seen.hip);
    let rests = seen.output.state == ContactState::Touching && seen.output.converged;
    if !rests || !(2e-6..=1e4).contains(&displacement) {
        return None;
    }
    let place = [seen.proxy[0], seen.proxy[1]];
    let exact = |hip: [f64; 3]| {
        local_minima::nearest(&local_minima::around(terrain, hip, place), seen.proxy)
    };
    let Some((at, error)) = exact(seen.hip) else {
        return Some(false);
    };
    let allowed = seen.allowed();
    if error <= allowed {
        return Some(true);
    }
    let level = |a: [f64; 3], b: [f64; 3]| (a[0] - b[0]).hypot(a[1] - b[1]);
    // Motion of the closest point when the HIP moves by the allowed error.
    let moved = (0..6).filter_map(|i| {
        let mut hip = seen.hip;
        hip[i / 2] += if i % 2 == 0 { allowed } else { -allowed };
        exact(hip).map(|(there, _)| level(there, at))
    });
    let condition = moved.fold(0.0, f64::max);
    Some(level(at, seen.proxy) <= 4.0 * (allowed + condition))
}

/// Checks the path of the HIP at every 1/256 of a cell.
fn check_path(
    terrain: &Terrain,
    before: &ObservedTick,
    now: &ObservedTick,
    tick: usize,
    found: &mut Found,
) {
    let was_free = before.output.state == ContactState::Free && before.output.converged;
    let length = distance(before.hip, now.hip);
    // Longer paths would need too many points.
    if !was_free || !now.output.converged || length > 500.0 {
        return;
    }
    let steps = (256.0 * length).ceil().max(1.0) as u32;
    let at = |i: u32| {
        let t = f64::from(i) / f64::from(steps);
        [0, 1, 2].map(|k| before.hip[k] + t * (now.hip[k] - before.hip[k]))
    };
    let is_below = |p: &[f64; 3]| {
        let cell = [p[0].floor() as i32, p[1].floor() as i32];
        let ground = Patch::at(terrain, cell).map(|patch| patch.height(p[0], p[1]));
        ground.is_some_and(|ground| p[2] < ground - 1e-3)
    };
    let first = (0..=steps).map(at).find(is_below);
    match now.output.state {
        ContactState::Touching => {
            found.began += 1;
            let most = first.map_or(length, |p| distance(p, now.hip));
            if distance(now.proxy, now.hip) > most + 1e-2 + 4.0 * now.allowed() {
                found.late.push(tick);
            }
        }
        ContactState::Free => found.dipped += u64::from(first.is_some()),
        _ => {}
    }
}

#[test]
fn proxy_displaced_from_its_minimum_is_detected() {
    let ground = Terrain::new(Kind::Hills, [60, 60], 4);
    let path = vec![
        [20.5, 20.25, 9.0],
        [20.5, 20.25, ground.height_about(20.5, 20.25) - 0.5],
    ];
    let scene = Scene::new(ground, path, Execution::LockStep, Supply::Preloaded);
    let seen = scene.render(&mut Buffers::default(), [0; 3], Supply::Preloaded, |_| {
        Ok(())
    });
    let honest = seen.expect("it settles")[1];
    assert_eq!(is_at_minimum(&scene.terrain, &honest), Some(true));
    for axis in 0..2 {
        let mut forged = honest;
        forged.proxy[axis] += 3e-5;
        assert_eq!(is_at_minimum(&scene.terrain, &forged), Some(false));
    }
}

/// Returns all scenes of a seed in that range.
fn scenes(numbers: std::ops::Range<u64>) -> impl Iterator<Item = (u64, Scene)> {
    numbers.map(|number| (number, Scene::random(77, number)))
}

#[test]
fn both_oracles_agree_on_random_scenes() {
    let mut buffers = Buffers::default();
    let mut total = Found::default();
    for (number, scene) in scenes(0..200) {
        let found = examine(&scene, &mut buffers);
        let kind = scene.terrain.kind;
        assert_eq!(
            found.disputed, [0; 0],
            "scene {number} of seed 77, {kind:?}"
        );
        assert_eq!(found.late, [0; 0], "scene {number} of seed 77, {kind:?}");
        if !found.wrong.is_empty() {
            println!(
                "scene {number}, {kind:?}: both report an error at {:?}",
                found.wrong
            );
        }
        total.add(&found);
    }
    println!("{total:?}");
    assert!(total.judged > 20_000 && total.began > 1000, "{total:?}");
}

#[test]
fn every_proxy_on_real_terrain_rests_at_a_closest_point() {
    for file in ["pre_runout_DEM.asc", "bigtujunga.tif"] {
        let Some(path) = shared(&format!("dem/real/{file}")) else {
            return;
        };
        for steepness in [1.0, 10.0] {
            let terrain = cut(
                &Raster::open(&path, &OpenOptions::default()).expect("opens"),
                steepness,
            );
            let mut random = Random::new(5);
            let mut total = Found::default();
            for _ in 0..12 {
                let path = hip_path::random(&terrain, &mut random, 1000);
                let scene = Scene::new(
                    terrain.clone(),
                    path,
                    Execution::LockStep,
                    Supply::Preloaded,
                );
                let found = examine(&scene, &mut Buffers::default());
                let none = [&found.wrong, &found.disputed, &found.late]
                    .iter()
                    .all(|t| t.is_empty());
                assert!(none, "{file} × {steepness}: {found:?}");
                total.add(&found);
            }
            println!("{file} × {steepness}: {total:?}");
            assert!(total.judged > 3000, "{total:?}");
        }
    }
}

/// Cuts at most 200 × 200 patches from the middle of a raster, with the lowest sample near zero.
fn cut(raster: &Raster, steepness: f64) -> Terrain {
    const MAX: u32 = 200;
    let scale = HapticGrid::new(raster, HapticCells::Stored)
        .cells_per_vertical_unit()
        .unwrap_or(1.0)
        * steepness;
    let lowest = raster.summary().lowest;
    let [width, height] = [raster.columns(), raster.rows()].map(|n| n.min(MAX + 1));
    let first = [(raster.columns() - width) / 2, (raster.rows() - height) / 2];
    let rows: Vec<Vec<f64>> = (0..height)
        .map(|row| {
            let mut heights = vec![0.0; width as usize];
            assert!(
                raster
                    .read_row(0, first[1] + row, first[0], &mut heights, Wait::UntilRead)
                    .is_complete()
            );
            heights
        })
        .collect();
    let size = [width as i32 - 1, height as i32 - 1];
    Terrain::from_fn(Kind::Scan, size, |x, y| {
        ((rows[y as usize][x as usize] - lowest) * scale) as f32
    })
}

/// A descent whose first step was 2⁻¹⁰ cell stepped over the minimum where it started, on a slope
/// of 10⁶ with the HIP about 10⁻⁶ cell inside.
#[test]
fn descent_oracle_stays_at_a_closest_point() {
    const HIPS: [(u64, [f64; 3]); 5] = [
        (
            317,
            [
                61.638_040_542_602_54,
                78.543_353_080_749_51,
                196_670.376_845_359_8,
            ],
        ),
        (
            317,
            [
                63.041_017_532_348_63,
                78.311_665_534_973_14,
                12_782.380_167_007_446,
            ],
        ),
        (
            317,
            [
                63.513_443_946_838_38,
                78.457_261_085_510_25,
                234_776.550_067_901_6,
            ],
        ),
        (
            556,
            [
                58.239_516_258_239_746,
                57.864_298_820_495_605,
                103_196.797_740_936_28,
            ],
        ),
        (
            556,
            [
                58.237_467_765_808_105,
                57.853_564_262_390_14,
                111_660.337_002_754_21,
            ],
        ),
    ];
    for (number, hip) in HIPS {
        let spikes = Scene::random(2026, number).terrain;
        let all = local_minima::around(&spikes, hip, [hip[0], hip[1]]);
        let (at, _) = local_minima::nearest(&all, hip).expect("there is one");
        let cell = [at[0].floor() as i32, at[1].floor() as i32];
        let patch = Patch::at(&spikes, cell).expect("inside");
        let there = descent::from(&spikes, hip, [at[0], at[1]], patch).at;
        assert!(distance(there, at) < 1e-6, "{there:?} from {at:?}");
    }
}
