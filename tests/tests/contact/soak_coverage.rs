//! Counts the content of the quick stress test's scenes: each promised kind of ground, habit of the
//! HIP and metamorphic test occurs, is rendered, and is checked.

use std::collections::BTreeMap;

use hapterra_core::contact::ContactState;
use hapterra_core::force::{Material, MaterialTable};
use hapterra_tests::invariants::observed_tick::ObservedTick;
use hapterra_tests::invariants::oracle::TickOracle;
use hapterra_tests::invariants::surface::distance;
use hapterra_tests::scene::materials::LAYOUTS;
use hapterra_tests::scene::run::{Scene, Surface};
use hapterra_tests::scene::terrain::{KINDS, Terrain};
use hapterra_tests::scene::tile_supply::{Buffers, Supply};

/// Same as in `quick_soak.rs`.
const SEED: u64 = 2026;
const SCENES: u64 = 200;

type Counts = BTreeMap<&'static str, u64>;

/// Returns all names that fit a tick.
fn names(
    terrain: &Terrain,
    before: Option<&ObservedTick>,
    now: &ObservedTick,
) -> Vec<&'static str> {
    let mut names = Vec::new();
    let mut is = |name, true_of: bool| {
        if true_of {
            names.push(name);
        }
    };
    let whole = |c: f64| c == c.round();
    let [x, y, z] = now.hip;
    let inside = (0..2).all(|i| (0.0..=f64::from(terrain.size[i])).contains(&now.hip[i]));
    let rests = now.output.state == ContactState::Touching && now.output.converged;
    let on = |p: [f64; 3]| usize::from(whole(p[0])) + usize::from(whole(p[1]));
    is("HIP on a grid line", inside && on(now.hip) == 1);
    is("HIP over a vertex", inside && on(now.hip) == 2);
    is("HIP off the field", !inside);
    is(
        "HIP in all three coordinates on the grid",
        on(now.hip) == 2 && whole(z),
    );
    is("proxy rests on an edge", rests && on(now.proxy) == 1);
    is("proxy rests in a vertex", rests && on(now.proxy) == 2);
    let exactly = inside && on(now.hip) >= 1 && z == terrain.height_about(x, y);
    is("HIP exactly on an edge of the surface", exactly);
    let far = distance(now.hip, now.proxy);
    is("HIP 100 cells inside or more", rests && far >= 100.0);
    is("tile missing", now.output.missing_tile.is_some());
    is(
        "work left over",
        !now.output.converged && now.output.missing_tile.is_none(),
    );
    if let Some(before) = before {
        let way = distance(before.hip, now.hip);
        let [dx, dy, dz] = [0, 1, 2].map(|i| (now.hip[i] - before.hip[i]).abs());
        let most = dx.max(dy).max(dz);
        is("unmoved", way == 0.0);
        is("a leap of 10 to 1,000 cells", (10.0..1e3).contains(&way));
        is("a step below 0.01 cell", way > 0.0 && way < 0.01);
        // One encoder count, or two in opposite directions, in each axis.
        let count = |d: f64| [0.0, 0.03, 0.06].iter().any(|c| (d - c).abs() < 1e-6);
        let trembles = most > 0.029 && [dx, dy, dz].into_iter().all(count);
        is("trembling by an encoder count", trembles);
        let deep = terrain.height_about(now.hip[0], now.hip[1]) - now.hip[2];
        is(
            "moving 20 to 100 cells deep",
            most > 0.0 && way < 5.0 && (20.0..100.0).contains(&deep),
        );
        is("the least step there is", most > 0.0 && most < 2e-6);
    }
    names
}

/// Counts the samples of a touched ground.
fn samples(terrain: &Terrain, counts: &mut Counts) {
    let all = (0..=terrain.size[1])
        .flat_map(|y| (0..=terrain.size[0]).map(move |x| (x, y)))
        .map(|(x, y)| terrain.post(x, y));
    for h in all {
        let name = match h {
            h if h.is_nan() => "sample not a number",
            h if h.is_infinite() => "sample infinite",
            h if h.abs() >= 5e8 => "sample out of range",
            h if h.abs() >= 9e3 => "sample a spike of 10⁴",
            h if h.is_subnormal() => "sample denormal",
            _ => "sample usual",
        };
        *counts.entry(name).or_default() += 1;
    }
}

