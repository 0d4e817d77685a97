//! The closest point of the surface to the HIP: downhill in the distance, from
//! patch to patch (paper §4.3.2, made exact at edges and vertices).

use super::beyond_border::{ClosestHere, Continuation, NeighbourSearch, to_steepest_patch};
use super::on_convex_patch::PatchPoint;
use super::on_patch::{Nearest, search};
use crate::contact::budget::{BORDER_ENTRY, Budget, CONVEX, PATCH_ENTRY};
use crate::contact::surface::patch::Patch;
use crate::contact::surface::{HipView, Side, SurfacePoint};
use crate::contact::tolerance::HEIGHT_NOISE;
use crate::grid::{Altitude, Cell, GridPoint};
use crate::terrain::{CellContent, Window};

/// Number of patches entered in a row without getting nearer to the HIP after which the descent
/// ends: on a wall, rounding may send it back and forth.
const MAX_IDLE_PATCHES: u32 = 16;

/// End of a descent.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) enum DescentEnd {
    /// No direction on the surface leads closer to the HIP, which is below; or [`MAX_IDLE_PATCHES`]
    /// patches in a row brought the proxy no nearer; or the proxy must not leave.
    AtRest,
    /// From here the straight path to the HIP leads off the surface.
    Departure,
    /// The next patch is in a missing tile.
    MissingTile,
    /// The budget is spent.
    Suspended,
    /// The surface under the proxy no longer exists.
    Lost,
}

/// Places at which a proxy may leave the surface.
#[derive(Clone, Copy, Debug)]
pub(in crate::contact) enum DepartureRule {
    /// Anywhere.
    Anywhere,
    /// Anywhere else: a departure from here ended on the surface at once.
    ExceptAt(SurfacePoint),
    /// Nowhere: there were too many departures. The proxy last hit the surface here, above the HIP.
    Forbidden(SurfacePoint),
}

impl DepartureRule {
    /// Returns true if the proxy may leave at a point.
    #[inline]
    pub(in crate::contact) fn is_allowed_at(&self, point: &SurfacePoint) -> bool {
        match self {
            Self::Anywhere => true,
            Self::ExceptAt(place) => !point.is_same_place(place),
            Self::Forbidden(_) => false,
        }
    }
}

/// A proxy's path downhill to one HIP.
///
/// It can be suspended after any operation and resumed later with the same bits: each step
/// depends only on this state, the terrain and the HIP.
#[derive(Clone, Debug)]
pub(in crate::contact) struct Descent {
    /// Point of entry into the patch; later its closest point.
    at: SurfacePoint,
    stage: Stage,
    /// The patch's closest point, in the stages after it is computed.
    here: Nearest,
    neighbours: NeighbourSearch,
    /// The nearest place until now, and the number of patches entered since then.
    idle: Option<(GridPoint, u32)>,
}

/// Next stage of the descent in a patch. Its data are separate, in [`Descent`]: rewriting them for
/// every patch would cost more than the search.
#[derive(Clone, Copy, Debug)]
enum Stage {
    /// The patch was entered.
    Entered,
    /// The patch was entered, and its closest point is computed.
    EnteredWithClosest,
    /// The neighbours are searched.
    SearchingNeighbours,
}

impl Descent {
    /// Creates a descent from a point of the surface.
    pub(in crate::contact) const fn from(at: SurfacePoint) -> Self {
        Self {
            at,
            stage: Stage::Entered,
            here: Nearest::NONE,
            neighbours: NeighbourSearch::NONE,
            idle: None,
        }
    }

    /// Restarts the descent from a point of the surface, for another HIP.
    pub(in crate::contact) const fn restart(&mut self, at: SurfacePoint) {
        self.at = at;
        self.stage = Stage::Entered;
        self.idle = None;
    }

    /// Restarts the descent from a point inside a patch at which the proxy surely does not leave
    /// the surface, with the patch's closest point to the other HIP. Counts the work as if it were
    /// done here, so that the budget ends at the same place.
    pub(in crate::contact) fn restart_with_closest(
        &mut self,
        at: SurfacePoint,
        closest: PatchPoint,
        budget: &mut Budget,
    ) {
        #[cfg(test)]
        crate::contact::stats::searched(1);
        budget.spend(PATCH_ENTRY + CONVEX);
        self.restart(at);
        self.here = Nearest::from_convex(closest);
        self.start_neighbour_search();
    }

    /// Returns the start of the descent, or the last point of entry into a patch.
    pub(in crate::contact) const fn entry(&self) -> SurfacePoint {
        self.at
    }

    /// Returns the cell of the proxy's patch.
    pub(in crate::contact) const fn cell(&self) -> Cell {
        self.at.cell
    }

    /// Returns the nearest point found until now and its height above the HIP; `None` if its patch
    /// does not exist.
    #[inline]
    pub(in crate::contact) fn nearest<const D: usize>(
        &self,
        window: &Window<'_, D>,
        view: &HipView,
    ) -> Option<(SurfacePoint, f32)> {
        if matches!(
            self.stage,
            Stage::SearchingNeighbours | Stage::EnteredWithClosest
        ) {
            let at = self.at.moved_to(self.here.u, self.here.v);
            return Some((at, self.here.z));
        }
        self.nearest_at_entry(window, view)
    }

