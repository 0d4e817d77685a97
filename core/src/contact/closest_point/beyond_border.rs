//! Continuation of the descent from a point of a patch's border.
//!
//! The distance to the HIP has a slope into each patch that meets there. The descent continues into
//! the patch with the steepest slope, so that a mirrored scene results in the mirrored patch. The
//! neighbour's closest point is computed before the proxy enters it.

use super::on_patch::{Nearest, finest_resolution, resolution, search};
use crate::contact::budget::{Budget, SLOPE};
use crate::contact::surface::patch::Patch;
use crate::contact::surface::{HipView, Side, SurfacePoint};
use crate::contact::tolerance::{
    BESIDE, COARSEST_RESOLUTION, EQUALLY_STEEP, MIN_DISPLACEMENT, RESOLUTION, SLOPE_NOISE,
};
use crate::scalar::{larger, smaller};
use crate::terrain::{CellContent, Window};

/// Continuation of the descent from the closest point of a patch.
pub(super) enum Continuation {
    /// Into a neighbouring patch, as [`NeighbourSearch::best`] has it.
    Neighbour,
    /// The descent may continue in a missing tile.
    MissingTile,
    /// The budget is spent.
    Suspended,
    /// Nowhere: the point is a local minimum of the distance.
    LocalMinimum,
}

/// Candidate of a neighbouring patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// Place where the path enters the neighbour.
    pub(super) entry: SurfacePoint,
    /// The neighbour's closest point.
    pub(super) closest: Nearest,
    /// Reduction of the squared distance, cells².
    gain: f32,
    /// Rounding error of `gain`.
    noise: f32,
    /// True if the reduction exceeds the rounding of both points.
    pub(super) is_surely_nearer: bool,
    /// Distance of the HIP in that direction, cells: of two equal directions, the one toward the
    /// HIP is chosen, so that rotation of the scene does not matter.
    toward: f32,
    /// Steepness of the distance into the neighbour: the squared slope of half the squared
    /// distance, cells².
    steepness: f32,
}

impl Candidate {
    fn is_better_than(&self, other: &Self) -> bool {
        let (more, noise) = (self.gain - other.gain, self.noise + other.noise);
        more > noise || (more >= -noise && self.toward > other.toward)
    }
}

/// A neighbour into which the distance falls.
// Filled in place: moving an `Option` would cost 150 instructions.
struct Neighbour {
    side: Side,
    entry: SurfacePoint,
    patch: Patch,
    /// Squared slope of half the squared distance into it, cells²; 0 if rounding hides the slope,
    /// below 0 if there is no such neighbour.
    steepness: f32,
    /// Steepness into the next less steep neighbour.
    runner_up: f32,
    /// The neighbour's bit in [`NeighbourSearch::searched`].
    bit: u8,
}

/// Search of a patch's neighbours, steepest descent first, from the patch's closest point, which is
/// on or beside its border.
#[derive(Clone, Copy, Debug)]
pub(super) struct NeighbourSearch {
    /// Neighbours searched already, one bit each in the order of [`Side::neighbour`].
    searched: u8,
    /// Best candidate.
    pub(super) best: Option<Candidate>,
}

/// ClosestHere of the search: the closest point of a patch.
pub(super) struct ClosestHere<'d> {
    pub(super) at: &'d SurfacePoint,
    pub(super) here: &'d Nearest,
}

impl NeighbourSearch {
    /// State before any neighbour is searched.
    pub(super) const NONE: Self = Self {
        searched: 0,
        best: None,
    };

    /// Clears the searched neighbours.
    #[inline]
    pub(super) const fn restart(&mut self) {
        self.searched = 0;
        self.best = None;
    }