#[test]
fn every_promised_kind_of_scene_is_touched_and_checked() {
    let mut buffers = Buffers::default();
    let (mut counts, mut settings) = (Counts::new(), Counts::new());
    let mut touched = vec![0_u64; KINDS.len()];
    for number in 0..SCENES {
        let scene = Scene::random(SEED, number);
        let mut judge = TickOracle::new(&scene.terrain);
        let Ok(seen) = scene.render(&mut buffers, [0; 3], scene.supply, |_| Ok(())) else {
            panic!("scene {number} does not settle");
        };
        for (i, now) in seen.iter().enumerate() {
            let _ = judge.violations(now);
            let before = i.checked_sub(1).map(|last| &seen[last]);
            for name in names(&scene.terrain, before, now) {
                *counts.entry(name).or_default() += 1;
            }
        }
        let kind = KINDS.iter().position(|kind| *kind == scene.terrain.kind);
        touched[kind.expect("known")] += judge.measured.states[ContactState::Touching as usize];
        samples(&scene.terrain, &mut counts);
        let supply = match scene.supply {
            Supply::Preloaded => "every tile held",
            Supply::OnDemand { latency: 0 } => "tiles at once",
            Supply::OnDemand { .. } => "tiles late",
        };
        *settings.entry(supply).or_default() += 1;
    }
    println!("{counts:#?}\n{settings:#?}");
    for (kind, ticks) in KINDS.iter().zip(&touched) {
        println!("{kind:?}: {ticks} ticks of touching");
        assert!(*ticks > 400, "{kind:?}: {ticks}");
    }
    let promised = [
        ("HIP on a grid line", 500),
        ("HIP over a vertex", 500),
        ("HIP in all three coordinates on the grid", 50),
        ("HIP exactly on an edge of the surface", 100),
        ("HIP off the field", 500),
        ("HIP 100 cells inside or more", 20),
        ("proxy rests on an edge", 500),
        ("proxy rests in a vertex", 500),
        ("tile missing", 100),
        ("work left over", 100),
        ("unmoved", 500),
        ("a leap of 10 to 1,000 cells", 500),
        ("a step below 0.01 cell", 500),
        ("trembling by an encoder count", 500),
        ("moving 20 to 100 cells deep", 500),
        ("the least step there is", 200),
        ("sample not a number", 500),
        ("sample infinite", 500),
        ("sample out of range", 500),
        ("sample a spike of 10⁴", 500),
        ("sample denormal", 500),
    ];
    for (name, least) in promised {
        let count = counts.get(name).copied().unwrap_or(0);
        assert!(count >= least, "{name}: {count}");
    }
    assert_eq!(settings.len(), 3, "{settings:?}");
}

/// Materials of a stress test's scenes, by all the names that fit.
#[test]
fn random_scenes_cover_every_promised_kind_of_material() {
    let mut counts = Counts::new();
    let scenes = (0..800).map(|number| Scene::random(SEED, number).with_surface(Surface::Rough));
    for materials in scenes.filter_map(|scene| scene.materials) {
        let mut is = |name, true_of: bool| *counts.entry(name).or_default() += u64::from(true_of);
        is("a scene with materials", true);
        for (layout, name) in LAYOUTS.into_iter().zip([
            "all of one",
            "halves",
            "checker of samples",
            "stripes",
            "each sample by itself",
            "blobs",
        ]) {
            is(name, materials.layout == layout);
        }
        let table = &materials.table;
        let any = |of: fn(&Material) -> bool| table.iter().any(of);
        is("one material alone", table.len() == 1);
        is(
            "as many materials as there may be",
            table.len() == MaterialTable::MAX,
        );
        is("some like ice, some with friction", {
            any(|m| m.friction.is_none()) && any(|m| !m.friction.is_none())
        });
        is("even ones and textured ones", {
            any(|m| m.texture.is_none()) && any(|m| !m.texture.is_none())
        });
        is("damped ones", any(|m| m.damping_ns_per_m > 0.0));
        is(
            "one without stiffness",
            any(|m| m.stiffness_n_per_mm == 0.0),
        );
        let stiffest = table.iter().map(|m| m.stiffness_n_per_mm);
        let most = stiffest.clone().fold(0.0, f32::max);
        let least = stiffest.fold(f32::MAX, f32::min);
        is(
            "one a hundred times as stiff as another",
            most > 100.0 * least,
        );
        let own = materials.params.stiffness_n_per_mm;
        is(
            "a scene softer or stiffer than its default",
            own != table[0].stiffness_n_per_mm,
        );
        is("cells of other than a millimetre", materials.cell_mm != 1.0);
    }
    println!("{counts:#?}");
    assert!(
        (150..250).contains(&counts["a scene with materials"]),
        "one in four"
    );
    assert!(counts.values().all(|count| *count >= 5), "{counts:?}");
}
