//! Invariants of every tick, on terrain from flat to extreme.

use std::vec::Vec;

use super::budget::Budget;
use super::sweep::{Path, SweepEnd};
use super::test_random::Random;
use super::*;
use crate::cases::cases;
use crate::grid::Cell;
use crate::grid::GridPoint;
use crate::terrain::FieldSize;
use crate::terrain::testing::{Field, buffers};
use glam::Vec3;

fn hash(x: i32, y: i32) -> f64 {
    let mut h = (x as u32).wrapping_mul(0x9E37_79B1) ^ (y as u32).wrapping_mul(0x85EB_CA77);
    h ^= h >> 15;
    h = h.wrapping_mul(0x2C1B_3C6D);
    h ^= h >> 12;
    h = h.wrapping_mul(0x297A_2D39);
    h ^= h >> 15;
    f64::from(h) / f64::from(u32::MAX)
}

const SIZE: i32 = 60;
/// Number of HIP paths over each kind of ground.
const SEEDS: core::ops::RangeInclusive<u64> = 1..=cases(20, 1) as u64;

/// A terrain and its surface in f64.
struct Ground64 {
    height: fn(i32, i32) -> f32,
}

impl Ground64 {
    fn at(&self, x: f64, y: f64) -> Option<f64> {
        if !(0.0..f64::from(SIZE)).contains(&x) || !(0.0..f64::from(SIZE)).contains(&y) {
            return None;
        }
        let (i, j) = (x.floor() as i32, y.floor() as i32);
        let (u, v) = (x - x.floor(), y - y.floor());
        let h = |di: i32, dj: i32| f64::from((self.height)(i + di, j + dj));
        let south = h(0, 0) * (1.0 - u) + h(1, 0) * u;
        let north = h(0, 1) * (1.0 - u) + h(1, 1) * u;
        let z = south * (1.0 - v) + north * v;
        (!z.is_nan()).then_some(z)
    }
}

impl Ground64 {
    /// The surface at a point that may lie on the edge of no-data.
    fn beside(&self, [x, y, _]: [f64; 3]) -> f64 {
        let e = 1e-9;
        [(0.0, 0.0), (e, 0.0), (0.0, e), (e, e)]
            .iter()
            .find_map(|(dx, dy)| self.at(x - dx, y - dy))
            .expect("a proxy is on a patch")
    }
}

fn point(p: [f64; 3]) -> GridPoint {
    let cell = p.map(|c| c.floor() as i32);
    let frac = [0, 1, 2].map(|i| (p[i] - p[i].floor()) as f32);
    GridPoint::new(cell, Vec3::from_array(frac))
}

fn position(p: &GridPoint) -> [f64; 3] {
    let (cell, frac) = (p.cell(), p.frac());
    [0, 1, 2].map(|i| f64::from(cell[i]) + f64::from(frac[i]))
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

/// Runs a trajectory to the end of every tick and checks each answer.
fn check(name: &str, height: fn(i32, i32) -> f32, slope: f64, path: &[[f64; 3]]) -> [u32; 4] {
    let mut tiles = buffers::<2>();
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(SIZE, SIZE), height);
    let truth = Ground64 { height };
    let mut contact = Contact::new(ContactSettings::AT_1_KHZ);
    let mut counts = [0; 4];
    for (tick, p) in path.iter().enumerate() {
        let hip = point(*p);
        let mut output = contact.step(&field.window, &hip);
        let mut ticks = 0;
        while !output.converged {
            output = contact.step(&field.window, &hip);
            ticks += 1;
            assert!(ticks < 5000, "{name} {tick}: does not converge {output:?}");
        }
        let (x, proxy) = (position(&hip), position(&output.proxy));
        counts[output.state as usize] += 1;
        let at = std::format!("{name} tick {tick} hip {x:?} {output:?}");
        assert!(output.displacement.is_finite(), "{at}");
        match output.state {
            ContactState::Unseeded | ContactState::Free => {
                assert_eq!(output.displacement, Vec3::ZERO, "{at}");
            }
            // The terrain under the proxy no longer exists.
            ContactState::Releasing => {}
            ContactState::Touching => {
                let z = truth.beside(proxy);
                let bound = 2e-6 + slope * 3e-7 + z.abs() * 5e-7;
                assert!((proxy[2] - z).abs() < bound, "off the surface: {at} {z}");
                assert_is_nearest(&truth, slope, proxy, x, &at);
            }
        }
        if let (ContactState::Free, Some(z)) = (output.state, truth.at(x[0], x[1])) {
            let bound = 2e-6 + slope * 3e-7 + z.abs() * 5e-7;
            assert!(x[2] > z - bound, "free below the surface: {at} {z}");
        }
    }
    counts
}

