//! Replays compared with a dense search in `f64` that shares no code with the loop.

use hapterra::replay::{OfflineDevice, Rule, on_native};
use hapterra::synth::{Kind, Synth};
use hapterra::terrain::{HapticCells, HapticGrid, Scale, Terrain};
use hapterra_core::contact::ContactState;
use hapterra_core::force::SurfaceParams;
use hapterra_core::scene::TickRecord;
use hapterra_tests::dense_search::Oracle;
use hapterra_tests::random_paths::wander;
use hapterra_tests::shared;
use heightfield::{OpenOptions, Raster};

/// Distance of the proxy from the surface, cells: some roundings of a height relative to its tile.
const ON_SURFACE: f64 = 2e-5;
/// Largest advantage of another point near the proxy in its distance from the HIP, cells.
const CLOSEST: f64 = 1e-6;
/// Range of the search for the other point, cells, limited to the proxy's patch: on rough ground
/// there is often another local closest point beyond a hump at the border. It detects a proxy that
/// is wrong by a hundredth of its distance.
const NEARBY: f64 = 2e-4;
/// A proxy this close to a border is on it, cells.
const ON_BORDER: f64 = 1e-6;
/// Error of the force, N, at stiffnesses near the usual.
const FORCE_N: f64 = 1e-4;

