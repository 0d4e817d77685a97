//! Regressions found by random scenes, reduced as far as possible, each named after its cause.

use hapterra_core::contact::ContactState;
use hapterra_tests::invariants::Violation;
use hapterra_tests::scene::run::{Execution, Scene};
use hapterra_tests::scene::terrain::{Kind, Terrain};
use hapterra_tests::scene::tile_supply::{Buffers, Supply};

fn field(size: [i32; 2], height: impl Fn(i32, i32) -> f32) -> Terrain {
    Terrain::from_fn(Kind::Rough, size, height)
}

/// Runs a scene with all checks. Returns the states of its ticks.
fn run(
    terrain: Terrain,
    path: &[[f64; 3]],
    execution: Execution,
    supply: Supply,
) -> Result<Vec<ContactState>, Violation> {
    let scene = Scene::new(terrain, path.to_vec(), execution, supply);
    let mut buffers = Buffers::default();
    scene.run(&mut buffers)?;
    let seen = scene.render(&mut buffers, [0; 3], supply, |_| Ok(()))?;
    Ok(seen.iter().map(|seen| seen.output.state).collect())
}

/// A proxy exactly on the east or north border of the data that moved inward was treated like one
/// that leaves no-data.
#[test]
fn proxy_on_east_border_leaves_as_on_west_border() {
    let terrain = field([6, 6], |x, y| match (x, y) {
        (0, 3) => -0.5,
        (1, 4) => 0.5,
        (2, 4) => 1.078_070_3,
        _ => 0.0,
    });
    let path = [
        [3.5, 3.5, 4.0],
        [0.5, 0.5, 0.0],
        [0.5, 2.0, -2.502_653_121_948_242],
        [0.5, 0.5, 1.737_531_661_987_304_7],
    ];
    let states = run(terrain, &path, Execution::LockStep, Supply::Preloaded).expect("holds");
    assert_eq!(states.last(), Some(&ContactState::Free));
}

/// The line from the proxy to the HIP led over no-data into solid ground behind it, and the contact
/// was dropped with all its force at once.
#[test]
fn contact_over_no_data_into_solid_ends_without_force_step() {
    const N: f32 = f32::NAN;
    let rows: [[f32; 10]; 4] = [
        [
            1.313, 1.851, 0.167, 0.846, 0.1, 0.926, 1.854, 1.275, 0.925, 1.364,
        ],
        [
            0.455, 1.591, 1.993, 1.789, 1.256, 0.297, 0.166, 1.999, N, 0.211,
        ],
        [
            0.602, 1.52, 1.175, 1.087, 0.726, 1.627, 0.023, 0.438, 1.799, 0.962,
        ],
        [
            1.449, N, 1.431, 1.942, 0.395, 1.648, 0.202, 0.417, 0.253, 1.333,
        ],
    ];
    // Ground for the contact in the east, no-data west of it.
    let terrain = field([14, 3], |x, y| {
        let row = rows[y as usize];
        if x < 10 { row[x as usize] } else { 0.25 }
    });
    let mut path = vec![[9.5, 1.0625, 4.0], [9.5, 1.0625, 0.0]];
    let along = |i: i32| 9.5 - f64::from(i) / 16.0;
    path.extend((0..88).map(|i| [along(i), 1.0625, 0.0]));
    path.extend((0..64).map(|i| [4.0, 1.03125, f64::from(i) / 64.0]));
    run(terrain, &path, Execution::RealTime, Supply::Preloaded).expect("holds");
}

/// The closest point is 4·10⁻⁵ cell beyond the edge under the HIP.
#[test]
fn minimum_just_beyond_an_edge_is_found() {
    let rows = [
        [2.522_146_5, 0.941_511_03, -1.064_021_5, -2.589_368_8],
        [2.514_235, 0.938_557_8, -1.060_683_8, -2.581_246_6],
        [2.384_069_7, 0.889_967_4, -1.005_770_8, -2.447_612],
        [2.137_979_5, 0.798_102_5, -0.901_952_45, -2.194_962_7],
    ];
    let terrain = field([3, 3], |x, y| rows[y as usize][x as usize]);
    let path = [
        [2.5, 2.5, 1e4],
        [1.948_299_407_958_984_4, 1.0, -1.016_087_532_043_457],
    ];
    run(terrain, &path, Execution::RealTime, Supply::Preloaded).expect("holds");
}