/// No point of the surface on a ring around the proxy is nearer to the HIP.
fn assert_is_nearest(truth: &Ground64, slope: f64, proxy: [f64; 3], hip: [f64; 3], at: &str) {
    const RING: f64 = 1e-5;
    let d = distance(proxy, hip);
    // Beside an edge, but not on it, the ring would reach over a ridge.
    let beside_edge = |c: f64| c != c.round() && (c - c.round()).abs() < 10.0 * RING;
    if slope > 1e3 || beside_edge(proxy[0]) || beside_edge(proxy[1]) {
        return;
    }
    // A proxy within e of the minimum leaves a gradient of e·(1 + slope²)/d.
    let bound = RING * (1e-3 + 2e-6 * (1.0 + slope * slope) / d);
    let d = distance([proxy[0], proxy[1], truth.beside(proxy)], hip);
    for i in 0..16 {
        let angle = f64::from(i) * core::f64::consts::TAU / 16.0;
        let (x, y) = (proxy[0] + RING * angle.cos(), proxy[1] + RING * angle.sin());
        if let Some(z) = truth.at(x, y) {
            let other = distance([x, y, z], hip);
            assert!(
                other > d - bound,
                "nearer by {} of {bound}: {at}",
                d - other
            );
        }
    }
}

/// A HIP that wanders, at `step` cells a tick, at a height of `mid` ± `span`.
fn wander(seed: u64, ticks: u32, step: f64, mid: f64, span: f64) -> Vec<[f64; 3]> {
    let mut random = Random(seed);
    let mut p = [30.0, 30.0, mid + span];
    let mut v = [0.0; 3];
    let high = [58.0, 58.0, mid + span];
    let low = [2.0, 2.0, mid - span];
    (0..ticks)
        .map(|_| {
            for k in 0..3 {
                v[k] = 0.9 * v[k] + 0.3 * step * random.between(-1.0, 1.0);
                p[k] += v[k];
                if p[k] < low[k] || p[k] > high[k] {
                    p[k] = p[k].clamp(low[k], high[k]);
                    v[k] = -v[k];
                }
            }
            p
        })
        .collect()
}

/// A HIP that jumps anywhere.
fn teleport(seed: u64, ticks: u32, mid: f64, span: f64) -> Vec<[f64; 3]> {
    let mut random = Random(seed);
    let mut path = std::vec![[30.0, 30.0, mid + 3.0 * span]];
    path.extend((0..ticks).map(|_| {
        [
            random.between(1.0, 59.0),
            random.between(1.0, 59.0),
            random.between(mid - span, mid + span),
        ]
    }));
    path
}

/// Returns the points before and after the first crossing of the segment with the surface, by dense
/// sampling; `None` without a crossing.
fn dense_crossing(truth: &Ground64, from: [f64; 3], to: [f64; 3]) -> Option<[[f64; 3]; 2]> {
    const POINTS: u32 = cases(2000, 100);
    let part = |i: u32| f64::from(i) / f64::from(POINTS);
    let at = |i: u32| [0, 1, 2].map(|k| from[k] + part(i) * (to[k] - from[k]));
    let below = |p: [f64; 3]| truth.at(p[0], p[1]).is_some_and(|z| p[2] < z);
    let first = (0..=POINTS).find(|i| below(at(*i)))?;
    Some([at(first.saturating_sub(1)), at(first)])
}

