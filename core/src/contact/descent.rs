//! The proxy's way over the surface: downhill in the distance to the hand,
//! from patch to patch (paper §4.3.2, made exact at edges and vertices).

use super::closest::{Nearest, nearest_downhill, resolution};
use super::patch::Patch;
use super::spot::{Hand, Spot};
use super::work::{VISIT, Work};
use crate::terrain::{Ground, TileKey, Window};

/// Distances that differ by less than this, relatively, count as equal.
const TIE: f32 = 1.0 + 1e-6;
/// A neighbour must offer a way at least this long, in cells, away from the
/// border to be entered.
const LEAST_WAY: f32 = 2e-7;

/// How near to an edge, in units of what can be told apart, a place is beside it.
const BESIDE: f32 = 4.0;
/// Rounding of a slope of the distance, relative to its parts.
const NOISE: f32 = 1e-6;

/// How a descent ended.
#[derive(Clone, Copy, Debug)]
pub(super) enum Descent {
    /// No direction on the surface leads closer to the hand, which is below;
    /// height of the point above the hand.
    Rests(Spot, f32),
    /// From here the straight way to the hand leads off the surface.
    Leaves(Spot),
    /// The next patch is in a tile (column, row) that is not here. To be taken
    /// up again from `entry`, so that the wait leaves no trace.
    HeldUp {
        at: Spot,
        z: f32,
        entry: Spot,
        tile: [i32; 2],
    },
    /// The tick's work is spent; height above the hand.
    Unfinished(Spot, f32),
    /// There is no surface under the proxy any more; the tile wanted, if it
    /// is missing.
    Lost(Option<[i32; 2]>),
}

/// A patch's neighbours over the border that a point lies on, in a fixed order.
pub(super) fn neighbours([east, north]: [i32; 2]) -> impl Iterator<Item = [i32; 2]> {
    let edges = [[east, 0], [0, north], [east, north]];
    let wanted = [east != 0, north != 0, east != 0 && north != 0];
    edges
        .into_iter()
        .zip(wanted)
        .filter_map(|(shift, wanted)| wanted.then_some(shift))
}

pub(super) fn tile_of(cell: [i32; 2]) -> [i32; 2] {
    let key = TileKey::holding(0, cell);
    [key.col, key.row]
}

/// Moves the proxy from `spot` until it rests, leaves, or may not go on.
///
/// Each step of the loop depends on nothing but the spot and the hand, so a
/// descent that is interrupted and taken up again ends on the same bits.
pub(super) fn descend<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    mut spot: Spot,
    may_leave: bool,
    work: &mut Work,
) -> Descent {
    // The search in a patch is done when the way into it is found.
    let mut entered = None;
    loop {
        let patch = match window.ground(spot.cell) {
            Ground::Patch(corners) => hand.patch(&corners),
            Ground::Hole => return Descent::Lost(None),
            Ground::Missing => return Descent::Lost(Some(tile_of(spot.cell))),
        };
        if may_leave && leaves(window, hand, &spot, &patch) {
            return Descent::Leaves(spot);
        }
        if !work.take(VISIT) {
            return Descent::Unfinished(spot, patch.height(spot.u, spot.v));
        }
        let entry = spot;
        let here = entered
            .take()
            .unwrap_or_else(|| search(&patch, hand, &spot, work));
        (spot.u, spot.v) = (here.u, here.v);
        match best_neighbour(window, hand, &spot, &here, work) {
            Way::Into(next, there) => (spot, entered) = (next, Some(there)),
            Way::Unknown(tile) => {
                return Descent::HeldUp {
                    at: spot,
                    z: here.z,
                    entry,
                    tile,
                };
            }
            Way::None if may_leave && here.z < 0.0 => return Descent::Leaves(spot),
            Way::None => return Descent::Rests(spot, here.z),
        }
    }
}

/// The search in a patch from a spot of it.
fn search(patch: &Patch, hand: &Hand, spot: &Spot, work: &mut Work) -> Nearest {
    let found = nearest_downhill(patch, hand.in_patch(spot.cell), (spot.u, spot.v));
    work.charge(found.evaluations);
    found
}