/// The force that fades is not that of the last slide but of the last tick with a search: a tile
/// arrived between the two.
#[test]
fn contact_lost_after_a_late_tile_fades_from_its_last_force() {
    let terrain = field([128, 20], |x, _| match x {
        ..=32 => 0.0,
        33..=35 => f32::NAN,
        _ => 2.0,
    });
    let mut path = vec![[10.5, 10.5, 4.0]];
    path.extend((0..16).map(|i| [10.5 + f64::from(i), 10.5, -0.05 * f64::from(i + 1)]));
    path.push([40.5, 10.5, 0.5]);
    let supply = Supply::OnDemand { latency: 40 };
    let states = run(terrain, &path, Execution::LockStep, supply).expect("holds");
    assert_eq!(states.last(), Some(&ContactState::Releasing));
}

/// The line from the surface to a HIP 1.1·10⁻⁵ cell below it was so short that it was skipped like
/// the corner that a path touches when it leaves an edge.
#[test]
fn hip_just_below_a_vertex_does_not_pass() {
    let rows = [
        [-297.904_27, 265.127_4, 34.867_683, 109.010_83],
        [35.195_873, 9.611_267, 268.303_25, 93.524_216],
        [9.180_015, -154.220_29, 5.923_537_7, -9.108_968],
        [-94.330_505, 176.391_34, 36.765_614, -243.958_5],
    ];
    let terrain = field([3, 3], |x, y| rows[y as usize][x as usize]);
    let near = |x: f64, y: f64, z: f64| [2.0 + x, 2.0 + y, z];
    let path = [
        near(0.0, 0.0, 310.0),
        near(0.0, 0.0, 5.893_146_514_892_578),
        near(0.0, 0.03, 5.893_146_514_892_578),
        near(0.03, 0.03, 5.953_146_934_509_277),
        near(0.0, -0.03, 5.953_146_934_509_277),
        near(-0.03, -0.03, 5.953_146_934_509_277),
        near(0.0, 0.0, 5.923_147_201_538_086),
    ];
    let states = run(terrain, &path, Execution::LockStep, Supply::Preloaded).expect("holds");
    assert_eq!(states.last(), Some(&ContactState::Touching));
}

/// The point where the proxy left the surface was exact to the last place of its height above the
/// tile's base: 1.5·10⁻⁵ cell below the surface at 138 cells, its path ended at its start, and the
/// HIP, 0.6 cell above, was pulled down.
#[test]
fn hip_leaving_high_ground_is_released() {
    let height = |x: i32, y: i32| 140.0 - 0.797_21 * x as f32 - 1.051_4 * y as f32;
    let count = 1.0 / f64::from(1 << 20);
    let mut path = vec![[2.5, 2.5, 160.0]];
    for (x, y) in (1..6).flat_map(|x| (1..6).map(move |y| (x, y))) {
        let [east, north] = [x, y].map(f64::from);
        let top = (f64::from(height(x, y)) / count).floor() * count;
        for (to_east, to_north) in [(-370.0, -13_040.0), (13_040.0, 370.0)] {
            path.push([east, north, top - count]);
            let [x, y] = [east + to_east * count, north + to_north * count];
            path.push([x, y, top + 0.609_375]);
        }
    }
    let terrain = field([6, 6], height);
    let states = run(terrain, &path, Execution::LockStep, Supply::Preloaded).expect("holds");
    let expected = [ContactState::Touching, ContactState::Free];
    assert!(states[1..].chunks(2).all(|pair| pair == expected));
}

/// A part of the path ended exactly on the border of the data, far below it: its entry from outside
/// was treated as a crossing from above.
#[test]
fn path_part_ending_below_the_border_is_not_a_crossing() {
    let terrain = field([128, 64], |_, _| 2.0);
    let path = [
        [119.25, 1.5, 4.0],
        [119.25, -1.0, 4.0],
        [119.25, -1.0, 0.375],
        [3.0, 3.0, -1_000_000.0],
    ];
    let states = run(terrain, &path, Execution::LockStep, Supply::Preloaded).expect("holds");
    assert_eq!(
        states[1..],
        [
            ContactState::Free,
            ContactState::Free,
            ContactState::Unseeded
        ]
    );
}

