//! The paper's own rule (§4.3), kept as the reference to compare with.
//!
//! It differs from the swept contact where the paper says so itself: a patch
//! is a candidate by the lowest height of the whole segment, so the first
//! candidate may not be the first one hit; and only the sign of the closest
//! point decides about contact, so a fast sweep passes through a thin peak
//! (figure 8). In each patch the closest point is found as in
//! [`super::closest`], not by plain Newton, which would also lose contacts.

use glam::Vec3;

use super::closest::nearest_downhill;
use super::neighbours::neighbours;
use super::patch::Patch;
use super::spot::{Hand, Spot, tile_of};
use super::work::{EVALUATION, VISIT, Work};
use crate::grid::GridPoint;
use crate::terrain::{Ground, Window};

/// Cells under a segment that are looked at for a candidate, at most: a hand that
/// moves farther in a tick passes through whatever comes after.
const CANDIDATES: usize = 4096;
/// Distances that differ by less than this, relatively, count as equal.
const TIE: f32 = 1.0 - 1e-6;

/// What the rule says of one tick.
#[derive(Clone, Copy, Debug)]
pub(super) enum Verdict {
    /// In contact, proxy at the local closest point so far, this high above
    /// the hand, and whether that is the last word.
    Contact {
        /// The proxy.
        spot: Spot,
        /// Its height above the hand.
        z: f32,
        /// Whether the search has ended.
        settled: bool,
    },
    /// Free space: the proxy is the haptic interface point.
    Free,
    /// A tile (column, row) is not here.
    HeldUp([i32; 2]),
}

/// What the look for a candidate came to.
enum Candidate {
    At(Spot),
    None,
    HeldUp([i32; 2]),
}

/// One update: candidate, local closest point, collision. `passed` counts the
/// cells under the segment that were no candidates before a tile was missing.
pub(super) fn update<const D: usize>(
    window: &Window<'_, D>,
    last_contact: Option<Spot>,
    previous: &GridPoint,
    hip: &GridPoint,
    passed: &mut usize,
    work: &mut Work,
) -> Verdict {
    let hand = Hand::new(*hip);
    let start = match last_contact {
        Some(spot) => spot,
        None => match next_candidate(window, previous, hip, passed, work) {
            Candidate::At(spot) => spot,
            Candidate::None => return Verdict::Free,
            Candidate::HeldUp(tile) => return Verdict::HeldUp(tile),
        },
    };
    match local_closest_point(window, &hand, start, work) {
        Ok(Some(found)) if is_inside(window, &hand, &found) => Verdict::Contact {
            spot: found.spot,
            z: found.z,
            settled: found.settled,
        },
        Ok(_) => Verdict::Free,
        Err(tile) => Verdict::HeldUp(tile),
    }
}

/// Step 1: the first patch under the segment whose highest corner is above the
/// segment's lowest height.
fn next_candidate<const D: usize>(
    window: &Window<'_, D>,
    previous: &GridPoint,
    hip: &GridPoint,
    passed: &mut usize,
    work: &mut Work,
) -> Candidate {
    let low = if previous.is_below(hip) {
        previous
    } else {
        hip
    };
    let (view, hand) = (Hand::new(*low), Hand::new(*hip));
    let _ = work.take(EVALUATION);
    if view.altitude().cell() >= window.top() {
        return Candidate::None;
    }
    let cells = cells_under(previous, hip).take(CANDIDATES);
    for cell in cells.skip(*passed) {
        match window.ground(cell) {
            Ground::Patch(corners) if view.is_below_any(&corners) => {
                let (p, q) = hand.in_patch(cell);
                return Candidate::At(Spot {
                    cell,
                    u: p.clamp(0.0, 1.0),
                    v: q.clamp(0.0, 1.0),
                });
            }
            Ground::Missing => return Candidate::HeldUp(tile_of(cell)),
            Ground::Patch(_) | Ground::Hole => *passed += 1,
        }
    }
    Candidate::None
}

