//! Force shading on real ground: the rate at which the force turns, and its cost in energy.

use std::path::Path;

use hapterra::replay::on_native;
use hapterra::terrain::Terrain;
use hapterra_core::Vec3;
use hapterra_core::contact::ContactState;
use hapterra_core::force::{Shading, SurfaceParams};
use hapterra_core::scene::TickRecord;
use hapterra_tests::real_ground;
use hapterra_tests::whole_field::position;

/// Distance of two HIPs, cells.
const STEP: f64 = 0.01;
/// Length of a path, cells.
const ROUND: f64 = 300.0;
/// Distance of two HIPs in tests with many rounds, cells.
const LONG_STEP: f64 = 0.03;

/// Maximum excess of a documented energy over the measured one, as a share of itself: the page has
/// two or three digits.
const ROUNDED_UP: f64 = 0.02;

/// A closed path of [`ROUND`] over a terrain true to scale, with cells of a millimetre.
struct Circle<'c> {
    /// Its centre, as fractions of the terrain's sides.
    middle: [f64; 2],
    /// Distance of two HIPs, cells.
    step: f64,
    /// Depth of the HIP as a function of the angle, mm.
    depth: &'c dyn Fn(f64) -> f64,
}

impl Circle<'_> {
    /// Returns the samples in contact of one round of a HIP.
    fn rendered(&self, terrain: &Terrain<'_>, shading: Shading) -> Vec<TickRecord> {
        let params = SurfaceParams {
            shading,
            ..SurfaceParams::PREMIUM
        };
        let mut replayer = on_native(terrain, params).expect("opened");
        let size = terrain.size_mm();
        let radius = ROUND / std::f64::consts::TAU;
        let rendered = (0..=self.steps()).filter_map(|tick| {
            let angle = f64::from(tick) * self.step / radius;
            let at = [
                size[0] * self.middle[0] + radius * angle.cos(),
                size[1] * self.middle[1] + radius * angle.sin(),
            ];
            // Skipped over no-data.
            let ground = terrain.height_mm(at[0], at[1])?;
            let above = if tick == 0 { 1.0 } else { -(self.depth)(angle) };
            let hip = terrain.scale().to_grid([at[0], at[1], ground + above]);
            let sample = replayer.step(hip.expect("addressable")).expect("rendered");
            (sample.state == ContactState::Touching).then_some(sample)
        });
        rendered.collect()
    }

    fn steps(&self) -> u32 {
        (ROUND / self.step.abs()).round() as u32
    }

    /// Returns the energy of a shaded round, mJ; `None` if no-data interrupts it.
    fn energy_mj(&self, terrain: &Terrain<'_>) -> Option<f64> {
        let rendered = self.rendered(terrain, Shading::Smooth);
        let is_whole = rendered.len() + 2 >= self.steps() as usize;
        is_whole.then(|| gained_mj(&rendered))
    }
}

fn degrees(a: Vec3, b: Vec3) -> f32 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

/// Returns the largest change of the force's direction from one HIP to the next, degrees, if the
/// proxy moves by no more than `max_motion` cells: over a ridge it moves by its depth at once.
fn largest_turn(rendered: &[TickRecord], max_motion: f32) -> f32 {
    let pairs = rendered.windows(2);
    let near = pairs.filter(|pair| pair[0].proxy.to(&pair[1].proxy).length() <= max_motion);
    let turns = near.map(|pair| degrees(pair[0].force_n, pair[1].force_n));
    turns.fold(0.0, f32::max)
}

/// Returns the work of the force on a HIP along its path, mJ.
fn gained_mj(rendered: &[TickRecord]) -> f64 {
    let works = rendered.windows(2).map(|pair| {
        let force = 0.5 * (pair[0].force_n + pair[1].force_n).as_dvec3();
        let (from, to) = (position(&pair[0].hip), position(&pair[1].hip));
        force.dot([0, 1, 2].map(|i| to[i] - from[i]).into())
    });
    works.sum()
}

