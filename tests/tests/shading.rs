//! Force shading on real ground: how evenly the force turns, and what it costs in energy.

use hapterra::replay::on_native;
use hapterra::terrain::Terrain;
use hapterra_core::Vec3;
use hapterra_core::contact::ContactState;
use hapterra_core::force::{ForceLaw, Shading};
use hapterra_core::scene::Sample;
use hapterra_tests::field::position;
use hapterra_tests::real_ground;

/// From one HIP to the next, cells.
const STEP: f64 = 0.01;
/// HIPs of a way.
const STEPS: u32 = 30_000;

/// What a HIP feels on a circle around the middle of a terrain, `depth` mm deep: true to
/// scale, a cell a millimetre.
fn circle(terrain: &Terrain<'_>, shading: Shading, depth: f64) -> Vec<Sample> {
    let law = ForceLaw {
        shading,
        ..ForceLaw::PREMIUM
    };
    let mut replayer = on_native(terrain, law).expect("opened");
    let size = terrain.size_mm();
    let radius = STEP * f64::from(STEPS) / std::f64::consts::TAU;
    let felt = (0..=STEPS).filter_map(|tick| {
        let angle = f64::from(tick) * STEP / radius;
        let at = [
            size[0] / 2.0 + radius * angle.cos(),
            size[1] / 2.0 + radius * angle.sin(),
        ];
        // Nothing over a hole.
        let ground = terrain.height_mm(at[0], at[1])?;
        let above = if tick == 0 { 1.0 } else { -depth };
        let hip = terrain.scale().to_grid([at[0], at[1], ground + above]);
        let sample = replayer.feel(hip.expect("addressable")).expect("felt");
        (sample.state == ContactState::Touching).then_some(sample)
    });
    felt.collect()
}

fn degrees(a: Vec3, b: Vec3) -> f32 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

/// Largest change of the force's direction from one HIP to the next, degrees, where the proxy
/// goes no farther than so many cells: over a ridge it goes as far as it is deep, at once.
fn largest_turn(felt: &[Sample], farthest: f32) -> f32 {
    let pairs = felt.windows(2);
    let near = pairs.filter(|pair| pair[0].proxy.to(&pair[1].proxy).length() <= farthest);
    let turns = near.map(|pair| degrees(pair[0].force_n, pair[1].force_n));
    turns.fold(0.0, f32::max)
}

/// What the force gives to a HIP on its way, mJ.
fn given_mj(felt: &[Sample]) -> f64 {
    let gives = felt.windows(2).map(|pair| {
        let force = 0.5 * (pair[0].force_n + pair[1].force_n).as_dvec3();
        let (from, to) = (position(&pair[0].hip), position(&pair[1].hip));
        force.dot([0, 1, 2].map(|i| to[i] - from[i]).into())
    });
    gives.sum()
}

#[test]
fn on_real_ground_the_force_turns_a_tenth_as_fast() {
    for (name, raster) in &real_ground::files() {
        let terrain = real_ground::terrain(raster);
        for depth in [0.02, 0.1, 0.3] {
            let plain = circle(&terrain, Shading::None, depth);
            let shaded = circle(&terrain, Shading::Smooth, depth);
            let sharp = largest_turn(&plain, f32::MAX);
            let [near, even] = [0.05, f32::MAX].map(|farthest| largest_turn(&shaded, farthest));
            let given = [&plain, &shaded].map(|felt| given_mj(felt));
            println!(
                "{name}, {depth} mm deep: {sharp:.1}° a step, shaded {even:.1}°, {near:.1}° where the proxy goes no farther than 0.05 cell; a round gives {:.4} mJ, shaded {:.4} mJ",
                given[0], given[1]
            );
            assert!(near <= 0.1 * sharp, "{near}° of {sharp}°");
            assert!(depth > 0.02 || even <= 0.1 * sharp, "{even}° of {sharp}°");
            assert!(given[1] < 0.02, "{} mJ", given[1]);
            assert_eq!(plain.len(), shaded.len());
            for (plain, shaded) in plain.iter().zip(&shaded) {
                assert_eq!(plain.proxy, shaded.proxy);
                let sizes = [plain, shaded].map(|sample| sample.force_n.length());
                assert!((sizes[0] - sizes[1]).abs() < 1e-5 * sizes[0], "{sizes:?}");
            }
        }
    }
}
