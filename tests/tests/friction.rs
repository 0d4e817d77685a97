//! Friction as a user meets it: real ground, an arm's encoders, the command.

use hapterra::raster::Raster;
use hapterra::replay::on_native;
use hapterra::terrain::Terrain;
use hapterra_core::contact::{ContactState, Friction, Rule};
use hapterra_core::force::ForceLaw;
use hapterra_core::scene::Sample;
use hapterra_tests::chance::Chance;
use hapterra_tests::field::position;
use hapterra_tests::invariants::surface::distance;
use hapterra_tests::real_ground::{self, terrain};

fn law(friction: Friction) -> ForceLaw {
    ForceLaw {
        friction,
        ..ForceLaw::PREMIUM
    }
}

/// What a HIP feels that slides around the middle of a terrain on an ellipse, `depth` mm
/// deep, so many millimetres a tick.
fn slide(terrain: &Terrain<'_>, law: ForceLaw, depth: f64, speed: f64) -> Vec<Sample> {
    let mut replayer = on_native(terrain, law, Rule::Swept).expect("opened");
    let size = terrain.size_mm();
    let radius = size[0].min(size[1]) / 3.0;
    let mut felt = vec![];
    for tick in 0..3_000 {
        let angle = f64::from(tick) * speed / radius;
        let at = [
            size[0] / 2.0 + radius * angle.cos(),
            size[1] / 2.0 + 0.8 * radius * angle.sin(),
        ];
        let Some(ground) = terrain.height_mm(at[0], at[1]) else {
            continue; // over a hole
        };
        let above = if tick == 0 { 1.0 } else { -depth };
        let hip = terrain.scale().to_grid([at[0], at[1], ground + above]);
        felt.push(replayer.feel(hip.expect("addressable")).expect("felt"));
    }
    felt
}

/// Tangential over normal force at a place of the surface, by the slopes of the terrain
/// there; none beside a line of the grid, where there are several.
fn ratio(terrain: &Terrain<'_>, sample: &Sample) -> Option<f64> {
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

/// The ratios of the forces of all slides around a terrain, so many millimetres a tick.
fn ratios(terrain: &Terrain<'_>, mu: f64, depth: f64, speed: f64) -> Vec<f64> {
    let felt = slide(terrain, law(Friction::coulomb(mu as f32)), depth, speed);
    // The proxy that has just come out of the air has not slid yet, and one that a wall has held, far
    // behind the HIP, comes over many cells at once.
    let trails = 2.0 * depth * (1.0 + mu * mu).sqrt() + 3.0 * speed;
    let slides = felt.windows(2).filter(|pair| {
        let touches = |sample: &Sample| sample.state == ContactState::Touching;
        let behind = distance(position(&pair[0].proxy), position(&pair[0].hip));
        let moves = pair[0].proxy != pair[1].proxy;
        touches(&pair[0]) && touches(&pair[1]) && moves && behind < trails
    });
    slides.filter_map(|pair| ratio(terrain, &pair[1])).collect()
}

/// Coefficients, how deep, mm, and how many slides there are at least on a terrain at a speed.
const ON_REAL_GROUND: [(f64, f64, usize); 4] = [
    (0.2, 0.1, 350),
    (0.4, 0.3, 700),
    (0.8, 1.0, 700),
    (0.8, 0.3, 700),
];
/// The same of ground that is as good as sticky: there the force may go to and fro at a crease, and
/// a few slides that go over many of them at once are not done.
const ON_STICKY_GROUND: [(f64, f64, usize); 2] = [(1.25, 0.3, 350), (2.0, 1.0, 200)];

#[test]
fn on_real_ground_it_slides_within_five_parts_in_a_hundred() {
    let cases = ON_REAL_GROUND.map(|case| (case, 0.0));
    let sticky = ON_STICKY_GROUND.map(|case| (case, 1e-3));
    for ((mu, depth, fewest), off_at_most) in cases.into_iter().chain(sticky) {
        let mut all = vec![];
        for (_, raster) in &real_ground::files() {
            let terrain = terrain(raster);
            for speed in [0.01, 0.1, 0.5, 1.0] {
                let ratios = ratios(&terrain, mu, depth, speed);
                assert!(ratios.len() > fewest, "{} slides", ratios.len());
                all.extend(ratios);
            }
        }
        let off = |ratio: &&f64| (**ratio / mu - 1.0).abs() > 0.05;
        let least = all.iter().copied().fold(f64::MAX, f64::min) / mu;
        let most = all.iter().copied().fold(0.0, f64::max) / mu;
        let (wrong, all) = (all.iter().filter(off).count(), all.len());
        println!("{mu}, {depth} mm deep: {wrong} of {all} slides off, {least:.4} to {most:.4}");
        assert!(most < 1.031, "{most}");
        assert!(
            wrong as f64 <= off_at_most * all as f64,
            "{wrong} of {all} at {mu}"
        );
    }
}

#[test]
fn an_hour_of_encoder_noise_moves_a_stuck_proxy_by_no_bit() {
    let raster =
        Raster::from_fn(64, 64, |x, y| ((x * 7 + y * 3) % 11) as f32 * 0.03).expect("made");
    let terrain = terrain(&raster);
    let law = law(Friction::coulomb(0.8));
    let mut chance = Chance::new(5);
    // Inside a patch, on an edge, on a vertex.
    for at in [[20.3, 30.6], [25.0, 30.4], [41.0, 17.0]] {
        let mut replayer = on_native(&terrain, law, Rule::Swept).expect("opened");
        let ground = terrain.height_mm(at[0], at[1]).expect("inside");
        let mut feel = |off: [f64; 3]| {
            let hip = [at[0] + off[0], at[1] + off[1], ground + off[2]];
            let hip = terrain.scale().to_grid(hip).expect("addressable");
            replayer.feel(hip).expect("felt")
        };
        let _ = feel([0.0, 0.0, 0.5]);
        let stuck = feel([0.0, 0.0, -1.0]).proxy;
        for tick in 0..3_600_000 {
            let mut count = || 0.03 * (chance.below(3) as f64 - 1.0);
            let now = feel([count(), count(), -1.0 + count()]).proxy;
            assert_eq!(now, stuck, "tick {tick} at {at:?}");
        }
    }
}