#[test]
fn shading_reduces_force_rotation_tenfold_on_real_terrain() {
    for (name, raster) in &real_ground::files() {
        let terrain = real_ground::terrain(raster);
        for depth in [0.02, 0.1, 0.3] {
            let circle = Circle {
                middle: [0.5; 2],
                step: STEP,
                depth: &|_| depth,
            };
            let [plain, shaded] =
                [Shading::None, Shading::Smooth].map(|shading| circle.rendered(&terrain, shading));
            let sharp = largest_turn(&plain, f32::MAX);
            let [near, even] = [0.05, f32::MAX].map(|max_motion| largest_turn(&shaded, max_motion));
            println!(
                "{name}, {depth} mm deep: {sharp:.1}° a step, shaded {even:.1}°, {near:.1}° where the proxy goes no farther than 0.05 cell"
            );
            assert!(near <= 0.1 * sharp, "{near}° of {sharp}°");
            assert!(depth > 0.02 || even <= 0.1 * sharp, "{even}° of {sharp}°");
            assert_eq!(plain.len(), shaded.len());
            for (plain, shaded) in plain.iter().zip(&shaded) {
                assert_eq!(plain.proxy, shaded.proxy);
                let sizes = [plain, shaded].map(|sample| sample.force_n.length());
                assert!((sizes[0] - sizes[1]).abs() < 1e-5 * sizes[0], "{sizes:?}");
            }
        }
    }
}

/// Runs rounds in both directions around five centres: a gain in one is a loss in the other.
fn energy_by_rounds(terrain: &Terrain<'_>, depth: &dyn Fn(f64) -> f64) -> Vec<f64> {
    let margins_mm = ROUND / std::f64::consts::TAU + 2.0;
    let has_room = |middle: &[f64; 2]| {
        let sides = terrain.size_mm().into_iter().zip(middle);
        let mut nearest = sides.map(|(side, share)| side * share.min(1.0 - share));
        nearest.all(|mm| mm > margins_mm)
    };
    let middles = [[0.5, 0.5], [0.3, 0.3], [0.7, 0.3], [0.3, 0.7], [0.7, 0.7]];
    let middles = middles.into_iter().filter(has_room);
    let rounds = middles.flat_map(|middle| [LONG_STEP, -LONG_STEP].map(|step| (middle, step)));
    let given = rounds.filter_map(|(middle, step)| {
        let circle = Circle {
            middle,
            step,
            depth,
        };
        circle.energy_mj(terrain)
    });
    given.collect()
}

/// Returns the documented max energies of a shaded round, mJ: at a constant depth of 0.3 mm, and at
/// depths from 0.5 to 1.5 mm.
fn documented_mj() -> [f64; 2] {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/explanation/effects.md");
    let text = std::fs::read_to_string(page).expect("a page");
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let between = |before: &str, after: &str| {
        let found = text
            .split_once(before)
            .and_then(|(_, rest)| rest.split_once(after));
        let found = found.unwrap_or_else(|| panic!("no energy between {before:?} and {after:?}"));
        found.0.parse().expect("a number")
    };
    [
        between("gained at most ", " mJ at 0.3 mm of depth"),
        between(
            "at 0.3 mm of depth, and ",
            " mJ at depths that vary from 0.5 to 1.5 mm",
        ),
    ]
}

#[test]
fn energy_of_a_shaded_round_is_as_documented() {
    let even = |_: f64| 0.3;
    let deep = |angle: f64| 1.0 + 0.5 * angle.sin();
    let (mut most, mut rounds) = ([0.0_f64; 2], 0);
    let files = real_ground::all_files();
    for (name, raster) in &files {
        let terrain = real_ground::terrain(raster);
        let given = [&even as &dyn Fn(f64) -> f64, &deep].map(|it| energy_by_rounds(&terrain, it));
        let largest = given
            .each_ref()
            .map(|given| given.iter().copied().fold(0.0, f64::max));
        let count = given[0].len() + given[1].len();
        println!(
            "{name}: {count} rounds give up to {:.4} mJ at 0.3 mm, {:.4} mJ at 1 ± 0.5 mm",
            largest[0], largest[1]
        );
        rounds += count;
        most = [0, 1].map(|i| most[i].max(largest[i]));
    }
    println!("{rounds} rounds: up to {most:.4?} mJ");
    if files.is_empty() {
        return;
    }
    for (found, page) in most.into_iter().zip(documented_mj()) {
        assert!(
            found <= page && found >= (1.0 - ROUNDED_UP) * page,
            "docs/explanation/effects.md has {page} mJ, found {found:.4} mJ"
        );
    }
}
