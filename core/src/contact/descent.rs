//! The proxy's way over the surface: downhill in the distance to the hand,
//! from patch to patch (paper §4.3.2, made exact at edges and vertices).

use super::closest::Nearest;
use super::neighbours::{Way, best_neighbour, search};
use super::patch::Patch;
use super::spot::{Hand, Spot, tile_of};
use super::work::Work;
use crate::terrain::{Ground, Window};

/// Rounding of a height, of those it is mixed from, and some more.
const UNSURE: f32 = 1e-5;

/// How a descent ended.
#[derive(Clone, Copy, Debug)]
pub(super) enum Descent {
    /// No direction on the surface leads closer to the hand, which is below:
    /// the point, its height above the hand, and where its patch was entered.
    Rests { at: Spot, z: f32, entry: Spot },
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
    /// The tick's work is spent: the nearest point so far, its height above the
    /// hand, and the place to go on from.
    Unfinished { at: Spot, z: f32, entry: Spot },
    /// There is no surface under the proxy any more; the tile wanted, if it
    /// is missing.
    Lost(Option<[i32; 2]>),
}

/// Where a proxy may leave the surface.
#[derive(Clone, Copy, Debug)]
pub(super) enum Leave {
    Anywhere,
    /// Not here: it has just tried to, and was held at once.
    ButAt(Spot),
    /// It has left too often.
    Nowhere,
}

impl Leave {
    fn is_allowed_at(&self, spot: &Spot) -> bool {
        match self {
            Self::Anywhere => true,
            Self::ButAt(place) => !spot.is_same_place(place),
            Self::Nowhere => false,
        }
    }
}

/// Moves the proxy from `spot` until it rests, leaves, or may not go on.
///
/// Each step of the loop depends on nothing but the spot and the hand, so a
/// descent that is interrupted and taken up again ends on the same bits.
pub(super) fn descend<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    mut spot: Spot,
    leave: Leave,
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
        if leave.is_allowed_at(&spot) && leaves(window, hand, &spot, &patch) {
            return Descent::Leaves(spot);
        }
        let entry = spot;
        if !work.visit() {
            // Beside a wall the way in may begin at its foot.
            let (at, z) = entered.map_or_else(
                || (entry, patch.height(entry.u, entry.v)),
                |there: Nearest| (entry.moved_to(&there), there.z),
            );
            return Descent::Unfinished { at, z, entry };
        }
        let here = entered
            .take()
            .unwrap_or_else(|| search(&patch, hand, &spot, work));
        spot = entry.moved_to(&here);
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
            Way::Later => {
                return Descent::Unfinished {
                    at: spot,
                    z: here.z,
                    entry,
                };
            }
            Way::None
                if leave.is_allowed_at(&spot)
                    && is_hardly_above(&patch, here.z)
                    && (here.z < 0.0 || leaves(window, hand, &spot, &patch)) =>
            {
                return Descent::Leaves(spot);
            }
            Way::None => {
                return Descent::Rests {
                    at: spot,
                    z: here.z,
                    entry,
                };
            }
        }
    }
}

/// Whether a proxy that rests `z` cells above the hand may in truth be below it,
/// and would pull: up a wall it is rounding that tells.
fn is_hardly_above(patch: &Patch, z: f32) -> bool {
    let [sw, se, nw, ne] = patch.corners.map(f32::abs);
    z <= UNSURE * ((sw + se) + (nw + ne))
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
