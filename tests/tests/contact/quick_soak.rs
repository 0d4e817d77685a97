//! A fixed number of scenes of the stress test; `cargo xtask soak MINUTES` runs more.

use hapterra_tests::scene::run::Surface;
use hapterra_tests::soak::{FailedScene, LinkStats, Until, soak};

const SEED: u64 = 2027;

fn thousand(surface: Surface) -> LinkStats {
    let stats = soak(SEED, surface, 0, Until::Scenes(1000), 2, |_| {});
    println!("{stats}");
    let total = stats.total();
    let [waiting, free, touching, _] = total.states;
    assert!(waiting > 10_000 && free > 50_000 && touching > 50_000);
    // Repeated, shifted, in another window, mirrored or turned.
    let metamorphic = total.metamorphic;
    assert!(
        metamorphic
            .iter()
            .zip([150, 100, 50, 50])
            .all(|(n, minimum)| *n >= minimum),
        "{metamorphic:?}"
    );
    // In another window, shifted, mirrored or turned.
    let (counts, metamorphic) = (total.on_materials, total.metamorphic_on_materials);
    assert!(
        counts.compared_as_vectors > 20_000 && counts.changing > 10_000,
        "{counts:?}"
    );
    assert!(100 * counts.open < counts.compared_as_vectors, "{counts:?}");
    assert!(metamorphic.iter().all(|n| *n >= 20), "{metamorphic:?}");
    stats
}

fn assert_no_violations<'b>(surface: Surface, broken: impl Iterator<Item = &'b FailedScene>) {
    let rough = surface.option();
    let reported: Vec<String> = broken
        .map(|b| {
            let (kind, what, number) = (b.kind, &b.what, b.number);
            format!("{kind:?}: {what}\n    again: cargo xtask soak --seed {SEED} --scene {number}{rough}")
        })
        .collect();
    assert!(
        reported.is_empty(),
        "{} scenes\n{}",
        reported.len(),
        reported.join("\n")
    );
}

#[test]
fn invariants_hold_in_a_thousand_random_scenes() {
    assert_no_violations(Surface::Smooth, thousand(Surface::Smooth).failed.iter());
}

#[test]
fn invariants_hold_with_friction() {
    let stats = thousand(Surface::Rough);
    let counts = stats.total().on_materials;
    assert!(
        counts.with_friction > 20_000 && counts.sliding > 1_000,
        "{counts:?}"
    );
    assert_no_violations(Surface::Rough, stats.failed.iter());
}