    /// Does the same as [`Self::nearest`], in the stages before the patch's closest point is
    /// computed.
    #[inline(never)]
    fn nearest_at_entry<const D: usize>(
        &self,
        window: &Window<'_, D>,
        view: &HipView,
    ) -> Option<(SurfacePoint, f32)> {
        let patch = patch_at(window, view, &self.at)?;
        Some((self.at, patch.height(self.at.u, self.at.v)))
    }

    /// Continues until the proxy rests, leaves, or has to wait.
    pub(in crate::contact) fn advance<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        departure_rule: &DepartureRule,
        budget: &mut Budget,
    ) -> DescentEnd {
        // Not by `patch_at`: a call would cost 20 more instructions.
        let cell = self.at.cell;
        let mut patch = match window.ground(cell) {
            CellContent::Patch(corners) => view.patch(&corners),
            CellContent::NoData => return DescentEnd::Lost,
            CellContent::Missing => {
                budget.record_missing(cell);
                return DescentEnd::Lost;
            }
        };
        loop {
            if matches!(self.stage, Stage::Entered | Stage::EnteredWithClosest)
                && let Some(end) =
                    self.find_closest(window, view, &mut patch, departure_rule, budget)
            {
                return end;
            }
            let start = ClosestHere {
                at: &self.at,
                here: &self.here,
            };
            let is_resumed = self.neighbours.best.is_some();
            match (self.neighbours).advance(window, view, &start, &mut patch, budget) {
                Continuation::Neighbour => {
                    if let Some(end) = self.enter(window, view, departure_rule) {
                        return end;
                    }
                    if is_resumed {
                        // The best neighbour may have been found in an earlier tick.
                        patch = match patch_at(window, view, &self.at) {
                            Some(patch) => patch,
                            None => return DescentEnd::Lost,
                        };
                    }
                }
                Continuation::MissingTile => return DescentEnd::MissingTile,
                Continuation::Suspended => return DescentEnd::Suspended,
                Continuation::LocalMinimum => {
                    return self.end_at_minimum(window, view, &patch, departure_rule);
                }
            }
        }
    }

    /// Checks, for an entered patch, whether the path leaves the surface there; if not, finds the
    /// patch's closest point.
    fn find_closest<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        patch: &mut Patch,
        departure_rule: &DepartureRule,
        budget: &mut Budget,
    ) -> Option<DescentEnd> {
        let is_closest_known = matches!(self.stage, Stage::EnteredWithClosest);
        let border = self.at.border();
        let on_border = !is_closest_known && border != Side::NONE;
        let units = if on_border { BORDER_ENTRY } else { PATCH_ENTRY };
        if !budget.has(units) {
            return Some(DescentEnd::Suspended);
        }
        budget.spend(units);
        if departure_rule.is_allowed_at(&self.at)
            && path_leaves_surface(window, view, &self.at, border, patch)
        {
            return Some(DescentEnd::Departure);
        }
        if is_closest_known {
            self.start_neighbour_search();
            return None;
        }
        if on_border {
            to_steepest_patch(window, view, border, &mut self.at, patch, budget);
        }
        let hip = view.in_patch(self.at.cell);
        let Some(here) = search(patch, hip, (self.at.u, self.at.v), budget) else {
            return Some(DescentEnd::Suspended);
        };
        self.here = here;
        self.start_neighbour_search();
        None
    }

    /// Continues with the neighbours once the patch's closest point is computed.
    #[inline]
    const fn start_neighbour_search(&mut self) {
        self.at = self.at.moved_to(self.here.u, self.here.v);
        self.neighbours.restart();
        self.stage = Stage::SearchingNeighbours;
    }

    /// Continues in a neighbouring patch, whose closest point is computed.
    fn enter<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        departure_rule: &DepartureRule,
    ) -> Option<DescentEnd> {
        let Some(candidate) = &self.neighbours.best else {
            return Some(DescentEnd::AtRest);
        };
        // After one patch was entered without gain, only the nearest place of all counts.
        if self.idle.is_some() || !candidate.is_surely_nearer {
            let position = position(window, view, &self.at, self.here.z);
            if count_unless_nearer(&mut self.idle, position, view) >= MAX_IDLE_PATCHES {
                return Some(self.end_at_rest(departure_rule));
            }
        }
        self.at = candidate.entry;
        self.here = candidate.closest;
        self.stage = Stage::EnteredWithClosest;
        None
    }

    /// Ends the descent where no neighbour offers a continuation.
    fn end_at_minimum<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        patch: &Patch,
        departure_rule: &DepartureRule,
    ) -> DescentEnd {
        let z = self.here.z;
        if !departure_rule.is_allowed_at(&self.at) {
            return self.end_at_rest(departure_rule);
        }
        let departs = is_hardly_above(patch, z)
            && (z < 0.0 || path_leaves_surface(window, view, &self.at, self.at.border(), patch));
        if departs {
            DescentEnd::Departure
        } else {
            DescentEnd::AtRest
        }
    }

    /// Rests, but not below the HIP if the proxy must not leave any more: there the force would
    /// pull. A patch's closest point may lie there; the place where the proxy last hit the surface
    /// does not.
    #[inline(never)]
    fn end_at_rest(&mut self, departure_rule: &DepartureRule) -> DescentEnd {
        if let DepartureRule::Forbidden(last_hit) = departure_rule
            && self.here.z < 0.0
        {
            self.restart(*last_hit);
        }
        DescentEnd::AtRest
    }
}