/// A HIP beside the field moves deep under it, in over its very corner. The search along this path
/// ended at the border of the field, and the rest of the path had no known start: it made contact
/// from below.
#[test]
fn path_entering_under_the_corner_makes_no_contact() {
    for depth in [50.0, 1e4, 1e8] {
        let terrain = field([4, 4], |_, _| 0.0);
        let path = [[1.5, 1.5, 3.0], [-1.0, -1.0, 3.0], [3.0, 3.0, -depth]];
        let states = run(terrain, &path, Execution::LockStep, Supply::Preloaded).expect("holds");
        assert_eq!(
            states.last(),
            Some(&ContactState::Unseeded),
            "{depth} cells deep"
        );
    }
}

/// A proxy that rounding kept at the foot of a spike was not released later either: at rest on
/// level ground it pulled down the HIP above it.
#[test]
fn hip_vertically_above_its_proxy_is_released() {
    let mut buffers = Buffers::default();
    for number in [9, 99, 186] {
        let scene = Scene::random(91, number);
        let seen = scene.render(&mut buffers, [0; 3], scene.supply, |_| Ok(()));
        for seen in seen.expect("it settles") {
            let [x, y, z] = [0, 1, 2].map(|axis| seen.hip[axis] - seen.proxy[axis]);
            let touching = seen.output.state == ContactState::Touching && seen.output.converged;
            assert!(!(touching && x == 0.0 && y == 0.0 && z > 1e-3), "{seen:?}");
        }
    }
}

/// A path that met a saddle of the checkerboard again and again, each time nearer to the HIP,
/// counted as motion to and fro, and the proxy stopped half-way up the last saddle.
#[test]
fn proxy_may_leave_while_it_approaches_the_hip() {
    let terrain = field([1500, 40], |x, y| ((x + y) & 1) as f32);
    let path = [[92.25, 8.0, 3.0], [92.5, 8.0, 0.5], [796.0, 36.0, 1.0]];
    let supply = Supply::OnDemand { latency: 0 };
    let states = run(terrain, &path, Execution::LockStep, supply).expect("holds");
    assert_eq!(states[1..], [ContactState::Touching, ContactState::Free]);
}

/// A proxy left a point 10⁻⁶ cell before the foot of a wall and was held where it had begun, but
/// counted as moved: measured in parts of so short a step it had moved.
#[test]
fn proxy_stopped_at_its_departure_climbs_further() {
    let terrain = field([8, 8], |x, y| match (x, y) {
        (4, _) | (_, 5) => 300.0,
        (3, 3) => -0.669_687,
        (3, 4) => -0.581_768_7,
        _ => 0.0,
    });
    let path = [
        [3.0, 3.0, 4.0],
        [5.0, 2.982_746_124_267_578, -1.391_655_921_936_035_2],
        [4.0, 2.982_936_859_130_859, 299.406_029_701_232_9],
        [4.042_195_320_129_395, 4.0, 287.258_709_907_531_74],
        [4.0, 4.055_518_150_329_59, 300.028_407_096_862_8],
    ];
    let states = run(terrain, &path, Execution::LockStep, Supply::Preloaded).expect("holds");
    assert_eq!(states.last(), Some(&ContactState::Free));
}

