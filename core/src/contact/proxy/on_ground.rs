//! A tick of a proxy on the surface, and of one whose surface has ended.

use glam::Vec3;

use super::departures::count_departure;
use super::{Contact, Phase, Sweeping, TickProgress};
use crate::contact::budget::Budget;
use crate::contact::closest_point::{DescentEnd, position_on};
use crate::contact::edge_fade::{self, approach};
use crate::contact::fast_path::PatchFollower;
use crate::contact::output::{ContactOutput, ContactState};
use crate::contact::surface::{HipView, SurfacePoint};
use crate::contact::sweep::Path;
use crate::grid::{Cell, GridPoint};
use crate::terrain::Window;

/// Progress of a proxy on the surface in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Completion {
    /// Nothing is left to do.
    Converged,
    /// The proxy is beside a missing tile.
    MissingTile,
    /// The budget is spent.
    Suspended,
}

/// The touched point of the surface.
pub(super) struct SurfaceContact {
    pub(super) point: SurfacePoint,
    /// Position of the proxy.
    pub(super) proxy: GridPoint,
    /// Vector from the HIP to it, cells.
    pub(super) displacement: Vec3,
}

impl Contact {
    /// Moves downhill on the surface to the closest point.
    #[inline]
    pub(super) fn descend<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> TickProgress {
        let Phase::OnSurface(on) = &mut self.phase else {
            return TickProgress::Done;
        };
        let view = HipView::new(hip);
        match on
            .descent
            .advance(window, &view, &on.departure_rule, budget)
        {
            DescentEnd::AtRest => self.touch(window, hip, Completion::Converged, budget),
            DescentEnd::MissingTile => self.touch(window, hip, Completion::MissingTile, budget),
            DescentEnd::Suspended => self.touch(window, hip, Completion::Suspended, budget),
            DescentEnd::Departure => self.depart(window, &view, hip),
            DescentEnd::Lost => self.release(window, hip, budget),
        }
    }

    /// Leaves the surface for the air, straight to the HIP. The path begins at the nearest point
    /// found: in the entered patch, if the proxy leaves on its border.
    #[inline(never)]
    pub(super) fn depart<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        hip: GridPoint,
    ) -> TickProgress {
        let Phase::OnSurface(on) = &mut self.phase else {
            return TickProgress::Done;
        };
        // The descent has just evaluated a patch there.
        let nearest = on.descent.nearest(window, view);
        let from = nearest.and_then(|(point, _)| position_on(window, &point));
        let from = from.unwrap_or(self.output.proxy);
        let mut departures = on.departures;
        count_departure(&mut departures, from, view);
        self.phase = Phase::Sweeping(Sweeping {
            path: Path::off_surface(from, hip),
            was_late: false,
            fade: on.fade,
            departures,
        });
        TickProgress::Continue
    }

    /// Sets the output in contact at the nearest point found, faded where the surface ends.
    pub(super) fn touch<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        completion: Completion,
        budget: &mut Budget,
    ) -> TickProgress {
        let view = HipView::new(hip);
        let Phase::OnSurface(on) = &self.phase else {
            return TickProgress::Done;
        };
        let Some((point, z)) = on.descent.nearest(window, &view) else {
            return TickProgress::Done;
        };
        if self.friction.is_some() {
            return self.touch_with_friction(window, hip, point, completion, budget);
        }
        let touched = SurfaceContact {
            point,
            proxy: view.position(&point, z),
            displacement: view.displacement(&point, z),
        };
        self.touch_at(window, hip, touched, completion, budget)
    }

    /// Sets the output in contact, faded where the surface ends.
    pub(super) fn touch_at<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        touched: SurfaceContact,
        completion: Completion,
        budget: &mut Budget,
    ) -> TickProgress {
        let max_change = edge_fade::RATE_PER_S * self.settings.rate.tick_s();
        let Phase::OnSurface(on) = &mut self.phase else {
            return TickProgress::Done;
        };
        let point = touched.point;
        let mut may_follow = self.settings.fast_paths;
        // A suspended tick is not a whole tick, so the fade does not move.
        if completion != Completion::Suspended {
            let target = edge_fade::target(window, &hip, point.cell, budget);
            may_follow &= target.over_patch;
            on.fade = approach(on.fade, target.fade, max_change);
            if on.fade == 0.0 && target.fade == 0.0 {
                // The HIP may be above the surface already.
                return self.try_seed(window, hip, budget);
            }
        }
        let converged = completion == Completion::Converged;
        let displacement = touched.displacement * on.fade;
        // A proxy that stayed in its patch is likely to stay for another tick.
        let [x, y, _] = self.output.proxy.cell();
        let stayed = point.cell == Cell::new(x, y);
        if converged
            && on.fade == 1.0
            && stayed
            && may_follow
            && let Some(follower) = PatchFollower::new(window, point, hip.column())
        {
            on.follower = Some(follower);
        }
        // Field by field: a whole struct would be built elsewhere and copied.
        self.output.state = ContactState::Touching;
        self.output.proxy = touched.proxy;
        self.output.displacement = displacement;
        self.output.converged = converged;
        TickProgress::Done
    }

    /// Ends the contact: its last force fades out in place.
    pub(super) fn release<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> TickProgress {
        let Some((proxy, displacement)) = self.last_touch else {
            return self.try_seed(window, hip, budget);
        };
        self.phase = Phase::Releasing {
            proxy,
            displacement,
            fade: 1.0,
        };
        self.fade_out(window, hip, budget)
    }

    /// Runs a tick of the fade-out.
    pub(super) fn fade_out<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> TickProgress {
        let max_change = edge_fade::RATE_PER_S * self.settings.rate.tick_s();
        if let Phase::Releasing {
            proxy,
            displacement,
            fade,
        } = &mut self.phase
        {
            *fade = approach(*fade, 0.0, max_change);
            if *fade > 0.0 {
                self.output = ContactOutput {
                    state: ContactState::Releasing,
                    proxy: *proxy,
                    displacement: *displacement * *fade,
                    converged: true,
                    ..ContactOutput::default()
                };
                return TickProgress::Done;
            }
        }
        self.try_seed(window, hip, budget)
    }
}