/// Returns the patch of a point, relative to the HIP.
fn patch_at<const D: usize>(
    window: &Window<'_, D>,
    view: &HipView,
    point: &SurfacePoint,
) -> Option<Patch> {
    match window.ground(point.cell) {
        CellContent::Patch(corners) => Some(view.patch(&corners)),
        CellContent::NoData | CellContent::Missing => None,
    }
}

/// Returns true if a proxy that rests `z` cells above the HIP may really be below it because of
/// rounding on a wall, where the force would pull.
fn is_hardly_above(patch: &Patch, z: f32) -> bool {
    let [sw, se, nw, ne] = patch.with_sizes().corners;
    z <= HEIGHT_NOISE * ((sw + se) + (nw + ne))
}

/// Returns true if the straight path from a point on this border of its patch to the HIP begins
/// above the surface, that is, above the one-sided slope of the patch that it enters.
#[inline(always)]
fn path_leaves_surface<const D: usize>(
    window: &Window<'_, D>,
    view: &HipView,
    at: &SurfacePoint,
    border: Side,
    patch: &Patch,
) -> bool {
    let (p, q) = view.in_patch(at.cell);
    let (east, north) = (p - at.u, q - at.v);
    let side = border.toward((p, q), (at.u, at.v));
    if side == Side::NONE {
        return is_above_tangent_plane(patch, at, (east, north));
    }
    path_leaves_entered_patch(window, view, &at.across(side), (east, north))
}

/// Does the same in the patch that the path enters, for a HIP `east` and `north` of the point.
#[inline(never)]
fn path_leaves_entered_patch<const D: usize>(
    window: &Window<'_, D>,
    view: &HipView,
    entered: &SurfacePoint,
    offset: (f32, f32),
) -> bool {
    match window.ground(entered.cell) {
        CellContent::Patch(corners) => {
            is_above_tangent_plane(&view.patch(&corners), entered, offset)
        }
        // At the border of the data the proxy does not leave; see `edge_fade`.
        CellContent::NoData | CellContent::Missing => false,
    }
}

/// Returns true if the HIP, `east` and `north` of a point, lies above the tangent plane of the
/// patch there.
#[inline]
pub(in crate::contact) fn is_above_tangent_plane(
    patch: &Patch,
    at: &SurfacePoint,
    (east, north): (f32, f32),
) -> bool {
    let rise = patch.slope_u(at.v) * east + patch.slope_v(at.u) * north;
    patch.height(at.u, at.v) + rise < 0.0
}

/// Returns the position of a point of the surface, exact for any distance of the HIP; `None` if
/// there is no patch.
pub(in crate::contact) fn position_on<const D: usize>(
    window: &Window<'_, D>,
    at: &SurfacePoint,
) -> Option<GridPoint> {
    let CellContent::Patch(corners) = window.ground(at.cell) else {
        return None;
    };
    // Heights are relative to a nearby cell: at a large height the fraction would lose its bits.
    let patch = Patch::new(corners.heights);
    let up = corners.base.saturating_add(patch.height(at.u, at.v) as i32);
    let near = patch.relative_to(Altitude::new(up, 0.0), corners.base);
    Some(at.position(up, near.height(at.u, at.v)))
}

/// Returns the position of a point of the surface, `z` cells above the HIP. On a wall `z` is more
/// exact than the patch's height at the place; with a far HIP it is less exact.
fn position<const D: usize>(
    window: &Window<'_, D>,
    view: &HipView,
    at: &SurfacePoint,
    z: f32,
) -> GridPoint {
    let steep = patch_at(window, view, at).map_or(f32::INFINITY, |patch| {
        patch.slope_u(at.v).abs() + patch.slope_v(at.u).abs()
    });
    position_on(window, at)
        .filter(|_| z.abs() > steep)
        .unwrap_or_else(|| view.position(at, z))
}

/// Counts the positions in a row that are no nearer to the HIP than the nearest one until now,
/// which is stored in `nearest`.
fn count_unless_nearer(
    nearest: &mut Option<(GridPoint, u32)>,
    position: GridPoint,
    view: &HipView,
) -> u32 {
    match nearest {
        Some((before, times)) if !view.is_nearer(&position, before) => {
            *times += 1;
            *times
        }
        _ => {
            *nearest = Some((position, 0));
            0
        }
    }
}
