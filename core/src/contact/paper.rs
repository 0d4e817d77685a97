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
use super::descent::tile_of;
use super::patch::Patch;
use super::spot::{Hand, Spot};
use super::work::Work;
use crate::grid::GridPoint;
use crate::terrain::{Ground, Window};

/// Cells under a segment that are looked at for a candidate, at most.
const CANDIDATES: u32 = 4096;
/// Distances that differ by less than this, relatively, count as equal.
const TIE: f32 = 1.0 - 1e-6;

/// What the rule says of one tick.
#[derive(Clone, Copy, Debug)]
pub(super) enum Verdict {
    /// In contact, proxy at the local closest point.
    Contact(Spot, Patch),
    /// Free space: the proxy is the haptic interface point.
    Free,
    /// A tile (column, row) is not here.
    HeldUp([i32; 2]),
}

/// One update: candidate, local closest point, collision.
pub(super) fn update<const D: usize>(
    window: &Window<'_, D>,
    last_contact: Option<Spot>,
    previous: &GridPoint,
    hip: &GridPoint,
    work: &mut Work,
) -> Verdict {
    let hand = Hand::new(*hip);
    let start = match last_contact {
        Some(spot) => spot,
        None => match first_candidate(window, previous, hip, work) {
            Ok(Some(spot)) => spot,
            Ok(None) => return Verdict::Free,
            Err(tile) => return Verdict::HeldUp(tile),
        },
    };
    match local_closest_point(window, &hand, start, work) {
        Ok(Some((spot, patch))) if is_inside(window, &hand, &spot, &patch) => {
            Verdict::Contact(spot, patch)
        }
        Ok(_) => Verdict::Free,
        Err(tile) => Verdict::HeldUp(tile),
    }
}

/// Step 1: the first patch under the segment whose highest corner is above the
/// segment's lowest height.
fn first_candidate<const D: usize>(
    window: &Window<'_, D>,
    previous: &GridPoint,
    hip: &GridPoint,
    work: &mut Work,
) -> Result<Option<Spot>, [i32; 2]> {
    let low = if previous.is_below(hip) {
        previous
    } else {
        hip
    };
    let (view, hand) = (Hand::new(*low), Hand::new(*hip));
    for cell in cells_under(previous, hip).take(CANDIDATES as usize) {
        // One unit for eight cells: looking at a patch is that much cheaper.
        match window.ground(cell) {
            Ground::Patch(corners) if view.is_below_any(&corners) => {
                let (p, q) = hand.in_patch(cell);
                return Ok(Some(Spot {
                    cell,
                    u: p.clamp(0.0, 1.0),
                    v: q.clamp(0.0, 1.0),
                }));
            }
            Ground::Missing => return Err(tile_of(cell)),
            Ground::Patch(_) | Ground::Hole => {}
        }
    }
    let _ = work.take();
    Ok(None)
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

/// Step 2: from patch to patch while the bounded closest point gets nearer.
fn local_closest_point<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    mut spot: Spot,
    work: &mut Work,
) -> Result<Option<(Spot, Patch)>, [i32; 2]> {
    let Some((mut patch, mut least)) = bounded_closest_point(window, hand, &mut spot, work)? else {
        return Ok(None);
    };
    while spot.border() != [0, 0] && work.take() {
        let mut nearer = None;
        let [east, north] = spot.border();
        for shift in [[east, 0], [0, north], [east, north]] {
            if shift == [0, 0] || (shift != [east, north] && east * north == 0) {
                continue; // an edge has one neighbour, a vertex three
            }
            let mut there = spot.across(shift);
            let found = bounded_closest_point(window, hand, &mut there, work)?;
            if let Some((over, distance)) = found.filter(|(_, d)| *d < least * TIE) {
                least = distance;
                nearer = Some((there, over));
            }
        }
        let Some(next) = nearer else { break };
        (spot, patch) = next;
    }
    Ok(Some((spot, patch)))
}

/// Moves the spot to the closest point of its patch; `None` over a hole.
fn bounded_closest_point<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    spot: &mut Spot,
    work: &mut Work,
) -> Result<Option<(Patch, f32)>, [i32; 2]> {
    let patch = match window.ground(spot.cell) {
        Ground::Patch(corners) => hand.patch(&corners),
        Ground::Hole => return Ok(None),
        Ground::Missing => return Err(tile_of(spot.cell)),
    };
    let found = nearest_downhill(&patch, hand.in_patch(spot.cell), (spot.u, spot.v));
    work.charge(found.evaluations);
    (spot.u, spot.v) = (found.u, found.v);
    Ok(Some((patch, found.distance_squared)))
}

/// Step 3: the sign of (LCP − HIP)·n, n averaged over the patches that share
/// the edge or vertex.
fn is_inside<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    spot: &Spot,
    patch: &Patch,
) -> bool {
    let mut normal = unit(patch.normal(spot.u, spot.v));
    let [east, north] = spot.border();
    for shift in [[east, 0], [0, north], [east, north]] {
        if shift == [0, 0] || (shift != [east, north] && east * north == 0) {
            continue;
        }
        let over = spot.across(shift);
        if let Ground::Patch(corners) = window.ground(over.cell) {
            normal += unit(hand.patch(&corners).normal(over.u, over.v));
        }
    }
    hand.stretch(spot, patch).dot(normal) > 0.0
}

fn unit(v: Vec3) -> Vec3 {
    v / libm::sqrtf(v.length_squared())
}
