//! The proxy's way over gentle ground: from patch to patch, where the squared
//! distance is convex in each.
//!
//! A convex distance has one minimum in a patch, and a point of an edge from
//! which downhill leads out of the patch is that minimum. So the way that
//! [`super::descent`] would search is known: to the edge, across it, and on; or
//! to rest on the edge where downhill leads back from the other side, too.
//! Wherever that is not certain the general search decides.

use glam::Vec3;

use super::descent::leaves;
use super::patch::Patch;
use super::spot::{Hand, Spot, is_inside, tile_of};
use super::track::Track;
use crate::terrain::{Ground, Window};

/// Patches entered at most in one tick.
pub(super) const HOPS: u32 = 4;
/// Slope of half the squared distance, in cells, below which it is not certain
/// which way is downhill.
const LEVEL: f32 = 1e-5;

/// Where a way over gentle ground ends.
pub(super) struct Rest {
    pub(super) track: Track,
    /// From the hand to the proxy, cells.
    pub(super) stretch: Vec3,
    /// Patches entered.
    pub(super) hops: u32,
}

/// Where a proxy rests now that rested on a track; `None` where it takes the
/// general search to tell.
///
/// # Errors
/// The tile (column, row) on its way that is not here.
#[inline(never)]
pub(super) fn glide<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    from: &Track,
) -> Result<Option<Rest>, [i32; 2]> {
    let mut track = *from;
    let mut patch = track.seen_by(hand);
    if leaves(window, hand, &track.spot, &patch) {
        return Ok(None);
    }
    for hops in 0..HOPS {
        let rests = |track: Track, stretch: Vec3| Rest {
            track,
            stretch,
            hops,
        };
        let (at, edge) = match within(&track, &patch, hand) {
            Some(Within::Inside(to, spot)) => return Ok(Some(rests(track.at(spot), to))),
            Some(Within::OnEdge(at, edge)) => (at, edge),
            None => return Ok(None),
        };
        let entry = at.across(edge.shift());
        let corners = match window.ground(entry.cell) {
            Ground::Patch(corners) => corners,
            Ground::Hole => return Ok(None),
            Ground::Missing => return Err(tile_of(entry.cell)),
        };
        let Some(beyond) = Track::new(&corners, track.over, entry) else {
            return Ok(None);
        };
        let next = beyond.seen_by(hand);
        let slope = edge.slope(&next, &entry, hand.in_patch(entry.cell));
        if slope > LEVEL {
            let stretch = hand.stretch(&at, patch.height(at.u, at.v));
            return Ok(Some(rests(track.at(at), stretch)));
        }
        if slope >= -LEVEL || leaves(window, hand, &entry, &next) {
            return Ok(None);
        }
        (track, patch) = (beyond, next);
    }
    Ok(None)
}

/// Where a patch's own minimum of the distance is.
enum Within {
    /// Here, this far from the hand.
    Inside(Vec3, Spot),
    /// On an edge, beyond which downhill goes on as far as this patch can tell.
    OnEdge(Spot, Edge),
}

/// The minimum of a patch, where the distance is sure to be convex.
fn within(track: &Track, patch: &Patch, hand: &Hand) -> Option<Within> {
    let cell = track.spot.cell;
    let (p, q) = hand.in_patch(cell);
    let to = track.closest(patch, (p, q))?;
    let (u, v) = (p + to.x, q + to.y);
    if is_inside(u) && is_inside(v) {
        let certain = track.is_convex(to.z) || track.is_convex_between(to.z, (u, v));
        return (to.z >= 0.0 && certain).then_some(Within::Inside(to, Spot { cell, u, v }));
    }
    let edge = Edge::toward(u, v)?;
    let at = edge.closest(patch, (p, q), cell)?;
    let z = patch.height(at.u, at.v);
    let certain = z >= 0.0 && track.is_convex(z) && edge.slope(patch, &at, (p, q)) < -LEVEL;
    certain.then_some(Within::OnEdge(at, edge))
}

/// One of a patch's four edges.
#[derive(Clone, Copy)]
struct Edge {
    /// Whether it runs north, at `place` of the way east.
    runs_north: bool,
    /// 0 or 1.
    place: f32,
}

impl Edge {
    /// The edge that a point beyond it, and beyond no other, lies beyond.
    fn toward(u: f32, v: f32) -> Option<Self> {
        let (runs_north, beyond) = match (is_inside(u), is_inside(v)) {
            (false, true) => (true, u),
            (true, false) => (false, v),
            _ => return None,
        };
        let place = if beyond > 0.5 { 1.0 } else { 0.0 };
        Some(Self { runs_north, place })
    }

    /// The neighbour across it.
    fn shift(self) -> [i32; 2] {
        let out = if self.place > 0.5 { 1 } else { -1 };
        if self.runs_north { [out, 0] } else { [0, out] }
    }

    /// The point of the edge, a straight line, closest to a hand at `(p, q)`;
    /// `None` near its ends.
    fn closest(self, patch: &Patch, (p, q): (f32, f32), cell: [i32; 2]) -> Option<Spot> {
        // From the edge's end: the line's height above a far hand would cancel.
        let foot = |hand: f32, slope: f32, end: f32| (hand - slope * end) / (1.0 + slope * slope);
        let (u, v) = if self.runs_north {
            let u = self.place;
            (u, foot(q, patch.slope_v(u), patch.height(u, 0.0)))
        } else {
            let v = self.place;
            (foot(p, patch.slope_u(v), patch.height(0.0, v)), v)
        };
        let inside = is_inside(if self.runs_north { v } else { u });
        inside.then_some(Spot { cell, u, v })
    }

    /// Slope of half the squared distance at a point of the edge, in the
    /// direction out of the patch that the edge was made for.
    fn slope(self, patch: &Patch, at: &Spot, (p, q): (f32, f32)) -> f32 {
        let z = patch.height(at.u, at.v);
        let out = if self.place > 0.5 { 1.0 } else { -1.0 };
        if self.runs_north {
            out * ((at.u - p) + z * patch.slope_u(at.v))
        } else {
            out * ((at.v - q) + z * patch.slope_v(at.u))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sought from the edge's line above a hand 1,170 cells off it was 7e-3 beside.
    #[test]
    fn a_far_hand_finds_the_closest_point_of_an_edge() {
        let patch = Patch::new([620.019, 621.900_7, 619.995_4, 621.877_14]);
        let edge = Edge {
            runs_north: false,
            place: 1.0,
        };
        let spot = edge.closest(&patch, (1171.0, -13.642_913), [0, 0]);
        let [low, high] = [patch.corners[2], patch.corners[3]].map(f64::from);
        let slope = high - low;
        let truth = (1171.0 - slope * low) / (1.0 + slope * slope);
        let error = f64::from(spot.expect("on the edge").u) - truth;
        assert!(error.abs() < 1e-4, "{error:e}");
    }
}
