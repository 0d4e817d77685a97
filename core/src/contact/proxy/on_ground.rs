//! A tick of a proxy on the surface, and of one whose surface has ended.

use glam::Vec3;

use super::departures::count_departure;
use super::{Contact, Phase, Sweeping, Turn};
use crate::contact::budget::Budget;
use crate::contact::closest_point::{Ended, position_on};
use crate::contact::edge_fade::{self, approach};
use crate::contact::fast_path::Follow;
use crate::contact::output::{ContactOutput, ContactState};
use crate::contact::surface::{HipView, SurfacePoint};
use crate::contact::sweep::Path;
use crate::grid::{Cell, GridPoint};
use crate::terrain::Window;

/// Progress of a proxy on the surface in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Came {
    /// Nothing is left to do.
    ToRest,
    /// The proxy is beside a missing tile.
    ToMissingTile,
    /// The budget is spent.
    AsFarAsWork,
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
    pub(super) fn descends<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        let Phase::OnSurface(on) = &mut self.phase else {
            return Turn::Ends;
        };
        let view = HipView::new(hip);
        match on.descent.advance(window, &view, &on.leave, budget) {
            Ended::Rests => self.touches(window, hip, Came::ToRest, budget),
            Ended::Missing => self.touches(window, hip, Came::ToMissingTile, budget),
            Ended::Suspended => self.touches(window, hip, Came::AsFarAsWork, budget),
            Ended::Leaves => self.leaves(window, &view, hip),
            Ended::Lost => self.loses_contact(window, hip, budget),
        }
    }

    /// Leaves the surface for the air, straight to the HIP. The path begins at the nearest known
    /// point: in the entered patch, if the proxy leaves on its border.
    #[inline(never)]
    pub(super) fn leaves<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        hip: GridPoint,
    ) -> Turn {
        let Phase::OnSurface(on) = &mut self.phase else {
            return Turn::Ends;
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
        Turn::GoesOn
    }

    /// Sets the output in contact at the nearest known point, faded where the surface ends.
    pub(super) fn touches<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        came: Came,
        budget: &mut Budget,
    ) -> Turn {
        let view = HipView::new(hip);
        let Phase::OnSurface(on) = &self.phase else {
            return Turn::Ends;
        };
        let Some((point, z)) = on.descent.nearest(window, &view) else {
            return Turn::Ends;
        };
        if self.rough.is_some() {
            return self.is_held_at(window, hip, point, came, budget);
        }
        let touched = SurfaceContact {
            point,
            proxy: view.position(&point, z),
            displacement: view.displacement(&point, z),
        };
        self.touches_at(window, hip, touched, came, budget)
    }

    /// Sets the output in contact, faded where the surface ends.
    pub(super) fn touches_at<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        touched: SurfaceContact,
        came: Came,
        budget: &mut Budget,
    ) -> Turn {
        let most = edge_fade::RATE_PER_S * self.settings.rate.tick_s();
        let Phase::OnSurface(on) = &mut self.phase else {
            return Turn::Ends;
        };
        let point = touched.point;
        let mut may_follow = self.settings.fast_paths;
        // A suspended tick is not a whole tick, so the fade does not move.
        if came != Came::AsFarAsWork {
            let target = edge_fade::target(window, &hip, point.cell, budget);
            may_follow &= target.over_patch;
            on.fade = approach(on.fade, target.fade, most);
            if on.fade == 0.0 && target.fade == 0.0 {
                // The HIP may be above the surface already.
                return self.looks_around(window, hip, budget);
            }
        }
        let converged = came == Came::ToRest;
        let displacement = touched.displacement * on.fade;
        // A proxy that stayed in its patch is likely to stay for another tick.
        let [x, y, _] = self.output.proxy.cell();
        let stayed = point.cell == Cell::new(x, y);
        if converged
            && on.fade == 1.0
            && stayed
            && may_follow
            && let Some(follow) = Follow::from(window, point, hip.column())
        {
            on.follow = Some(follow);
        }
        // Field by field: a whole struct would be built elsewhere and copied.
        self.output.state = ContactState::Touching;
        self.output.proxy = touched.proxy;
        self.output.displacement = displacement;
        self.output.converged = converged;
        Turn::Ends
    }

    /// Ends the contact: its last force fades out in place.
    pub(super) fn loses_contact<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        let Some((proxy, displacement)) = self.touched else {
            return self.looks_around(window, hip, budget);
        };
        self.phase = Phase::Releasing {
            proxy,
            displacement,
            fade: 1.0,
        };
        self.fades_out(window, hip, budget)
    }

    /// Runs a tick of the fade-out.
    pub(super) fn fades_out<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        let most = edge_fade::RATE_PER_S * self.settings.rate.tick_s();
        if let Phase::Releasing {
            proxy,
            displacement,
            fade,
        } = &mut self.phase
        {
            *fade = approach(*fade, 0.0, most);
            if *fade > 0.0 {
                self.output = ContactOutput {
                    state: ContactState::Releasing,
                    proxy: *proxy,
                    displacement: *displacement * *fade,
                    converged: true,
                    ..ContactOutput::default()
                };
                return Turn::Ends;
            }
        }
        self.looks_around(window, hip, budget)
    }
}