/// Random segments that start above everything.
fn sweeps_agree(name: &str, height: fn(i32, i32) -> f32, slope: f64, low: f64, high: f64) {
    let mut tiles = buffers::<2>();
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(SIZE, SIZE), height);
    let truth = Ground64 { height };
    let mut random = Random(7);
    let mut counts = [0, 0];
    const PATHS: u32 = cases(4000, 6);
    for _ in 0..PATHS {
        let from = [random.between(0.5, 59.5), random.between(0.5, 59.5), high];
        let reach = if random.unit() < 0.5 { 2.0 } else { 60.0 };
        let to = [
            (from[0] + random.between(-reach, reach)).clamp(0.5, 59.5),
            (from[1] + random.between(-reach, reach)).clamp(0.5, 59.5),
            random.between(low, high),
        ];
        let (a, b) = (point(from), point(to));
        let mut path = Path::through_air(a, b);
        let end = loop {
            match path.advance(&field.window, &mut Budget::new(WORK_PER_TICK)) {
                SweepEnd::Suspended => {}
                end => break end,
            }
        };
        let at = std::format!("{name} {from:?} to {to:?}: {end:?}");
        match (end, dense_crossing(&truth, position(&a), position(&b))) {
            (SweepEnd::Hit(point), Some([before, after])) => {
                counts[0] += 1;
                let x = f64::from(point.cell.x) + f64::from(point.u);
                let y = f64::from(point.cell.y) + f64::from(point.v);
                // On the path, and not after the crossing of the dense search.
                let length = ((to[0] - from[0]).powi(2) + (to[1] - from[1]).powi(2)).sqrt();
                let travelled = ((x - from[0]).powi(2) + (y - from[1]).powi(2)).sqrt();
                let dense_travelled =
                    ((after[0] - from[0]).powi(2) + (after[1] - from[1]).powi(2)).sqrt();
                assert!(
                    travelled < dense_travelled + 4e-6,
                    "late by {} {at}",
                    travelled - dense_travelled
                );
                let z = truth.at(x, y).unwrap_or(f64::NAN);
                let line = from[2] + (to[2] - from[2]) * travelled / length;
                let steep = slope + ((to[2] - from[2]) / length).abs();
                assert!(
                    (z - line).abs() < 4e-6 * (1.0 + steep),
                    "{} {before:?} {at}",
                    z - line
                );
            }
            (SweepEnd::Hit(point), None) => {
                // A graze between two points of the dense search, or a touch.
                let x = f64::from(point.cell.x) + f64::from(point.u);
                let y = f64::from(point.cell.y) + f64::from(point.v);
                assert!(truth.at(x, y).is_some(), "{at}");
            }
            (SweepEnd::Clear, None) => counts[1] += 1,
            (SweepEnd::Clear, Some([_, after])) => {
                let z = truth.at(after[0], after[1]).unwrap_or(f64::NAN);
                assert!(
                    z - after[2] < 4e-6 * (1.0 + slope),
                    "missed {after:?} {z} {at}"
                );
            }
            (other, dense) => panic!("{other:?} {dense:?} {at}"),
        }
    }
    let both_occur = counts[0] > PATHS / 8 && counts[1] > PATHS / 40;
    assert!(both_occur, "both occur: {counts:?}");
}

#[test]
fn sweep_finds_the_first_crossing_exactly() {
    sweeps_agree("flat", flat, 0.0, 1.0, 3.0);
    sweeps_agree("hills", hills, 1.5, -3.0, 3.2);
    sweeps_agree("rough", rough, 2.0, 0.0, 2.2);
    sweeps_agree("noise", noise_100, 200.0, -100.0, 101.0);
    sweeps_agree("board", checkerboard, 1.0, -0.5, 1.5);
}

/// Figure 8 of the paper, with walls for its peaks: a proxy may slide around a single raised
/// sample, but it must not pass a wall.
fn two_walls(x: i32, _: i32) -> f32 {
    if x == 20 || x == 24 { 30.0 } else { 0.0 }
}

