//! What the patches around a point of a border have to offer.

use super::closest::{COARSEST, Nearest, RESOLUTION, nearest_downhill, resolution};
use super::patch::Patch;
use super::spot::{Hand, Spot, tile_of};
use super::work::{EVALUATION, VISIT, Work};
use crate::terrain::{Ground, Window};

/// A neighbour must offer a way at least this long, in cells, away from the
/// border to be entered.
const LEAST_WAY: f32 = 2e-7;
/// How near to an edge, in units of what can be told apart, a place is beside it.
const BESIDE: f32 = 4.0;
/// Rounding of a slope of the distance, relative to its parts.
const NOISE: f32 = 1e-6;

/// A patch's neighbours over the border that a point lies on, in a fixed order.
pub(super) fn neighbours([east, north]: [i32; 2]) -> impl Iterator<Item = [i32; 2]> {
    let edges = [[east, 0], [0, north], [east, north]];
    let wanted = [east != 0, north != 0, east != 0 && north != 0];
    edges
        .into_iter()
        .zip(wanted)
        .filter_map(|(shift, wanted)| wanted.then_some(shift))
}

/// The search in a patch from a spot of it.
pub(super) fn search(patch: &Patch, hand: &Hand, spot: &Spot, work: &mut Work) -> Nearest {
    let found = nearest_downhill(patch, hand.in_patch(spot.cell), (spot.u, spot.v));
    work.charge(EVALUATION * found.evaluations);
    #[cfg(test)]
    super::tally::searched(found.evaluations);
    found
}

/// Where downhill goes on from a point that is its patch's nearest.
pub(super) enum Way {
    /// From this point of a neighbouring patch to that one.
    Into(Spot, Nearest),
    /// It may go on in a tile (column, row) that is not here.
    Unknown([i32; 2]),
    /// The tick's work is spent: the visit is to be made again.
    Later,
    /// Nowhere: the point is a local minimum of the distance.
    None,
}

/// A way into a neighbour.
struct Offer {
    entry: Spot,
    there: Nearest,
    /// By how much the squared distance gets less, cells², and its rounding.
    gain: (f32, f32),
    /// How far the hand is that way, cells: of two ways as good as each other
    /// the one toward it is taken, however the scene is turned.
    toward: f32,
}

impl Offer {
    fn is_better_than(&self, other: &Self) -> bool {
        let (more, noise) = (self.gain.0 - other.gain.0, self.gain.1 + other.gain.1);
        more > noise || (more >= -noise && self.toward > other.toward)
    }
}

/// The best way on from `spot`, its patch's nearest point as `here` has it.
pub(super) fn best_neighbour<const D: usize>(
    window: &Window<'_, D>,
    hand: &Hand,
    spot: &Spot,
    here: &Nearest,
    work: &mut Work,
) -> Way {
    // Up a wall a proxy may stand beside the edge without being on it.
    let (p, q) = hand.in_patch(spot.cell);
    let border = spot.border_within([p, q].map(|hand| (BESIDE * resolution(hand)).min(COARSEST)));
    if border == [0, 0] {
        return Way::None;
    }
    let mut best: Option<Offer> = None;
    for shift in neighbours(border) {
        let entry = spot.across(shift);
        let patch = match window.ground(entry.cell) {
            Ground::Hole => continue,
            // It might be the better way: the proxy waits to know.
            Ground::Missing => return Way::Unknown(tile_of(entry.cell)),
            Ground::Patch(corners) => hand.patch(&corners),
        };
        if !work.goes_on() {
            return Way::Later;
        }
        let Some(offer) = offer(&patch, hand, entry, shift, here, work) else {
            continue;
        };
        if best.as_ref().is_none_or(|best| offer.is_better_than(best)) {
            best = Some(offer);
        }
    }
    best.map_or(Way::None, |best| Way::Into(best.entry, best.there))
}