fn mm(sample: &TickRecord, scale: &Scale) -> ([f64; 3], [f64; 3]) {
    (scale.to_mm(&sample.hip), scale.to_mm(&sample.proxy))
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Returns the heights of a terrain in cells, from the rendered grid (`geographic_scale.rs`
/// compares that with the ground).
fn heights<'t>(terrain: &'t Terrain<'_>) -> impl Fn(i64, i64) -> f64 + 't {
    move |x, y| {
        let height = terrain.grid().height(x as u32, y as u32);
        height * terrain.scale().height_mm_per_unit() / terrain.scale().cell_mm()
    }
}

fn render(replayer: &mut OfflineDevice<'_>, hip_mm: [f64; 3]) -> TickRecord {
    let hip = replayer.terrain().scale().to_grid(hip_mm);
    replayer.step(hip.expect("addressable")).expect("rendered")
}

/// Returns the distance to the nearest border of a patch that the point is not on.
fn to_border(place: [f64; 2]) -> f64 {
    let gaps = place.map(|x| (x - x.round()).abs());
    let gaps = gaps.into_iter().filter(|gap| *gap > ON_BORDER);
    gaps.fold(f64::INFINITY, f64::min)
}

/// Wanders over a terrain and checks every result. Returns the number of rows in contact.
fn check_contact(raster: &Raster, scale: Scale, seed: u64, rows: usize) -> usize {
    let terrain = Terrain::new(raster, scale, 0).expect("terrain");
    let height = heights(&terrain);
    let oracle = Oracle::new(terrain.size().map(i64::from), &height);
    let params = SurfaceParams::PREMIUM;
    let mut replayer = on_native(&terrain, params).expect("opened");
    let mut touched = 0;
    let mut near_holes = 0;
    for hip_mm in wander(&terrain, seed, rows, 0.5) {
        let sample = render(&mut replayer, hip_mm);
        let (hip, proxy) = mm(&sample, &scale);
        let force = sample.force_n.to_array().map(f64::from);
        if sample.state != ContactState::Touching {
            assert_eq!(force, [0.0; 3], "a force without contact at {hip_mm:?}");
            continue;
        }
        touched += 1;
        let (hip_c, proxy_c) = (
            hip.map(|x| x / scale.cell_mm()),
            proxy.map(|x| x / scale.cell_mm()),
        );
        let surface = oracle.surface(proxy_c[0], proxy_c[1]);
        let surface = surface.unwrap_or_else(|| panic!("a proxy over nothing at {proxy_c:?}"));
        let size = surface.abs().max(1.0) * 4.0 * f64::from(f32::EPSILON);
        assert!(
            (proxy_c[2] - surface).abs() < ON_SURFACE + size,
            "the proxy {proxy_c:?} is off the surface at {surface}"
        );
        let place = [proxy_c[0], proxy_c[1]];
        let closer = oracle.closer_nearby(hip_c, place, NEARBY.min(to_border(place)));
        assert!(
            closer < CLOSEST,
            "{closer} closer than {proxy_c:?} to {hip_c:?}"
        );
        let displacement_mm: [f64; 3] = std::array::from_fn(|i| proxy[i] - hip[i]);
        let k = f64::from(params.stiffness_n_per_mm);
        let full = (k * length(displacement_mm)).min(f64::from(params.max_force_n));
        // The force follows the displacement; near no-data it may be faded.
        assert!(
            length(force) <= full + FORCE_N,
            "{force:?} {displacement_mm:?}"
        );
        if oracle.is_known_around(hip_c[0], hip_c[1], 40.0) {
            let share = full / length(displacement_mm).max(1e-12);
            for axis in 0..3 {
                assert!((force[axis] - share * displacement_mm[axis]).abs() < FORCE_N);
            }
        } else {
            near_holes += 1;
        }
    }
    eprintln!("{touched} of {rows} rows in contact, {near_holes} of them near no-data or a border");
    touched
}

fn synthetic(kind: Kind) -> Raster {
    Synth::new(kind, 7, 30.0).raster(160, 130).expect("raster")
}

#[test]
fn proxy_is_local_closest_point_on_synthetic_terrains() {
    let scale = Scale::new(1.0, 1.0).expect("scale");
    for kind in [
        Kind::Fractal,
        Kind::Ridge,
        Kind::Plane,
        Kind::Steps,
        Kind::Crater,
        Kind::Spikes,
    ] {
        eprint!("{kind:?}: ");
        let touched = check_contact(&synthetic(kind), scale, 11, 3000);
        assert!(touched > 300, "{kind:?}: the walk hardly touches");
    }
}

#[test]
fn proxy_is_local_closest_point_on_real_terrains() {
    for (file, cell_mm) in [
        ("dem/real/bigtujunga.tif", 1.0),
        ("dem/real/mt_everest_90m.tif", 0.3),
        ("dem/real/red_butte_slc_utm12_f32.tif", 2.0),
        ("dem/real/hugo_site.asc", 1.0),
        ("dem/real/dom1_32_356_5699_1_nw_2020.tif", 1.0),
    ] {
        let Some(path) = shared(file) else { return };
        let raster = Raster::open(path, &OpenOptions::default()).expect("opens");
        let grid = HapticGrid::new(&raster, HapticCells::default());
        let scale = grid.true_scale(cell_mm).expect("scale");
        eprint!("{file}: ");
        let touched = check_contact(&raster, scale, 5, 2000);
        assert!(touched > 100, "{file}: the walk hardly touches");
    }
}

/// Opens a replay by a contact rule.
fn opened<'t>(terrain: &'t Terrain<'t>, rule: Rule) -> OfflineDevice<'t> {
    let params = SurfaceParams::PREMIUM;
    let replayer = on_native(terrain, params).expect("opened");
    match rule {
        Rule::Swept => replayer,
        Rule::Paper => replayer.by_published_rule(params),
    }
}

/// Straight down and up again at points across the field: contact on one side of the surface, none
/// on the other.
#[test]
fn contact_begins_and_ends_at_the_surface() {
    let raster = synthetic(Kind::Fractal);
    let scale = Scale::new(0.7, 0.9).expect("scale");
    let terrain = Terrain::new(&raster, scale, 0).expect("terrain");
    for rule in [Rule::Swept, Rule::Paper] {
        let mut replayer = opened(&terrain, rule);
        for (i, gap) in [1e-3, 1e-4, 0.1].into_iter().cycle().take(60).enumerate() {
            let [x, y] = [10.0 + 1.31 * i as f64, 70.0 - 0.83 * i as f64];
            let ground = terrain.height_mm(x, y).expect("known");
            let top = f64::from(terrain.top()) * scale.cell_mm() + 1.0;
            render(&mut replayer, [x, y, top]);
            let above = render(&mut replayer, [x, y, ground + gap]);
            assert_eq!(above.state, ContactState::Free, "{rule:?} {i}");
            let below = render(&mut replayer, [x, y, ground - gap]);
            assert_eq!(below.state, ContactState::Touching, "{rule:?} {i}");
            assert!(below.force_n.z > 0.0);
            let again = render(&mut replayer, [x, y, ground + 2.0 * gap]);
            assert_eq!(again.state, ContactState::Free, "{rule:?} {i}");
            render(&mut replayer, [x, y, top]);
        }
    }
}

#[test]
fn contact_requires_the_hip_to_have_been_above_the_surface() {
    let raster = synthetic(Kind::Plane);
    let terrain = Terrain::new(&raster, Scale::new(1.0, 1.0).expect("scale"), 0).expect("terrain");
    let mut replayer = on_native(&terrain, SurfaceParams::PREMIUM).expect("opened");
    let ground = terrain.height_mm(60.0, 50.0).expect("known");
    for depth in [5.0, 1.0, 0.1] {
        let sample = render(&mut replayer, [60.0, 50.0, ground - depth]);
        assert_eq!(
            (sample.state, sample.force_n.length()),
            (ContactState::Unseeded, 0.0)
        );
    }
    render(&mut replayer, [60.0, 50.0, ground + 0.1]);
    let sample = render(&mut replayer, [60.0, 50.0, ground - 1.0]);
    assert_eq!(sample.state, ContactState::Touching);
}

/// Returns a terrain with 20 × 20 no-data samples in its middle.
fn holed() -> Raster {
    Raster::from_fn(100, 100, |x, y| {
        let hole = (40..60).contains(&x) && (40..60).contains(&y);
        if hole { f32::NAN } else { 5.0 }
    })
    .expect("raster")
}

#[test]
fn no_data_and_positions_off_the_terrain_exert_no_force() {
    let raster = holed();
    let terrain = Terrain::new(&raster, Scale::new(1.0, 1.0).expect("scale"), 0).expect("terrain");
    for rule in [Rule::Swept, Rule::Paper] {
        for place in [[50.0, 50.0], [-3.0, 50.0], [50.0, 120.0], [1e6, -1e6]] {
            let mut replayer = opened(&terrain, rule);
            for step in 0..40 {
                let z = 20.0 - f64::from(step);
                let sample = render(&mut replayer, [place[0], place[1], z]);
                assert_ne!(
                    sample.state,
                    ContactState::Touching,
                    "{rule:?} {place:?} {z}"
                );
                assert_eq!(sample.force_n.length(), 0.0);
            }
        }
    }
}

/// A slide over the edge of no-data releases gently; a return from the side below the surface makes
/// no contact.
#[test]
fn no_data_edge_releases_smoothly_and_reentry_has_no_force() {
    let raster = holed();
    let terrain = Terrain::new(&raster, Scale::new(1.0, 1.0).expect("scale"), 0).expect("terrain");
    let mut replayer = on_native(&terrain, SurfaceParams::PREMIUM).expect("opened");
    render(&mut replayer, [30.0, 50.5, 7.0]);
    let mut last = render(&mut replayer, [30.0, 50.5, 4.0]);
    let mut max_step = 0.0f32;
    let mut x = 30.0;
    while x < 45.0 {
        x += 0.005;
        let sample = render(&mut replayer, [x, 50.5, 4.0]);
        max_step = max_step.max((sample.force_n - last.force_n).length());
        last = sample;
    }
    assert_eq!(
        (last.state, last.force_n.length()),
        (ContactState::Unseeded, 0.0)
    );
    assert!(max_step < 0.03, "a kick of {max_step} N in a tick");
    while x > 30.0 {
        x -= 0.05;
        let sample = render(&mut replayer, [x, 50.5, 4.0]);
        assert_eq!(sample.force_n.length(), 0.0, "hooked at {x}");
    }
}

/// The paper's Figure 8: from one side of a peak to the other in one tick.
#[test]
fn fast_sweep_does_not_pass_through_a_peak() {
    let raster = Raster::from_fn(64, 64, |x, _| if x == 30 || x == 33 { 10.0 } else { 0.0 });
    let raster = raster.expect("raster");
    let terrain = Terrain::new(&raster, Scale::new(1.0, 1.0).expect("scale"), 0).expect("terrain");
    let sweep = || {
        let mut replayer = on_native(&terrain, SurfaceParams::PREMIUM).expect("opened");
        render(&mut replayer, [28.0, 32.3, 5.0]);
        render(&mut replayer, [36.0, 32.3, 5.0])
    };
    let swept = sweep();
    assert_eq!(swept.state, ContactState::Touching);
    let proxy = terrain.scale().to_mm(&swept.proxy);
    assert!(proxy[0] < 30.0, "stopped on the near side: {proxy:?}");
    assert!(swept.force_n.x < -3.0, "{:?}", swept.force_n);
}

#[test]
fn replay_of_a_trajectory_is_deterministic() {
    let raster = synthetic(Kind::Fractal);
    let terrain = Terrain::new(&raster, Scale::new(1.0, 1.0).expect("scale"), 0).expect("terrain");
    let path = wander(&terrain, 3, 1500, 1.0);
    let run = || -> Vec<_> {
        let mut replayer = on_native(&terrain, SurfaceParams::PREMIUM).expect("opened");
        path.iter()
            .map(|hip| render(&mut replayer, *hip))
            .map(|s| {
                (
                    s.hip,
                    s.proxy,
                    s.force_n.to_array().map(f32::to_bits),
                    s.state,
                )
            })
            .collect()
    };
    assert_eq!(run(), run());
}