#[test]
fn proxy_does_not_tunnel_through_a_wall() {
    let mut tiles = buffers::<2>();
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(SIZE, SIZE), two_walls);
    let (above, beyond) = (point([10.0, 30.2, 5.0]), point([40.0, 30.7, 5.0]));
    let mut swept = Contact::new(ContactSettings::AT_1_KHZ);
    swept.step(&field.window, &above);
    let mut output = *swept.step(&field.window, &beyond);
    while !output.converged {
        output = *swept.step(&field.window, &beyond);
    }
    assert_eq!(output.state, ContactState::Touching);
    assert!(position(&output.proxy)[0] < 20.0, "{output:?}");
    assert!(output.displacement.x < -19.0);
}

#[test]
fn shifting_the_scene_changes_no_bit() {
    for shift in [1000, 100_000, 100_000_000] {
        let shift = shift / 32 * 32; // whole tiles, so that one function serves
        let mut near_tiles = buffers::<2>();
        let near = Field::<2>::filled(&mut near_tiles, FieldSize::new(SIZE, SIZE), rough);
        let mut far_tiles = buffers::<2>();
        let far = Field::<2>::shifted(&mut far_tiles, SIZE, shift, rough);
        let (mut a, mut b) = (
            Contact::new(ContactSettings::AT_1_KHZ),
            Contact::new(ContactSettings::AT_1_KHZ),
        );
        for p in wander(3, cases(1500, 30), 0.2, 1.0, 1.5) {
            let hip = point(p);
            let moved = GridPoint::new(hip.cell().map(|c| c + shift), hip.frac());
            let here = a.step(&near.window, &hip);
            let there = b.step(&far.window, &moved);
            assert_eq!(
                here.displacement.to_array().map(f32::to_bits),
                there.displacement.to_array().map(f32::to_bits)
            );
            assert_eq!(here.proxy.frac(), there.proxy.frac());
            assert_eq!(here.state, there.state);
        }
    }
}

fn flat(_: i32, _: i32) -> f32 {
    2.0
}
fn hills(x: i32, y: i32) -> f32 {
    (3.0 * (f64::from(x) * 0.4).sin() * (f64::from(y) * 0.3).cos()) as f32
}
fn rough(x: i32, y: i32) -> f32 {
    (hash(x, y) * 2.0) as f32
}
fn noise_100(x: i32, y: i32) -> f32 {
    (hash(x, y) * 200.0 - 100.0) as f32
}
fn checkerboard(x: i32, y: i32) -> f32 {
    ((x + y) & 1) as f32
}
fn spikes(x: i32, y: i32) -> f32 {
    if hash(x, y) > 0.97 { 1e4 } else { 0.0 }
}
fn holes(x: i32, y: i32) -> f32 {
    if hash(x, y) > 0.95 {
        f32::NAN
    } else {
        rough(x, y)
    }
}
fn denormal(x: i32, y: i32) -> f32 {
    f32::from_bits((hash(x, y) * 1000.0) as u32)
}

#[test]
fn contact_invariants_hold_on_flat_and_smooth_terrain() {
    for seed in SEEDS {
        let counts = check(
            "flat",
            flat,
            0.0,
            &wander(seed, cases(2000, 150), 0.05, 2.0, 0.6),
        );
        let some = cases(50, 10);
        assert!(counts[1] > some && counts[2] > some, "{counts:?}");
        check(
            "hills",
            hills,
            1.5,
            &wander(seed, cases(2000, 40), 0.1, 0.0, 3.5),
        );
        check(
            "hills",
            hills,
            1.5,
            &wander(seed, cases(500, 25), 3.0, 0.0, 3.5),
        );
        check(
            "denormal",
            denormal,
            0.0,
            &wander(seed, cases(500, 25), 0.1, 0.0, 0.5),
        );
    }
}

