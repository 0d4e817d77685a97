//! The proxy's way when the hand has hardly moved: the patch's closest point
//! by Newton's method in both variables, from the last one.
//!
//! Nearly every tick in contact is of this kind. It is left to the general
//! search as soon as anything is not plain: a border of the patch in reach, a
//! steep or strongly twisted patch, a long way, a proxy that may leave. What
//! is answered here is the minimum that the general search would end at: the
//! Hessian stays positive definite over a way too short for it to change, so
//! the distance is convex there and has one minimum.

use super::patch::Patch;
use super::spot::{Hand, Spot};
use super::work::Work;
use crate::terrain::{Ground, Window};

/// Slopes and twist at most, cells a cell: what the rounding of the height
/// then costs is below 1e-6 cell.
const GENTLE: f32 = 4.0;
/// First step at most, cells.
const SHORT: f32 = 1.0 / 16.0;
/// Newton's error after a step s that followed a step r is about s³/r²: each
/// step's relative error is the square of the one's before. Cells.
const LEFT: f32 = 1e-8;
/// A first step of a length whose square is below [`LEFT`] by a wide margin is
/// the last; taken for the step before the first.
const BEFORE: f32 = 4.6e-3;
/// Steps at most: quadratic convergence needs no more.
const STEPS: u32 = 4;
/// Distance from the patch's border below which the general search decides.
const BORDER: f32 = 1e-6;

/// A closest point inside a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tracked {
    /// Eastward coordinate in the patch.
    u: f32,
    /// Northward coordinate in the patch.
    v: f32,
}

/// The proxy's next place on the patch it is on, when that is plain to tell:
/// where [`super::descent::descend`] would come to rest.
#[inline]
pub(super) fn follow<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    spot: Spot,
    may_leave: bool,
    work: &mut Work,
) -> Option<(Spot, Patch)> {
    let Ground::Patch(corners) = hand.ground(window, spot.cell) else {
        return None;
    };
    let patch = Patch::new(corners);
    let start = (spot.u, spot.v);
    let Tracked { u, v } = track(&patch, hand.in_patch(spot.cell), start, may_leave)?;
    work.take().then_some((Spot { u, v, ..spot }, patch))
}

/// Follows the closest point from (u, v) for a hand at (p, q), both in patch
/// coordinates; `None` where it takes the general search to tell.
///
/// With `may_leave`, a hand that is above the tangent plane of either end is
/// one of those cases.
#[inline]
fn track(
    patch: &Patch,
    (p, q): (f32, f32),
    (mut u, mut v): (f32, f32),
    may_leave: bool,
) -> Option<Tracked> {
    let steepest = patch.a.abs().max(patch.b.abs()).max(patch.c.abs());
    if !(steepest <= GENTLE && is_inside(u) && is_inside(v)) {
        return None;
    }
    let mut before = BEFORE;
    let mut longest = SHORT;
    for _ in 0..STEPS {
        let (zu, zv) = (patch.slope_u(v), patch.slope_v(u));
        let z = patch.height(u, v);
        let (east, north) = (p - u, q - v);
        if may_leave && z + (zu * east + zv * north) < 0.0 {
            return None;
        }
        // Half the gradient and the Hessian of the squared distance (eq. 8-11).
        let (gu, gv) = (z * zu - east, z * zv - north);
        let (uu, vv) = (1.0 + zu * zu, 1.0 + zv * zv);
        let uv = zu * zv + z * patch.a;
        let det = uu * vv - uv * uv;
        // Without the twist it would be 1 + zu² + zv².
        if det < 0.5 * (uu + zv * zv) {
            return None;
        }
        let scale = 1.0 / det;
        let (du, dv) = ((gv * uv - gu * vv) * scale, (gu * uv - gv * uu) * scale);
        (u, v) = (u + du, v + dv);
        let step = du.abs().max(dv.abs());
        if !(step <= longest && is_inside(u) && is_inside(v)) {
            return None;
        }
        if step * step * step <= LEFT * before * before {
            return Some(Tracked { u, v });
        }
        (before, longest) = (step, step);
    }
    None
}

fn is_inside(x: f32) -> bool {
    x > BORDER && x < 1.0 - BORDER
}

#[cfg(test)]
mod tests {
    use super::super::closest::nearest_downhill;
    use super::super::dice::Dice;
    use super::*;

    /// Patches up to a slope, hands within a tenth of a cell under the last
    /// answer's own hand, and what both ways of solving say.
    fn agree(slope: f64, bound: f32) -> [u32; 2] {
        let mut dice = Dice(41);
        let mut seen = [0; 2];
        for _ in 0..20_000 {
            let depth = dice.between(0.01, 1.0);
            let corners = core::array::from_fn(|_| (depth + dice.between(0.0, slope)) as f32);
            let patch = Patch::new(corners);
            let place = |dice: &mut Dice| dice.between(0.0, 1.0) as f32;
            let hand = (place(&mut dice), place(&mut dice));
            let start = nearest_downhill(&patch, hand, hand);
            let moved = |x: f32, dice: &mut Dice| x + dice.between(-0.05, 0.05) as f32;
            let next = (moved(hand.0, &mut dice), moved(hand.1, &mut dice));
            let tracked = track(&patch, next, (start.u, start.v), false);
            seen[usize::from(tracked.is_some())] += 1;
            let Some(tracked) = tracked else { continue };
            let general = nearest_downhill(&patch, next, (start.u, start.v));
            let off = (tracked.u - general.u)
                .abs()
                .max((tracked.v - general.v).abs());
            assert!(off <= bound, "{patch:?} {next:?} {tracked:?} {general:?}");
        }
        seen
    }

    #[test]
    fn ends_where_the_general_search_ends() {
        let [_, gentle] = agree(0.3, 5e-7);
        let [left, steep] = agree(2.0, 1.5e-6);
        assert!(gentle > 8000 && steep > 1000 && left > 1000);
    }

    #[test]
    fn leaves_what_is_not_plain_to_the_general_search() {
        let flat = Patch::new([0.1; 4]);
        let inside = (0.5, 0.5);
        assert!(track(&flat, (0.51, 0.5), inside, true).is_some());
        assert_eq!(track(&flat, (1.01, 0.5), (0.99, 0.5), true), None);
        assert_eq!(track(&flat, (0.7, 0.5), inside, true), None);
        let above = Patch::new([-0.1; 4]);
        assert_eq!(track(&above, (0.51, 0.5), inside, true), None);
        let steep = Patch::new([0.0, 9.0, 0.0, 9.0]);
        assert_eq!(track(&steep, (0.51, 0.5), inside, true), None);
        // Twisted so far above the hand that the middle is a saddle.
        let saddle = Patch::new([3.0, 5.0, 5.0, 3.0]);
        assert_eq!(track(&saddle, (0.5, 0.5), inside, true), None);
        let nothing = Patch::new([f32::NAN; 4]);
        assert_eq!(track(&nothing, (0.51, 0.5), inside, true), None);
    }
}