/// Whether the straight way from `spot` to the hand starts above the surface:
/// above the one-sided slope of the patch it leads into.
pub(super) fn leaves<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    spot: &Spot,
    patch: &Patch,
) -> bool {
    let (p, q) = hand.in_patch(spot.cell);
    let (east, north) = (p - spot.u, q - spot.v);
    let [on_u, on_v] = spot.border();
    let shift = [
        if on_u as f32 * east > 0.0 { on_u } else { 0 },
        if on_v as f32 * north > 0.0 { on_v } else { 0 },
    ];
    if shift == [0, 0] {
        return points_off(patch, spot, (east, north));
    }
    let entered = spot.across(shift);
    match window.ground(entered.cell) {
        Ground::Patch(corners) => points_off(&hand.patch(&corners), &entered, (east, north)),
        // At the border of the data the proxy is held; see `presence`.
        Ground::Hole | Ground::Missing => false,
    }
}

/// Whether the hand lies above the tangent plane of the patch at `spot`.
fn points_off(patch: &Patch, spot: &Spot, (east, north): (f32, f32)) -> bool {
    let rise = patch.slope_u(spot.v) * east + patch.slope_v(spot.u) * north;
    patch.height(spot.u, spot.v) + rise < 0.0
}

enum Way {
    /// Downhill goes on from this point of a neighbouring patch to that one.
    Into(Spot, Nearest),
    /// It may go on in a tile (column, row) that is not here.
    Unknown([i32; 2]),
    /// The point is a local minimum of the distance.
    None,
}

fn best_neighbour<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    spot: &Spot,
    here: &Nearest,
    work: &mut Work,
) -> Way {
    // Up a wall a proxy may stand beside the edge without being on it.
    let (p, q) = hand.in_patch(spot.cell);
    let border = spot.border_within([p, q].map(|hand| BESIDE * resolution(hand)));
    if border == [0, 0] {
        return Way::None;
    }
    let (mut way, mut least) = (Way::None, here.distance_squared * TIE);
    for shift in neighbours(border) {
        let entry = spot.across(shift);
        match window.ground(entry.cell) {
            Ground::Hole => {}
            // It might be the better way: the proxy waits to know.
            Ground::Missing => return Way::Unknown(tile_of(entry.cell)),
            Ground::Patch(corners) => {
                let patch = hand.patch(&corners);
                if !leads_nearer(&patch, hand, &entry, shift) {
                    continue;
                }
                work.charge(VISIT);
                let there = search(&patch, hand, &entry, work);
                // Along a shared edge this patch has done its best already.
                let off_u = (there.u - entry.u).abs() * shift[0].abs() as f32;
                let off_v = (there.v - entry.v).abs() * shift[1].abs() as f32;
                let moved = off_u.max(off_v) > LEAST_WAY
                    || there.distance_squared * (TIE * TIE) < here.distance_squared;
                if moved && there.distance_squared <= least {
                    least = there.distance_squared;
                    way = Way::Into(entry, there);
                }
            }
        }
    }
    way
}

/// Whether the distance falls, or might, from a point of a patch's border into
/// the patch; `shift` is the way in.
///
/// Along the border itself the patch on the other side has done its best.
fn leads_nearer(patch: &Patch, hand: &Hand, entry: &Spot, shift: [i32; 2]) -> bool {
    let (p, q) = hand.in_patch(entry.cell);
    let (u, v) = (entry.u, entry.v);
    let z = patch.height(u, v);
    let (zu, zv) = (patch.slope_u(v), patch.slope_v(u));
    // Up a wall, the last place of a coordinate is a lot of height.
    let size = patch.corners.map(f32::abs);
    let rounding = Patch {
        corners: size,
        ..*patch
    }
    .height(u, v)
        + zu.abs()
        + zv.abs();
    let falls = |way: i32, off: f32, slope: f32| {
        let (gradient, noise) = (off + z * slope, off.abs() + rounding * slope.abs());
        way as f32 * gradient <= NOISE * noise
    };
    (shift[0] != 0 && falls(shift[0], u - p, zu)) || (shift[1] != 0 && falls(shift[1], v - q, zv))
}