#[test]
fn contact_invariants_hold_on_rough_terrain() {
    for seed in SEEDS {
        check(
            "rough",
            rough,
            2.0,
            &wander(seed, cases(2000, 40), 0.05, 1.0, 1.2),
        );
        check(
            "rough",
            rough,
            2.0,
            &wander(seed, cases(1000, 20), 2.0, 1.0, 2.0),
        );
        check(
            "board",
            checkerboard,
            1.0,
            &wander(seed, cases(1000, 20), 0.2, 0.5, 1.0),
        );
        check(
            "noise",
            noise_100,
            200.0,
            &wander(seed, cases(1000, 20), 0.5, 0.0, 120.0),
        );
    }
}

#[test]
fn contact_invariants_hold_on_spikes_and_no_data() {
    for seed in SEEDS {
        check(
            "spikes",
            spikes,
            1e4,
            &wander(seed, cases(1000, 20), 0.5, 0.0, 1.5),
        );
        check(
            "no-data",
            holes,
            2.0,
            &wander(seed, cases(2000, 40), 0.2, 1.0, 1.5),
        );
    }
}

#[test]
fn contact_invariants_hold_when_the_hip_jumps() {
    for seed in SEEDS {
        check("flat", flat, 0.0, &teleport(seed, cases(300, 15), 2.0, 2.0));
        check(
            "hills",
            hills,
            1.5,
            &teleport(seed, cases(300, 15), 0.0, 5.0),
        );
        check(
            "rough",
            rough,
            2.0,
            &teleport(seed, cases(300, 15), 1.0, 2.0),
        );
        check(
            "no-data",
            holes,
            2.0,
            &teleport(seed, cases(300, 15), 1.0, 2.0),
        );
        check(
            "noise",
            noise_100,
            200.0,
            &teleport(seed, cases(300, 15), 0.0, 100.0),
        );
        check(
            "spikes",
            spikes,
            1e4,
            &teleport(seed, cases(300, 15), 0.0, 3.0),
        );
    }
}

/// On a path that hardly moves sideways, the sweep resolves poorly where the field begins; a
/// continuation from beyond would start outside of the terrain.
#[test]
fn steep_paths_over_the_border_cross_nothing() {
    let mut tiles = buffers::<8>();
    let mut field = Field::<8>::empty(&mut tiles, FieldSize::new(72, 72), |_, _| 0.0);
    field.fill_around(Cell::new(36, 36));
    let mut random = Random(1);
    for index in 0..cases(1000, 10) {
        let beside = [random.between(0.0, 72.0), random.between(-1.0, 0.0), 0.2].map(|x| x as f32);
        let from = GridPoint::new([0; 3], Vec3::from(beside));
        let to = GridPoint::new([3, 3, -100_000_000], Vec3::ZERO);
        let mut path = Path::through_air(from, to);
        let end = loop {
            match path.advance(&field.window, &mut Budget::new(WORK_PER_TICK)) {
                SweepEnd::Suspended => {}
                end => break end,
            }
        };
        assert!(matches!(end, SweepEnd::Under), "{index}, {from:?}: {end:?}");
    }
}

/// A field of 16 × 16 cells with no-data in the middle, flat at height 1.
fn with_no_data(x: i32, y: i32) -> f32 {
    match (6..=10).contains(&x) && (6..=10).contains(&y) {
        true => f32::NAN,
        false => 1.0,
    }
}

/// A patch has all four borders: a path straight down to the last sample in the east or north, or
/// to one beside no-data, meets the surface.
#[test]
fn vertical_path_onto_any_valid_sample_touches_surface() {
    let mut tiles = buffers::<2>();
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(16, 16), with_no_data);
    for (x, y) in (0..=16).flat_map(|y| (0..=16).map(move |x| (x, y))) {
        for fast in [0.1, 1.5, 500.0] {
            let at = |z: f32| GridPoint::new([x, y, 0], Vec3::Z * z);
            let mut contact = Contact::new(ContactSettings::AT_1_KHZ);
            let above = contact.step(&field.window, &at(1.0 + fast)).state;
            let output = contact.step(&field.window, &at(0.75));
            let expected = match with_no_data(x, y).is_nan() {
                true => (above, Vec3::ZERO),
                false => (ContactState::Touching, Vec3::Z * 0.25),
            };
            let output = (output.state, output.displacement);
            assert_eq!(output, expected, "({x}, {y}) {fast}");
        }
    }
}