    /// Searches until the downhill direction is determined. Sets `patch` to the patch of a best
    /// candidate found in this call.
    #[inline]
    pub(super) fn advance<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        start: &ClosestHere<'_>,
        patch: &mut Patch,
        budget: &mut Budget,
    ) -> Continuation {
        // On a wall a proxy may be beside the edge without being on it.
        let (p, q) = view.in_patch(start.at.cell);
        let beside = |hip: f32| smaller(BESIDE * finest_resolution(hip), COARSEST_RESOLUTION);
        let border = start.at.border_within([beside(p), beside(q)]);
        if border == Side::NONE {
            return Continuation::LocalMinimum;
        }
        self.search_neighbours(window, view, start, border, patch, budget)
    }

    // The arguments are borrowed from several places.
    #[allow(clippy::too_many_arguments)]
    #[inline(never)]
    fn search_neighbours<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        start: &ClosestHere<'_>,
        border: Side,
        patch: &mut Patch,
        budget: &mut Budget,
    ) -> Continuation {
        loop {
            let mut next = Neighbour {
                side: Side::NONE,
                entry: *start.at,
                patch: *patch,
                steepness: -1.0,
                runner_up: -1.0,
                bit: 0,
            };
            if let Err(why) = self.steepest(window, view, start, border, budget, &mut next) {
                return why;
            }
            if next.steepness < 0.0 {
                break;
            }
            if self.has_steeper_than(next.steepness) {
                break;
            }
            let hip = view.in_patch(next.entry.cell);
            let start_at = (next.entry.u, next.entry.v);
            let Some(closest) = search(&next.patch, hip, start_at, budget) else {
                return Continuation::Suspended;
            };
            self.searched |= next.bit;
            if let Some(candidate) = candidate(&next, hip, start.here, closest)
                && self
                    .best
                    .as_ref()
                    .is_none_or(|best| candidate.is_better_than(best))
            {
                self.best = Some(candidate);
                *patch = next.patch;
            }
            if self.has_steeper_than(next.runner_up) {
                break; // the others need not be evaluated again
            }
        }
        if self.best.is_some() {
            Continuation::Neighbour
        } else {
            Continuation::LocalMinimum
        }
    }

    /// Returns true if the best candidate's descent is steeper than `steepness`.
    #[inline]
    fn has_steeper_than(&self, steepness: f32) -> bool {
        let is_steeper = |best: &Candidate| steepness < best.steepness * (1.0 - EQUALLY_STEEP);
        self.best.as_ref().is_some_and(is_steeper)
    }

    /// Sets `next` to the unsearched neighbour with the steepest descent.
    ///
    /// # Errors
    /// The reason why that neighbour is not available in this tick.
    // Not inlined, and fills `next` in place: otherwise its fields are copied back and forth.
    #[inline(never)]
    fn steepest<const D: usize>(
        &self,
        window: &Window<'_, D>,
        view: &HipView,
        start: &ClosestHere<'_>,
        border: Side,
        budget: &mut Budget,
        next: &mut Neighbour,
    ) -> Result<(), Continuation> {
        for index in 0..3 {
            let (side, bit) = (border.neighbour(index), 1 << index);
            if side == Side::NONE || self.searched & bit != 0 {
                continue;
            }
            if !budget.has(SLOPE) {
                return Err(Continuation::Suspended);
            }
            budget.spend(SLOPE);
            let entry = start.at.across(side);
            let patch = match window.ground(entry.cell) {
                CellContent::NoData => continue,
                // This might be the steepest neighbour: the proxy waits for its tile.
                CellContent::Missing => {
                    budget.record_missing(entry.cell);
                    return Err(Continuation::MissingTile);
                }
                CellContent::Patch(corners) => view.patch(&corners),
            };
            let Some(steepness) = steepness_into(&patch, view, &entry, side, start.here) else {
                continue;
            };
            if steepness > next.steepness {
                *next = Neighbour {
                    side,
                    entry,
                    patch,
                    steepness,
                    runner_up: next.steepness,
                    bit,
                };
            } else if steepness > next.runner_up {
                next.runner_up = steepness;
            }
        }
        Ok(())
    }
}

