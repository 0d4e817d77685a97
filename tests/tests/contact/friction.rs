//! Friction in use: real ground, an arm's encoders, the command.

use hapterra::replay::on_native;
use hapterra::terrain::Terrain;
use hapterra_core::contact::{Contact, ContactSettings, ContactState, Friction};
use hapterra_core::force::SurfaceParams;
use hapterra_core::rate::TickRate;
use hapterra_core::scene::TickRecord;
use hapterra_core::terrain::{FieldSize, TileArena};
use hapterra_tests::invariants::surface::distance;
use hapterra_tests::random::Random;
use hapterra_tests::real_ground::{self, terrain};
use hapterra_tests::whole_field::{point, position};
use heightfield::Raster;

fn params(friction: Friction) -> SurfaceParams {
    SurfaceParams {
        friction,
        ..SurfaceParams::PREMIUM
    }
}

/// Distance from which a proxy counts as caught, mm.
const CAUGHT_MM: f64 = 20.0;

/// Returns the samples of a HIP that slides on an ellipse around the middle of a terrain, `depth`
/// mm deep, at `speed` mm a tick. A hand caught at the edge of no-data lifts for a tick.
fn slide(terrain: &Terrain<'_>, params: SurfaceParams, depth: f64, speed: f64) -> Vec<TickRecord> {
    let mut replayer = on_native(terrain, params).expect("opened");
    let size = terrain.size_mm();
    let radius = size[0].min(size[1]) / 3.0;
    let mut rendered = vec![];
    for tick in 0..3_000 {
        let angle = f64::from(tick) * speed / radius;
        let at = [
            size[0] / 2.0 + radius * angle.cos(),
            size[1] / 2.0 + 0.8 * radius * angle.sin(),
        ];
        let Some(ground) = terrain.height_mm(at[0], at[1]) else {
            continue; // over no-data
        };
        let behind = |last: &TickRecord| distance(position(&last.proxy), position(&last.hip));
        let is_caught = rendered.last().is_none_or(|last| behind(last) > CAUGHT_MM);
        let above = if is_caught { 1.0 } else { -depth };
        let hip = terrain.scale().to_grid([at[0], at[1], ground + above]);
        rendered.push(replayer.step(hip.expect("addressable")).expect("rendered"));
    }
    rendered
}

/// Returns tangential over normal force at a point of the surface, from the slopes of the terrain
/// there; `None` near a grid line, where several slopes meet.
fn ratio(terrain: &Terrain<'_>, sample: &TickRecord) -> Option<f64> {
    let [x, y, _] = position(&sample.proxy);
    let is_inside = |c: f64| (0.002..0.998).contains(&(c - c.floor()));
    if !(is_inside(x) && is_inside(y)) {
        return None;
    }
    let step = 1e-3;
    let height = |x: f64, y: f64| terrain.height_mm(x, y).expect("inside");
    let east = (height(x + step, y) - height(x - step, y)) / (2.0 * step);
    let north = (height(x, y + step) - height(x, y - step)) / (2.0 * step);
    let norm = (1.0 + east * east + north * north).sqrt();
    let normal = [-east / norm, -north / norm, 1.0 / norm];
    let force = sample.force_n.as_dvec3().to_array();
    let pressed: f64 = (0..3).map(|i| force[i] * normal[i]).sum();
    let along = [0, 1, 2].map(|i| force[i] - pressed * normal[i]);
    Some(distance(along, [0.0; 3]) / pressed)
}

/// Returns true if, from a point on a proxy's path, the straight line to a HIP leads through air or
/// over no-data: there the proxy leaves the surface, makes contact elsewhere, and may be
/// held there.
fn leaves_surface(terrain: &Terrain<'_>, path: [[f64; 3]; 2], hip: [f64; 3]) -> bool {
    let [from, to] = path;
    let between = |from: [f64; 3], to: [f64; 3]| {
        (1..=64).map(move |part| {
            let t = f64::from(part) / 64.0;
            [0, 1, 2].map(|i| from[i] + t * (to[i] - from[i]))
        })
    };
    let is_in_air = |at: [f64; 3]| {
        let ground = terrain.height_mm(at[0], at[1]);
        ground.is_none_or(|ground| at[2] > ground + 1e-6)
    };
    std::iter::once(from).chain(between(from, to)).any(|at| {
        let ground = terrain.height_mm(at[0], at[1]);
        ground.is_none_or(|ground| between([at[0], at[1], ground], hip).any(is_in_air))
    })
}