/// For a HIP 0.03 cell away the squared distance was considered more exact than the positions it is
/// computed from, and the path over an edge was missed.
#[test]
fn proxy_finds_the_path_over_an_edge_to_a_near_hip() {
    let rows = [
        [-29.472_837, 13.072_403, -19.966_434, 31.896_08],
        [21.871_374, -11.741_989, 23.615_377, -18.654_66],
        [-17.607_483, 18.684_91, -23.617_138, 23.456_934],
        [20.223_185, -24.345_136, 16.404_583, -16.162_767],
    ];
    let terrain = field([3, 3], move |x, y| rows[y as usize][x as usize]);
    let path = [
        [1.0, 1.25, 40.0],
        [
            0.996_925_354_003_906_2,
            1.326_526_641_845_703_1,
            -2.577_595_710_754_394_5,
        ],
        [
            1.003_319_740_295_410_2,
            1.325_905_799_865_722_7,
            -2.596_959_114_074_707,
        ],
        [
            1.009_243_965_148_925_8,
            1.323_417_663_574_218_8,
            -2.611_005_783_081_054_7,
        ],
    ];
    let states = run(terrain, &path, Execution::LockStep, Supply::Preloaded).expect("holds");
    assert_eq!(states.last(), Some(&ContactState::Touching));
}

/// For a HIP 10⁸ cells down, a proxy's height above it was exact to 8 cells, and a path down a
/// slope counted as leading no nearer: its end depended on the window.
#[test]
fn proxy_descends_a_slope_far_above_the_hip_to_its_end() {
    let slope = field([200, 40], |x, _| -0.56 * x as f32);
    let path = [[100.5, 2.5, 4.0], [100.5, 2.5, -57.0], [3.0, 3.0, -1e8]];
    let scene = Scene::new(slope, path.to_vec(), Execution::LockStep, Supply::Preloaded);
    let mut buffers = Buffers::default();
    scene.run(&mut buffers).expect("holds");
    let seen = scene.render(&mut buffers, [0; 3], Supply::Preloaded, |_| Ok(()));
    let last = seen.expect("settles").pop().expect("ticks");
    assert_eq!(last.proxy[..2], [200.0, 3.0]);
}

/// A path off a slope of 190 skipped its first step, 6·10⁻⁶ cell long, and hit the sample at the
/// end of that step, 10⁻³ cell above the HIP.
#[test]
fn path_off_a_steep_slope_includes_its_first_short_step() {
    let mut buffers = Buffers::default();
    Scene::random(778, 38_673).run(&mut buffers).expect("holds");
}

/// For a HIP a million cells away all points of a patch were beside its corner: a proxy was placed
/// on a vertex 70,000 cells up, because of the valley beyond it.
#[test]
fn distant_hip_lifts_no_proxy_to_a_vertex() {
    let mut buffers = Buffers::default();
    let scene = Scene::random(20_261_126, 38_445);
    scene.run(&mut buffers).expect("holds");
}

/// A proxy 2·10⁻⁸ cell beside a vertex left for a HIP 16,000 cells up, and hit the ground of the
/// cell that its path crosses for those 2·10⁻⁸ cell.
#[test]
fn upward_path_is_not_stopped_by_a_cell_that_it_grazes() {
    let mut buffers = Buffers::default();
    let scene = Scene::random(20_261_128, 2_411);
    scene.run(&mut buffers).expect("holds");
}

/// A proxy beside a spike of 10⁶ left an edge and was held beyond it, 32 times, and then rested on
/// the edge's far side, below the HIP, which it pulled.
#[test]
fn proxy_without_departures_rests_where_it_was_stopped() {
    let mut buffers = Buffers::default();
    Scene::random(31, 12_943).run(&mut buffers).expect("holds");
}

/// A path of 60 cells close over the ground takes several ticks. The HIP moved in each, and the
/// path began again: while the HIP moved no force was rendered.
#[test]
fn proxy_in_the_air_arrives_while_the_hip_moves() {
    let cliff = field([140, 20], |x, _| match x {
        ..=50 => 30.0,
        _ => 29.7 - 0.8 * (x - 50) as f32,
    });
    let trembles = |tick: i32| {
        let off = 0.01 * f64::from(tick % 3);
        [110.5 + off, 10.5 - off, -18.75]
    };
    let mut path = vec![[45.5, 10.5, 35.0], [45.5, 10.5, 28.0]];
    path.extend((0..40).map(trembles));
    let states = run(cliff, &path, Execution::RealTime, Supply::Preloaded).expect("holds");
    let in_the_air = states[2..]
        .iter()
        .filter(|state| **state == ContactState::Free);
    assert!((1..20).contains(&in_the_air.count()), "{states:?}");
    assert_eq!(states.last(), Some(&ContactState::Touching));
}