/// Returns the steepness of the distance from a point of a patch's border into the patch: the
/// squared slope of half the squared distance, cells²; 0 if rounding hides it; `None` if the
/// distance does not fall. `side` is the direction into the patch.
///
/// Along the border the patch on the other side is at its minimum already, so only the direction
/// across the border counts.
fn steepness_into(
    patch: &Patch,
    view: &HipView,
    entry: &SurfacePoint,
    side: Side,
    here: &Nearest,
) -> Option<f32> {
    let (p, q) = view.in_patch(entry.cell);
    let (u, v) = (entry.u, entry.v);
    let z = patch.height(u, v);
    // With a far HIP, a place may count as beside the edge at a large distance; accept it only if
    // its height agrees with the edge's.
    let beside = [
        here.u - side.east as f32 - u,
        here.v - side.north as f32 - v,
    ];
    let far = BESIDE * RESOLUTION;
    let is_beside = beside[0].abs() > far || beside[1].abs() > far;
    if is_beside && (here.z - z).abs() > BESIDE * (resolution(p) + resolution(q)) {
        return None;
    }
    let (zu, zv) = (patch.slope_u(v), patch.slope_v(u));
    // On a wall, the last place of a coordinate is worth much height. Not so across the border,
    // where the place is exact.
    let sizes = patch.with_sizes();
    let along = |direction: i32, slope: f32| if direction == 0 { slope.abs() } else { 0.0 };
    let rounding = sizes.height(u, v) + along(side.east, zu) + along(side.north, zv);
    // On a wall, a place beside the edge may have another slope than the edge. For a place on the
    // edge the slope is valid, although the last place of its coordinate is worth much height.
    let is_on_edge = beside == [0.0, 0.0];
    let from_here = is_on_edge || (here.z - z).abs() < BESIDE * RESOLUTION * (1.0 + z.abs());
    let steepness_squared = |direction: i32, off: f32, slope: f32| {
        let gradient = direction as f32 * (off + z * slope);
        let noise = SLOPE_NOISE * (off.abs() + rounding * slope.abs());
        let surely = from_here && gradient < -noise;
        (direction != 0 && gradient <= noise).then_some(if surely {
            gradient * gradient
        } else {
            0.0
        })
    };
    match (
        steepness_squared(side.east, u - p, zu),
        steepness_squared(side.north, v - q, zv),
    ) {
        (Some(east), Some(north)) => Some(east + north),
        (east, north) => east.or(north),
    }
}

/// Returns the neighbour's candidate for its closest point `closest`, with the HIP at `hip` in its
/// coordinates; `None` if that is no improvement.
fn candidate(
    next: &Neighbour,
    hip: (f32, f32),
    here: &Nearest,
    closest: Nearest,
) -> Option<Candidate> {
    let Neighbour {
        side,
        entry,
        steepness,
        ..
    } = *next;
    let (mut gain, noise, places) = gain(here, &closest, hip, side);
    let is_surely_nearer = gain > noise && gain > places;
    let mut min_displacement = MIN_DISPLACEMENT;
    if steepness > 0.0 {
        (gain, min_displacement) = (-smaller(-gain, 0.0), 0.0);
    }
    // Along the shared border the patch on the other side is at its minimum already.
    let moves_across =
        |side: i32, from: f32, to: f32| side != 0 && (to - from).abs() > min_displacement;
    let moved =
        moves_across(side.east, entry.u, closest.u) || moves_across(side.north, entry.v, closest.v);
    let toward = side.east as f32 * (hip.0 - entry.u) + side.north as f32 * (hip.1 - entry.v);
    ((moved && gain >= -noise) || gain > noise).then_some(Candidate {
        entry,
        closest,
        gain,
        noise,
        is_surely_nearer,
        toward,
        steepness,
    })
}

/// Returns by how much the squared distance from a HIP at `(p, q)` is smaller at `there` than at
/// `here`, which is in the patch across a border; its rounding error; and the maximum error due to
/// the rounding of both points.
///
/// The difference of squares is computed from its factors: with a far HIP the squares themselves
/// would lose it to rounding.
fn gain(here: &Nearest, there: &Nearest, (p, q): (f32, f32), side: Side) -> (f32, f32, f32) {
    let (u, v) = (here.u - side.east as f32, here.v - side.north as f32);
    let (du, dv, dz) = (u - there.u, v - there.v, here.z - there.z);
    let (east, north, up) = (
        u + there.u - 2.0 * p,
        v + there.v - 2.0 * q,
        here.z + there.z,
    );
    let gain = du * east + dv * north + dz * up;
    let noise = RESOLUTION * (east.abs() + north.abs() + up * up);
    let moved = du.abs() + dv.abs() + dz.abs();
    let left = (there.u - p).abs() + (there.v - q).abs() + there.z.abs();
    (gain, noise, 2.0 * RESOLUTION * (moved + left))
}