/// A path that often lies on grid lines has the same forces as the mirrored path over the mirrored
/// field.
#[test]
fn mirrored_path_along_grid_lines_has_mirrored_forces() {
    let mut tiles = [buffers::<2>(), buffers::<2>()];
    let [plain, mirrored] = &mut tiles;
    let lopsided = |x: i32, y: i32| with_no_data(x - 2, y + 1) + 0.125 * x as f32;
    let size = FieldSize::new(16, 16);
    let plain = Field::<2>::filled(plain, size, lopsided);
    let mirrored = Field::<2>::filled(mirrored, size, move |x, y| lopsided(16 - x, 16 - y));
    let mut random = Random(5);
    let mut touched = 0;
    for _ in 0..cases(400, 10) {
        let mut contacts = [(); 2].map(|()| Contact::new(ContactSettings::AT_1_KHZ));
        let mut at = [8.0, 8.0, 4.0_f32];
        for tick in 0..60 {
            let axis = (random.between(0.0, 3.0) as usize).min(2);
            let step = 0.25 * random.between(-8.0, 9.0).floor() as f32;
            let max = if axis == 2 { 4.0 } else { 17.0 };
            at[axis] = (at[axis] + step).clamp(-1.0, max);
            let [x, y, z] = at;
            let positions = [[x, y, z], [16.0 - x, 16.0 - y, z]];
            let mut output = [ContactOutput::default(); 2];
            for (index, field) in [&plain, &mirrored].into_iter().enumerate() {
                let hip = GridPoint::new([0; 3], Vec3::from(positions[index]));
                output[index] = *contacts[index].step(&field.window, &hip);
            }
            let [one, other] = output;
            let back = Vec3::new(-1.0, -1.0, 1.0) * other.displacement;
            assert_eq!(one.state, other.state, "{tick}: {at:?}");
            assert!(
                (one.displacement - back).length() < 1e-5,
                "{tick}: {at:?} {one:?} {back}"
            );
            touched += u32::from(one.state == ContactState::Touching);
        }
    }
    assert!(touched > cases(4000, 20), "{touched}");
}

/// A ground, the height around which it is rendered, and the distance up and down from there.
type TestGround = (fn(i32, i32) -> f32, f64, f64);

/// Ground of every kind.
const GROUNDS: [TestGround; 7] = [
    (flat, 2.0, 0.6),
    (hills, 0.0, 3.5),
    (rough, 1.0, 1.2),
    (noise_100, 0.0, 120.0),
    (checkerboard, 0.5, 1.0),
    (spikes, 0.0, 1.5),
    (holes, 1.0, 1.5),
];

/// Returns the outputs of two contacts with different settings on the same path, tick by tick, each
/// repeated until it converges.
fn side_by_side(
    one: ContactSettings,
    other: ContactSettings,
    mut compare: impl FnMut(&ContactOutput, &ContactOutput, [u32; 2]),
) {
    for (height, mid, span) in GROUNDS {
        let mut tiles = buffers::<2>();
        let field = Field::<2>::filled(&mut tiles, FieldSize::new(SIZE, SIZE), height);
        let mut contacts = [one, other].map(Contact::new);
        // Usually below the surface, after a start above it.
        let above = [[30.0, 30.0, 2e4]].into_iter();
        for step in [0.01, 0.3, 2.0] {
            let below = wander(5, cases(1500, 20), step, mid - 0.6 * span, 0.6 * span);
            for p in above.clone().chain(below) {
                let hip = point(p);
                let mut ticks = [0; 2];
                let answers = [0, 1].map(|i| {
                    let before = *contacts[i].output();
                    loop {
                        ticks[i] += 1;
                        let output = *contacts[i].step(&field.window, &hip);
                        if output.converged {
                            return output;
                        }
                        assert!(ticks[i] < 10_000, "{hip:?} never converges");
                        contacts[i].resume(&before);
                    }
                });
                compare(&answers[0], &answers[1], ticks);
            }
        }
    }
}