/// Returns the force ratios of all slides around a terrain at `speed` mm a tick. A ratio off by
/// more than `off` of μ is left out if the proxy flew.
fn ratios(terrain: &Terrain<'_>, mu: f64, depth: f64, speed: f64, off: f64) -> Vec<f64> {
    let rendered = slide(terrain, params(Friction::coulomb(mu as f32)), depth, speed);
    // A proxy after a contact onset has not slid yet, and one that a wall has stopped, far behind
    // the HIP, moves over many cells at once.
    let trails = 2.0 * depth * (1.0 + mu * mu).sqrt() + 3.0 * speed;
    let slides = rendered.windows(2).filter(|pair| {
        let touches = |sample: &TickRecord| sample.state == ContactState::Touching;
        let behind = distance(position(&pair[0].proxy), position(&pair[0].hip));
        let moves = pair[0].proxy != pair[1].proxy;
        touches(&pair[0]) && touches(&pair[1]) && moves && behind < trails
    });
    let ratios = slides.filter_map(|pair| {
        let ratio = ratio(terrain, &pair[1])?;
        let path = [&pair[0], &pair[1]].map(|sample| position(&sample.proxy));
        let left_surface = || leaves_surface(terrain, path, position(&pair[1].hip));
        let counts = (ratio / mu - 1.0).abs() <= off || !left_surface();
        counts.then_some(ratio)
    });
    ratios.collect()
}

/// Coefficient, depth in mm, and the least number of slides on a terrain at one speed.
const ON_REAL_GROUND: [(f64, f64, usize); 4] = [
    (0.2, 0.1, 350),
    (0.4, 0.3, 700),
    (0.8, 1.0, 700),
    (0.8, 0.3, 700),
];
/// Same on almost sticky ground, where a proxy also often rests on grid lines.
const ON_STICKY_GROUND: [(f64, f64, usize); 2] = [(1.25, 0.3, 350), (2.0, 1.0, 200)];

#[test]
fn sliding_friction_on_real_terrain_is_within_three_percent() {
    let cases = ON_REAL_GROUND.map(|case| (case, 0.02));
    let sticky = ON_STICKY_GROUND.map(|case| (case, 0.03));
    let files = real_ground::files();
    let mut slides = [0; 2];
    for ((mu, depth, fewest), off_at_most) in cases.into_iter().chain(sticky) {
        let mut all = vec![];
        for (_, raster) in &files {
            let terrain = terrain(raster);
            for speed in [0.01, 0.1, 0.5, 1.0] {
                let ratios = ratios(&terrain, mu, depth, speed, off_at_most);
                assert!(ratios.len() > fewest, "{} slides", ratios.len());
                all.extend(ratios);
            }
        }
        let off = |ratio: &&f64| (**ratio / mu - 1.0).abs() > off_at_most;
        let least = all.iter().copied().fold(f64::MAX, f64::min) / mu;
        let most = all.iter().copied().fold(0.0, f64::max) / mu;
        let (wrong, all) = (all.iter().filter(off).count(), all.len());
        println!("{mu}, {depth} mm deep: {wrong} of {all} slides off, {least:.4} to {most:.4}");
        assert_eq!(wrong, 0, "of {all} at {mu}");
        slides[usize::from(mu > 1.0)] += all;
    }
    if !files.is_empty() {
        assert!(slides[0] >= 119_000 && slides[1] >= 39_000, "{slides:?}");
    }
}

#[test]
fn stuck_proxy_is_unmoved_by_an_hour_of_encoder_noise() {
    let raster =
        Raster::from_fn(64, 64, |x, y| ((x * 7 + y * 3) % 11) as f32 * 0.03).expect("made");
    let terrain = terrain(&raster);
    let params = params(Friction::coulomb(0.8));
    let mut random = Random::new(5);
    // Inside a patch, on an edge, on a vertex.
    for at in [[20.3, 30.6], [25.0, 30.4], [41.0, 17.0]] {
        let mut replayer = on_native(&terrain, params).expect("opened");
        let ground = terrain.height_mm(at[0], at[1]).expect("inside");
        let mut step = |off: [f64; 3]| {
            let hip = [at[0] + off[0], at[1] + off[1], ground + off[2]];
            let hip = terrain.scale().to_grid(hip).expect("addressable");
            replayer.step(hip).expect("rendered")
        };
        let _ = step([0.0, 0.0, 0.5]);
        let stuck = step([0.0, 0.0, -1.0]).proxy;
        for tick in 0..3_600_000 {
            let mut count = || 0.03 * (random.below(3) as f64 - 1.0);
            let now = step([count(), count(), -1.0 + count()]).proxy;
            assert_eq!(now, stuck, "tick {tick} at {at:?}");
        }
    }
}

