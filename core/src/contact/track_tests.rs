use super::super::closest::nearest_downhill;
use super::super::dice::Dice;
use super::super::patch::Patch;
use super::*;
use crate::cases::cases;
use crate::grid::GridPoint;
use crate::terrain::Corners;

fn track(heights: [f32; 4], spot: Spot) -> Option<Track> {
    let gentle = Gentle::new(&Corners { base: 0, heights })?;
    Some(Track::new(gentle, [0, 0], spot))
}

fn hand(p: f32, q: f32) -> GridPoint {
    GridPoint::new([0; 3], Vec3::new(p, q, 0.0))
}

fn spot(u: f32, v: f32) -> Spot {
    Spot { cell: [0, 0], u, v }
}

/// Where a hand at height zero takes the proxy from a spot.
fn follow(heights: [f32; 4], (p, q): (f32, f32), from: (f32, f32)) -> Option<(f32, f32)> {
    let mut track = track(heights, spot(from.0, from.1))?;
    let hand = Hand::new(hand(p, q));
    let (stretch, u, v) = match track.follow(&hand) {
        Some(stretch) => (stretch, track.spot.u, track.spot.v),
        None => {
            let patch = track.gentle.seen_by(&hand);
            let start = (track.spot.u - p, track.spot.v - q);
            let to = track.gentle.by_newton(&patch, (p, q), start)?;
            let (u, v) = (p + to.x, q + to.y);
            if !(to.z >= 0.0 && is_inside(u) && is_inside(v) && track.gentle.is_convex(to.z)) {
                return None;
            }
            (to, u, v)
        }
    };
    let patch = Patch::new(heights);
    let off = Vec3::new(u - p, v - q, patch.height(u, v)) - stretch;
    assert!(off.abs().max_element() < 1e-6, "{stretch} {track:?}");
    Some((u, v))
}

const CASES: u32 = cases(20_000, 200);

/// Patches up to a slope, hands within a tenth of a cell under the last
/// answer's own hand, and what both ways of solving say.
fn agree(slope: f64, depths: [f64; 2], bound: f32) -> [u32; 2] {
    let mut dice = Dice(41);
    let mut seen = [0; 2];
    for _ in 0..CASES {
        let depth = dice.between(depths[0], depths[1]);
        let heights = core::array::from_fn(|_| (depth + dice.between(0.0, slope)) as f32);
        let patch = Patch::new(heights);
        let place = |dice: &mut Dice| dice.between(0.0, 1.0) as f32;
        let first = (place(&mut dice), place(&mut dice));
        let start = nearest_downhill(&patch, first, first);
        let moved = |x: f32, dice: &mut Dice| x + dice.between(-0.05, 0.05) as f32;
        let next = (moved(first.0, &mut dice), moved(first.1, &mut dice));
        // The point that the hand is put at.
        let next = {
            let at = hand(next.0, next.1).seen_from([0; 3]);
            (at.x, at.y)
        };
        let followed = follow(heights, next, (start.u, start.v));
        seen[usize::from(followed.is_some())] += 1;
        let Some((u, v)) = followed else { continue };
        let general = nearest_downhill(&patch, next, (start.u, start.v));
        let off = (u - general.u).abs().max((v - general.v).abs());
        assert!(off <= bound, "{patch:?} {next:?} ({u}, {v}) {general:?}");
    }
    seen
}

#[test]
fn ends_where_the_general_search_ends() {
    for depths in [[0.01, 0.2], [0.2, 1.0]] {
        let [_, gentle] = agree(0.3, depths, 6e-7);
        let [left, steep] = agree(2.0, depths, 1.5e-6);
        assert!(
            gentle > CASES * 2 / 5 && steep > CASES / 40 && left > CASES / 20,
            "{gentle} {steep} {left}"
        );
    }
}

#[test]
fn a_flat_patch_is_a_projection() {
    let (u, v) = follow([0.1, 0.2, 0.1, 0.2], (0.5, 0.25), (0.4, 0.4)).unwrap();
    let drop = 0.15 / 1.01 * 0.1;
    assert!((u - (0.5 - drop)).abs() < 1e-7 && v == 0.25, "{u} {v}");
}

#[test]
fn leaves_what_is_not_plain_to_the_general_search() {
    let inside = (0.5, 0.5);
    let flat = |depth: f32, hand| follow([depth; 4], hand, inside);
    assert!(flat(0.1, (0.51, 0.5)).is_some());
    assert_eq!(flat(0.1, (1.01, 0.5)), None, "over the border");
    assert_eq!(flat(-0.1, (0.51, 0.5)), None, "above the surface");
    let middle = spot(0.5, 0.5);
    assert!(track([0.0, 9.0, 0.0, 9.0], middle).is_none(), "steep");
    assert!(track([f32::NAN; 4], middle).is_none(), "nothing");
    // Twisted so far above the hand that the middle is a saddle.
    let saddle = [1.5, 2.5, 2.5, 1.5];
    assert!(track(saddle, middle).is_some());
    assert_eq!(follow(saddle, (0.5, 0.5), inside), None, "a saddle");
    let far = GridPoint::new([0, 0, -(1 << 29)], Vec3::new(0.5, 0.5, 0.0));
    let followed = track([0.1; 4], middle).unwrap().follow(&Hand::new(far));
    assert!(followed.is_some(), "flat, however deep");
}
