//! A tick of a proxy on the surface, and of one that lost it.

use super::departures::count_departure;
use super::{Contact, Phase, Sweeping, Turn};
use crate::contact::boundary_fade::{self, approach};
use crate::contact::budget::Budget;
use crate::contact::closest_point::{Ended, Leave, position_on};
use crate::contact::output::{ContactOutput, ContactState};
use crate::contact::settings::{Execution, Rule};
use crate::contact::shortcut::Follow;
use crate::contact::surface::HipView;
use crate::contact::sweep::Path;
use crate::grid::{Cell, GridPoint};
use crate::terrain::{TileIndex, Window};

impl Contact {
    /// On the surface: downhill to the closest point.
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
        let is_paper = self.settings.rule == Rule::Paper;
        let leave = if is_paper { &Leave::Nowhere } else { &on.leave };
        let waits = self.settings.execution == Execution::LockStep;
        match on.descent.advance(window, &view, leave, waits, budget) {
            Ended::Rests if is_paper => self.decides(window, &view, hip),
            Ended::Rests => self.touches(window, hip, true, None),
            Ended::Missing(tile) => self.touches(window, hip, false, Some(tile)),
            Ended::Suspended => self.touches(window, hip, false, None),
            Ended::Leaves => self.leaves(window, &view, hip),
            Ended::Lost(_) if is_paper => self.becomes_free(hip),
            // The window gave up the proxy's tile. Until it comes back no tick counts.
            Ended::Lost(Some(tile)) if waits => {
                (self.output.converged, self.output.missing_tile) = (false, Some(tile));
                Turn::Ends
            }
            Ended::Lost(tile) => {
                let turn = self.loses_contact(window, hip);
                self.output.missing_tile = self.output.missing_tile.or(tile);
                turn
            }
        }
    }

    /// From the surface into the air, straight to the HIP. The path begins at the
    /// nearest point that is known: that of the patch which was entered, if the proxy
    /// leaves on the border of it.
    #[inline(never)]
    fn leaves<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        hip: GridPoint,
    ) -> Turn {
        let Phase::OnSurface(on) = &mut self.phase else {
            return Turn::Ends;
        };
        // The descent has just stood on a patch there.
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

    /// The answer in contact, faded where the surface ends.
    pub(super) fn touches<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        mut converged: bool,
        mut missing_tile: Option<TileIndex>,
    ) -> Turn {
        let is_real_time = self.settings.execution == Execution::RealTime;
        let most = boundary_fade::RATE_PER_S * self.settings.rate.tick_s();
        let view = HipView::new(hip);
        let Phase::OnSurface(on) = &mut self.phase else {
            return Turn::Ends;
        };
        let Some((point, z)) = on.descent.nearest(window, &view) else {
            return Turn::Ends;
        };
        let mut may_follow = self.settings.shortcuts && self.settings.rule == Rule::Swept;
        if converged || is_real_time {
            let over = self.rubbing.as_ref().map_or(&hip, |rubbing| &rubbing.hip);
            let target = boundary_fade::target(window, over, point.cell);
            may_follow &= target.over_patch;
            if let (Some(tile), false) = (target.missing, is_real_time) {
                (converged, missing_tile) = (false, Some(tile));
            } else {
                on.fade = approach(on.fade, target.fade, most);
                if on.fade == 0.0 && target.fade == 0.0 {
                    // The HIP may be above the surface already; to look now and not in
                    // the next tick is what makes a missing tile leave no trace.
                    return self.looks_around(window, hip);
                }
            }
        }
        let displacement = view.displacement(&point, z) * on.fade;
        // A proxy that has stayed in its patch is likely to stay for another tick.
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
        // Field by field: a whole answer would be made elsewhere first, and copied.
        self.output.state = ContactState::Touching;
        self.output.proxy = view.position(&point, z);
        self.output.displacement = displacement;
        self.output.converged = converged;
        self.output.missing_tile = missing_tile;
        Turn::Ends
    }

    /// The contact is lost: what was felt fades away where it was.
    pub(super) fn loses_contact<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
    ) -> Turn {
        let Some((proxy, displacement)) = self.felt else {
            return self.looks_around(window, hip);
        };
        self.phase = Phase::Fading {
            proxy,
            displacement,
            fade: 1.0,
        };
        self.fades_out(window, hip)
    }

    /// A tick of fading out.
    pub(super) fn fades_out<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
    ) -> Turn {
        let most = boundary_fade::RATE_PER_S * self.settings.rate.tick_s();
        if let Phase::Fading {
            proxy,
            displacement,
            fade,
        } = &mut self.phase
        {
            *fade = approach(*fade, 0.0, most);
            if *fade > 0.0 {
                self.output = ContactOutput {
                    state: ContactState::Fading,
                    proxy: *proxy,
                    displacement: *displacement * *fade,
                    converged: true,
                    ..ContactOutput::default()
                };
                return Turn::Ends;
            }
        }
        self.looks_around(window, hip)
    }
}