/// Cell sizes in the hand, mm.
const CELLS_MM: [f64; 3] = [0.1, 0.3, 1.0];

/// Returns the ticks in contact, and those that did not converge, of a hand at 30 mm/s, 0.1 to 1 mm
/// deep, over a square of 256 cells.
fn live(
    height: &dyn Fn(f64, f64) -> Option<f64>,
    cell_mm: f64,
    friction: Friction,
    hz: u32,
) -> [u32; 2] {
    let mut field = Box::new(TileArena::<8>::new());
    let posts = (0..257).flat_map(|y| (0..257).map(move |x| [x, y]));
    let heights: Vec<f32> = posts
        .map(|[x, y]| height(f64::from(x), f64::from(y)).map_or(f32::NAN, |h| h as f32))
        .collect();
    field
        .fill(FieldSize::new(256, 256), heights.iter().copied())
        .expect("fits");
    let ground = |at: [f64; 2]| {
        let [x, y] = at.map(|c| c.floor());
        let [u, v] = [at[0] - x, at[1] - y];
        let post = |i: f64, j: f64| f64::from(heights[((y + j) * 257.0 + x + i) as usize]);
        let row = |j: f64| post(0.0, j) * (1.0 - u) + post(1.0, j) * u;
        Some(row(0.0) * (1.0 - v) + row(1.0) * v).filter(|h| h.is_finite())
    };
    let window = field.window();
    let rate = TickRate::new(hz).expect("in range");
    let settings = ContactSettings::AT_1_KHZ
        .at_rate(rate)
        .on_cells_of(cell_mm as f32);
    let mut contact = Contact::new(settings.with_friction(friction));
    let radius = (20.0 / cell_mm).min(90.0);
    let mut counted = [0; 2];
    for tick in 0..10 * hz {
        let turn = f64::from(tick) * 30.0 / f64::from(hz) / cell_mm / radius;
        let at = [
            128.0 + radius * turn.sin(),
            128.0 + 0.8 * radius * (1.3 * turn).cos(),
        ];
        let Some(ground) = ground(at) else { continue };
        let deep = 0.4 + 0.6 * (f64::from(tick) * 3.0 / f64::from(hz)).sin();
        let above = if tick < 2 { 1.0 } else { -deep / cell_mm };
        let rendered = contact.step(&window, &point([at[0], at[1], ground + above]));
        if rendered.state == ContactState::Touching {
            counted[0] += 1;
            counted[1] += u32::from(!rendered.converged);
        }
    }
    counted
}

#[test]
fn tick_in_real_time_ends_inside_the_friction_cone() {
    let files = real_ground::more_files();
    if files.is_empty() {
        println!("skipped: no elevation models beside the checkout");
    }
    let viscous = Friction {
        viscous_s: 0.005,
        ..Friction::coulomb(0.4)
    };
    for (name, raster) in &files {
        let terrain = terrain(raster);
        let size = terrain.size_mm();
        let corner = [size[0] / 2.0 - 128.0, size[1] / 2.0 - 128.0].map(f64::floor);
        let height = |x: f64, y: f64| terrain.height_mm(corner[0] + x, corner[1] + y);
        all_end(name, &height, [Friction::coulomb(0.4), viscous]);
    }
    let hills = |x: f64, y: f64| {
        Some(1.5 * ((0.2 * x).sin() + (0.3 * y).cos()) + 0.1 * ((x * 7.0 + y * 13.0) % 3.0))
    };
    all_end("made ground", &hills, [Friction::coulomb(0.4), viscous]);
}

/// Checks that at 1 kHz all ticks but two in 1,000 converge, at 10 kHz all but eight. The others
/// release a proxy from a concave edge: it moves over tens of cells in several ticks.
fn all_end(name: &str, height: &dyn Fn(f64, f64) -> Option<f64>, frictions: [Friction; 2]) {
    for friction in frictions {
        for cell_mm in CELLS_MM {
            for (hz, per_thousand) in [(1_000, 2), (10_000, 8)] {
                let [all, late] = live(height, cell_mm, friction, hz);
                println!("{name}, {cell_mm} mm a cell, {hz} Hz: {late} of {all}, {friction:?}");
                assert!(all > hz, "{all}");
                assert!(late * 1_000 <= per_thousand * all, "{late} of {all}");
            }
        }
    }
}