/// The cells under a segment, by an incremental line algorithm.
fn cells_under(from: &GridPoint, to: &GridPoint) -> impl Iterator<Item = [i32; 2]> + use<> {
    let way = from.to(to);
    let (start, mut cell, last) = (from.frac(), from.column(), to.column());
    let step = [(last[0] - cell[0]).signum(), (last[1] - cell[1]).signum()];
    let first = |start: f32, way: f32, step: i32| {
        let border = if step > 0 { 1.0 - start } else { start };
        if step == 0 {
            f32::INFINITY
        } else {
            border / way.abs()
        }
    };
    let mut next = [
        first(start.x, way.x, step[0]),
        first(start.y, way.y, step[1]),
    ];
    let each = [way.x.abs().recip(), way.y.abs().recip()];
    let mut left = last[0].abs_diff(cell[0]) + last[1].abs_diff(cell[1]);
    let mut begun = false;
    core::iter::from_fn(move || {
        if !begun {
            begun = true;
            return Some(cell);
        }
        left = left.checked_sub(1)?;
        let east = cell[1] == last[1] || (cell[0] != last[0] && next[0] <= next[1]);
        let axis = usize::from(!east);
        cell[axis] += step[axis];
        next[axis] += each[axis];
        Some(cell)
    })
}

/// The closest point of a patch, or of several.
#[derive(Clone, Copy)]
struct Found {
    spot: Spot,
    patch: Patch,
    /// Height above the hand.
    z: f32,
    distance_squared: f32,
    settled: bool,
}

/// Step 2: from patch to patch while the bounded closest point gets nearer.
fn local_closest_point<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    start: Spot,
    work: &mut Work,
) -> Result<Option<Found>, [i32; 2]> {
    let Some(mut best) = bounded_closest_point(window, hand, start, work)? else {
        return Ok(None);
    };
    let mut gets_on = false;
    while best.spot.border() != [0, 0] {
        // One look around in each tick at least, or the next begins as this one.
        if !work.take(EVALUATION) && gets_on {
            best.settled = false;
            break;
        }
        gets_on = true;
        let mut nearer = None;
        let mut least = best.distance_squared;
        for shift in neighbours(best.spot.border()) {
            let found = bounded_closest_point(window, hand, best.spot.across(shift), work)?;
            if let Some(found) = found.filter(|found| found.distance_squared < least * TIE) {
                least = found.distance_squared;
                nearer = Some(found);
            }
        }
        let Some(next) = nearer else { break };
        best = next;
    }
    Ok(Some(best))
}

/// The closest point of the patch that a spot is in; `None` over a hole.
fn bounded_closest_point<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    spot: Spot,
    work: &mut Work,
) -> Result<Option<Found>, [i32; 2]> {
    let patch = match window.ground(spot.cell) {
        Ground::Patch(corners) => hand.patch(&corners),
        Ground::Hole => return Ok(None),
        Ground::Missing => return Err(tile_of(spot.cell)),
    };
    let found = nearest_downhill(&patch, hand.in_patch(spot.cell), (spot.u, spot.v));
    work.charge(EVALUATION * found.evaluations + VISIT);
    Ok(Some(Found {
        spot: Spot {
            u: found.u,
            v: found.v,
            ..spot
        },
        patch,
        z: found.z,
        distance_squared: found.distance_squared,
        settled: true,
    }))
}

/// Step 3: the sign of (LCP − HIP)·n, n averaged over the patches that share
/// the edge or vertex.
fn is_inside<const D: usize>(window: &Window<'_, D>, hand: &Hand, found: &Found) -> bool {
    let spot = &found.spot;
    let mut normal = unit(found.patch.normal(spot.u, spot.v));
    for shift in neighbours(spot.border()) {
        let over = spot.across(shift);
        if let Ground::Patch(corners) = window.ground(over.cell) {
            normal += unit(hand.patch(&corners).normal(over.u, over.v));
        }
    }
    hand.stretch(spot, found.z).dot(normal) > 0.0
}

fn unit(v: Vec3) -> Vec3 {
    v / libm::sqrtf(v.length_squared())
}
