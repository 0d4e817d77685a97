//! The convex patch's closest point against the search by rulings, which shares no code with it.

use super::super::ruling_search::Rulings;
use super::*;
use crate::cases::cases;
use crate::contact::test_random::Random;

/// The closest point by the convex patch.
fn convex(heights: [f32; 4], hip: (f32, f32), from: (f32, f32)) -> Option<(f32, f32)> {
    let patch = Patch::new(heights);
    let place = Convexity::of(&patch)?.closest(&patch, hip, from)?;
    let off = (place.z - patch.height(place.u, place.v)).abs();
    assert!(off < 1e-6, "{off:e}: {place:?}");
    Some((place.u, place.v))
}

/// The closest point by the search by rulings: over v, or over u if that ends at a border.
fn by_rulings(patch: &Patch, hip: (f32, f32), (u, v): (f32, f32)) -> (f32, f32) {
    let search = |patch: &Patch, hip, start| {
        let (evaluated, max_evaluations) = (0, u32::MAX);
        Rulings {
            patch,
            hip,
            evaluated,
            max_evaluations,
        }
        .closest_to(start)
    };
    let found = search(patch, hip, v);
    if !found.at_end {
        return (found.u, found.v);
    }
    let transposed = search(&patch.transposed(), (hip.1, hip.0), u);
    (transposed.v, transposed.u)
}

const CASES: u32 = cases(20_000, 200);

/// Compares both solvers on patches up to a slope, for HIPs within a tenth of a cell of the last
/// answer. Returns how many queries fell back to rulings and how many did not.
fn agree(slope: f64, depths: [f64; 2], bound: f32) -> [u32; 2] {
    let mut random = Random(41);
    let mut counts = [0; 2];
    for _ in 0..CASES {
        let depth = random.between(depths[0], depths[1]);
        let heights = core::array::from_fn(|_| (depth + random.between(0.0, slope)) as f32);
        let patch = Patch::new(heights);
        let place = |random: &mut Random| random.between(0.0, 1.0) as f32;
        let first = (place(&mut random), place(&mut random));
        let start = by_rulings(&patch, first, first);
        let moved = |x: f32, random: &mut Random| x + random.between(-0.05, 0.05) as f32;
        let hip = (moved(first.0, &mut random), moved(first.1, &mut random));
        let found = convex(heights, hip, start);
        counts[usize::from(found.is_some())] += 1;
        let Some((u, v)) = found else { continue };
        let other = by_rulings(&patch, hip, start);
        let off = (u - other.0).abs().max((v - other.1).abs());
        assert!(off <= bound, "{patch:?} {hip:?} ({u}, {v}) {other:?}");
    }
    counts
}

#[test]
fn convex_solver_agrees_with_the_ruling_search() {
    for depths in [[0.01, 0.2], [0.2, 1.0]] {
        let [_, gentle] = agree(0.3, depths, 1e-6);
        let [left, steep] = agree(2.0, depths, 2e-6);
        std::println!("{gentle} {steep} {left}");
        assert!(
            gentle > CASES * 4 / 5 && steep > CASES / 40 && left > CASES / 20,
            "{gentle} {steep} {left}"
        );
    }
}

#[test]
fn flat_patch_returns_the_projection_of_the_hip() {
    let (u, v) = convex([0.1, 0.2, 0.1, 0.2], (0.5, 0.25), (0.4, 0.4)).unwrap();
    let drop = 0.15 / 1.01 * 0.1;
    assert!((u - (0.5 - drop)).abs() < 1e-7 && v == 0.25, "{u} {v}");
}

#[test]
fn convex_solver_declines_steep_or_saddle_patches() {
    let inside = (0.5, 0.5);
    assert!(convex([0.1; 4], (0.51, 0.5), inside).is_some());
    assert_eq!(
        convex([-0.1; 4], (0.51, 0.5), inside),
        None,
        "above the surface"
    );
    assert_eq!(convex([0.0, 9.0, 0.0, 9.0], inside, inside), None, "steep");
    assert_eq!(convex([f32::NAN; 4], inside, inside), None, "nothing");
    // Twisted and so far above the HIP that the middle is a saddle.
    let saddle = [1.5, 2.5, 2.5, 1.5];
    assert_eq!(convex(saddle, inside, inside), None, "a saddle");
    assert!(
        convex([1e8; 4], inside, inside).is_some(),
        "flat, however deep"
    );
}

/// The search from the edge's line above a HIP 1,170 cells away was off by 7e-3.
#[test]
fn closest_point_of_an_edge_is_exact_for_a_far_hip() {
    let patch = Patch::new([620.019, 621.900_7, 619.995_4, 621.877_14]);
    let north = Side { east: 0, north: 1 };
    let (place, _) = closest_on_edge(&patch, (1171.0, -13.642_913), north);
    let [low, high] = [patch.corners[2], patch.corners[3]].map(f64::from);
    let slope = high - low;
    let truth = (1171.0 - slope * low) / (1.0 + slope * slope);
    let error = f64::from(place.u) - truth;
    assert!(error.abs() < 1e-4, "{error:e}");
}
