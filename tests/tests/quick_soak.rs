//! A fixed number of the soak's scenes; `cargo xtask soak MINUTES` for more.

use hapterra_tests::scene::run::Surface;
use hapterra_tests::scene::supply::Buffers;
use hapterra_tests::soak::{Broken, Found, Tally, Until, run, soak};

const SEED: u64 = 2026;

fn thousand(surface: Surface) -> Tally {
    let tally = soak(SEED, surface, 0, Until::Scenes(1000), 2, |_| {});
    println!("{tally}");
    let total = tally.total();
    let [waiting, free, touching, _] = total.states;
    assert!(waiting > 10_000 && free > 50_000 && touching > 50_000);
    // Repeated, shifted, in another window, mirrored or turned.
    let twins = total.twins;
    assert!(
        twins
            .iter()
            .zip([150, 100, 50, 50])
            .all(|(n, least)| *n >= least),
        "{twins:?}"
    );
    // In another window, shifted, mirrored or turned.
    let (judged, twins) = (total.on_materials, total.twins_on_materials);
    assert!(
        judged.in_whole > 20_000 && judged.changing > 10_000,
        "{judged:?}"
    );
    assert!(100 * judged.open < judged.in_whole, "{judged:?}");
    assert!(twins.iter().all(|n| *n >= 20), "{twins:?}");
    tally
}

fn none<'b>(surface: Surface, broken: impl Iterator<Item = &'b Broken>) {
    let rough = surface.option();
    let told: Vec<String> = broken
        .map(|b| {
            let (kind, what, number) = (b.kind, &b.what, b.number);
            format!("{kind:?}: {what}\n    again: cargo xtask soak --seed {SEED} --scene {number}{rough}")
        })
        .collect();
    assert!(
        told.is_empty(),
        "{} scenes\n{}",
        told.len(),
        told.join("\n")
    );
}

#[test]
fn everything_holds_in_a_thousand_random_scenes() {
    none(Surface::Smooth, thousand(Surface::Smooth).broken.iter());
}

#[test]
fn everything_holds_with_friction_too() {
    let tally = thousand(Surface::Rough);
    let judged = tally.total().on_materials;
    assert!(
        judged.rubbed > 20_000 && judged.sliding > 1_000,
        "{judged:?}"
    );
    none(Surface::Rough, tally.broken.iter());
}

/// A HIP at the foot of a needle of 10⁶: each hop off the needle's side came nearer by
/// 10⁻⁶ cell, which counted as progress.
#[test]
fn a_proxy_does_not_creep_down_a_needle_for_ever() {
    let found = run(20261201, 15872, Surface::Smooth, &mut Buffers::default());
    assert!(matches!(found, Found::Held(..)), "{found:?}");
}

/// Scenes with friction that were wrong, or judged wrong; what each was is told in
/// `docs/measurements.md`. In the first three a proxy came from the air to an edge, in one of two mirrored
/// scenes 10⁻⁸ cell beside it, and was pulled as if there were no edge. In (31, 777) and (9903, 21303) a
/// proxy was in a tile that was not here any more, in lock-step: the answer before was given again,
/// or what was felt faded. In the others the judge took for known what is not: how far a proxy slid
/// that had met the ground within the tick, a height between corners 3·10⁵ cells away, what a hair's
/// breadth does in the mirrored twin.
#[test]
fn friction_holds_in_scenes_where_it_was_wrong() {
    let scenes = [
        (21, 990),
        (102, 4146),
        (270, 1049),
        (270, 4661),
        (270, 10551),
        (31, 777),
        (9501, 278),
        (9701, 23297),
        (9701, 33006),
        (9701, 53439),
        (9701, 55054),
        (9801, 1963),
        (9801, 3594),
        (9801, 16855),
        (9901, 4609),
        (9902, 41943),
        (9903, 21303),
        (9905, 13335),
    ];
    for (seed, number) in scenes {
        let found = run(seed, number, Surface::Rough, &mut Buffers::default());
        let Found::Held(..) = found else {
            panic!("seed {seed}, scene {number}: {found:?}");
        };
    }
}