fn bits(output: &ContactOutput) -> (ContactState, GridPoint, [u32; 3]) {
    let displacement = output.displacement.to_array().map(f32::to_bits);
    (output.state, output.proxy, displacement)
}

#[test]
fn fast_paths_change_no_bit() {
    let without = ContactSettings {
        fast_paths: false,
        ..ContactSettings::AT_1_KHZ
    };
    let (mut ticks, mut shorter) = (0, 0);
    side_by_side(ContactSettings::AT_1_KHZ, without, |with, without, _| {
        assert_eq!(bits(with), bits(without));
        ticks += 1;
        shorter += u32::from(with.work < without.work);
    });
    assert!(
        shorter > ticks / 10,
        "{shorter} of {ticks} used a fast path"
    );
}

#[test]
fn suspended_tick_ends_on_the_same_bits() {
    let unlimited = ContactSettings {
        work_per_tick: u32::MAX / 2,
        ..ContactSettings::AT_1_KHZ
    };
    let mut cut = 0;
    for work_per_tick in [ContactSettings::MIN_WORK, WORK_PER_TICK] {
        let short = ContactSettings {
            work_per_tick,
            ..ContactSettings::AT_1_KHZ
        };
        side_by_side(unlimited, short, |unlimited, short, ticks| {
            assert_eq!(bits(unlimited), bits(short));
            assert_eq!(ticks[0], 1);
            assert!(short.work <= work_per_tick);
            cut += u32::from(ticks[1] > 1);
        });
    }
    assert!(cut > cases(500, 5), "{cut} ticks were cut short");
}

/// Tents whose top is a vertex, or an edge eastward or northward; one side of the edge is steeper.
#[test]
fn proxy_leaves_edge_or_vertex_by_its_steepest_side() {
    let tent = |x: i32, y: i32, at: i32| -> f32 {
        let side = |c: i32, gentle: f32, steep: f32| match c - at {
            d if d < 0 => gentle * d as f32,
            d => -steep * d as f32,
        };
        side(x, 0.1, 0.4) + side(y, 0.15, 0.3)
    };
    for mirrored in [[false, false], [true, false], [false, true], [true, true]] {
        let mut tiles = buffers::<2>();
        let field = Field::<2>::filled(&mut tiles, FieldSize::new(SIZE, SIZE), move |x, y| {
            let turned = |c: i32, turned: bool| if turned { SIZE - c } else { c };
            tent(turned(x, mirrored[0]), turned(y, mirrored[1]), 30)
        });
        let mut contact = Contact::new(ContactSettings::AT_1_KHZ);
        contact.step(&field.window, &point([30.0, 30.0, 1.0]));
        let output = *contact.step(&field.window, &point([30.0, 30.0, -0.2]));
        assert_eq!(output.state, ContactState::Touching);
        let toward = |component: f32, mirrored: bool| if mirrored { -component } else { component };
        let [east, north, _] = output.displacement.to_array();
        assert!(toward(east, mirrored[0]) > 0.0, "{mirrored:?} {output:?}");
        assert!(toward(north, mirrored[1]) > 0.0, "{mirrored:?} {output:?}");
    }
}

/// No arm moves by a window in a tick: such a HIP is a new one, without force until it has been
/// above the surface.
#[test]
fn hip_leap_beyond_the_window_resets_the_contact() {
    let mut tiles = buffers::<2>();
    let field = Field::<2>::filled(&mut tiles, FieldSize::new(SIZE, SIZE), |_, _| 0.0);
    let mut contact = Contact::new(ContactSettings::AT_1_KHZ);
    let mut state = |hip| contact.step(&field.window, &point(hip)).state;
    assert_eq!(state([2.5, 2.5, 1.0]), ContactState::Free);
    assert_eq!(state([2.5, 2.5, -0.5]), ContactState::Touching);
    assert_eq!(state([-60.5, 2.5, -0.5]), ContactState::Touching);
    assert_eq!(state([4.5, 2.5, -0.5]), ContactState::Unseeded);
    assert_eq!(state([4.5, 2.5, 0.5]), ContactState::Free);
}