/// What a neighbour has to offer, entered at `entry` by way of `shift`; `None`
/// if nothing.
fn offer(
    patch: &Patch,
    hand: &Hand,
    entry: Spot,
    shift: [i32; 2],
    here: &Nearest,
    work: &mut Work,
) -> Option<Offer> {
    let surely = leads_nearer(patch, hand, &entry, shift, here)?;
    work.charge(VISIT);
    let there = search(patch, hand, &entry, work);
    let (p, q) = hand.in_patch(entry.cell);
    let (mut nearer, noise) = gain(here, &there, (p, q), shift);
    let mut least = LEAST_WAY;
    if surely {
        (nearer, least) = (nearer.max(0.0), 0.0);
    }
    // Along a shared edge this patch has done its best already.
    let way = [there.u - entry.u, there.v - entry.v];
    let moved = (0..2).any(|axis| shift[axis] != 0 && way[axis].abs() > least);
    let [east, north] = shift.map(|step| step as f32);
    let toward = east * (p - entry.u) + north * (q - entry.v);
    ((moved && nearer >= -noise) || nearer > noise).then_some(Offer {
        entry,
        there,
        gain: (nearer, noise),
        toward,
    })
}

/// Whether the distance falls from a point of a patch's border into the patch:
/// surely, from `here` on, perhaps, or not at all; `shift` is the way in.
///
/// Along the border itself the patch on the other side has done its best.
fn leads_nearer(
    patch: &Patch,
    hand: &Hand,
    entry: &Spot,
    shift: [i32; 2],
    here: &Nearest,
) -> Option<bool> {
    let (p, q) = hand.in_patch(entry.cell);
    let (u, v) = (entry.u, entry.v);
    let z = patch.height(u, v);
    // Of a far hand much is beside an edge, and only where it is as high as that.
    let beside = [here.u - shift[0] as f32 - u, here.v - shift[1] as f32 - v];
    let beside = beside[0].abs().max(beside[1].abs()) > BESIDE * RESOLUTION;
    if beside && (here.z - z).abs() > BESIDE * (resolution(p) + resolution(q)) {
        return None;
    }
    let (zu, zv) = (patch.slope_u(v), patch.slope_v(u));
    // Up a wall, the last place of a coordinate is a lot of height; across the
    // border there is none, the place is on it.
    let size = patch.corners.map(f32::abs);
    let heights = Patch {
        corners: size,
        ..*patch
    };
    let along = |way: i32, slope: f32| if way == 0 { slope.abs() } else { 0.0 };
    let rounding = heights.height(u, v) + along(shift[0], zu) + along(shift[1], zv);
    // Up a wall beside the edge it is another place that the distance falls from.
    let from_here = (here.z - z).abs() < BESIDE * RESOLUTION * (1.0 + z.abs());
    let falls = |way: i32, off: f32, slope: f32| {
        let gradient = way as f32 * (off + z * slope);
        let noise = NOISE * (off.abs() + rounding * slope.abs());
        (way != 0 && gradient <= noise).then_some(from_here && gradient < -noise)
    };
    falls(shift[0], u - p, zu).max(falls(shift[1], v - q, zv))
}

/// By how much the squared distance from a hand at `(p, q)` is less `there` than
/// `here`, `shift` patches before it, and the rounding of that.
///
/// The difference of the squares by their factors: of a far hand the squares
/// themselves would tell nothing.
fn gain(here: &Nearest, there: &Nearest, (p, q): (f32, f32), shift: [i32; 2]) -> (f32, f32) {
    let (u, v) = (here.u - shift[0] as f32, here.v - shift[1] as f32);
    let (du, dv, dz) = (u - there.u, v - there.v, here.z - there.z);
    let (east, north, up) = (
        u + there.u - 2.0 * p,
        v + there.v - 2.0 * q,
        here.z + there.z,
    );
    let gain = du * east + dv * north + dz * up;
    let noise = RESOLUTION * (east.abs() + north.abs() + up * up);
    (gain, noise)
}