/// Moves a point on a border of its patch into the patch, among those that meet there, into which
/// the distance falls most steeply. Does not move it if there is none, or if the tile of one is
/// missing.
#[inline(never)]
pub(super) fn to_steepest_patch<const D: usize>(
    window: &Window<'_, D>,
    view: &HipView,
    border: Side,
    at: &mut SurfacePoint,
    patch: &mut Patch,
    budget: &mut Budget,
) {
    let before = (*at, *patch);
    let mut max_steepness = larger(steepness_at(patch, view.in_patch(at.cell), at, border), 0.0);
    for index in 0..3 {
        let side = border.neighbour(index);
        if side == Side::NONE {
            continue;
        }
        let point = before.0.across(side);
        let its_patch = match window.ground(point.cell) {
            CellContent::NoData => continue,
            CellContent::Missing => {
                budget.record_missing(point.cell);
                (*at, *patch) = before;
                return;
            }
            CellContent::Patch(corners) => view.patch(&corners),
        };
        let steepness = {
            let hip = view.in_patch(point.cell);
            steepness_at(&its_patch, hip, &point, border.across(side))
        };
        if steepness > max_steepness * (1.0 + EQUALLY_STEEP) {
            (*at, *patch, max_steepness) = (point, its_patch, steepness);
        }
    }
}

/// Returns the steepness of the distance to a HIP at `(p, q)` from a point on a border of a
/// patch in the patch's own directions: the squared slope of half the squared distance,
/// cells².
fn steepness_at(patch: &Patch, (p, q): (f32, f32), at: &SurfacePoint, border: Side) -> f32 {
    let z = patch.height(at.u, at.v);
    let east = (at.u - p) + z * patch.slope_u(at.v);
    let north = (at.v - q) + z * patch.slope_v(at.u);
    // On a border only the direction back into the patch counts.
    let steepness_squared = |border: i32, slope: f32| {
        let outward = border as f32 * slope < 0.0;
        if outward { 0.0 } else { slope * slope }
    };
    steepness_squared(border.east, east) + steepness_squared(border.north, north)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::{Nearest, Patch, Side, steepness_into};
    use crate::contact::surface::{HipView, SurfacePoint};
    use crate::grid::{Cell, GridPoint};

    /// Half way up a wall of 300 cells, the last place of a coordinate is worth 10⁻⁵ of height: the
    /// heights of the place and of the entry differ by that much (seed 4243, scene 6738).
    #[test]
    fn steepness_is_valid_on_a_wall_edge_but_not_beside_it() {
        let patch = Patch::new([-150.406_48, 149.704_83, -150.454_4, 149.704_83]);
        let view = HipView::new(GridPoint::new([1, 1, 0], Vec3::new(0.5, 0.0, 0.0)));
        let entry = SurfacePoint {
            cell: Cell::new(0, 1),
            u: 0.501_180_05,
            v: 0.0,
        };
        let side = Side { east: 0, north: 1 };
        let here = |v: f32| Nearest {
            u: entry.u,
            v,
            z: 0.003_328_164_8,
            evaluations: 1,
        };
        let steepness_squared = |v: f32| steepness_into(&patch, &view, &entry, side, &here(v));
        // Slope of half the squared distance: height over the HIP times slope northward.
        let slope = 0.003_328_f32 * 0.0479 * (1.0 - entry.u);
        let steepness = steepness_squared(1.0).expect("it falls");
        assert!(
            (steepness / (slope * slope) - 1.0).abs() < 0.02,
            "{steepness:e}"
        );
        // Beside the edge its slope is not valid.
        assert_eq!(steepness_squared(1.0 - 2e-7), Some(0.0));
    }
}
