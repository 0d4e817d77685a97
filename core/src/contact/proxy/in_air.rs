//! A tick of a proxy in the air, which goes straight for the HIP until it meets the surface.

use super::departures::{Departures, may_leave};
use super::{Contact, OnSurface, Phase, Sweeping, Turn};
use crate::contact::budget::Budget;
use crate::contact::output::{ContactOutput, ContactState};
use crate::contact::settings::Execution;
use crate::contact::surface::HipView;
use crate::contact::sweep::{Path, Swept};
use crate::grid::GridPoint;
use crate::terrain::{Ground, TileIndex, Window};

impl Contact {
    /// Waiting ends when the HIP is above the patch it is over, or above everything.
    #[inline(never)]
    pub(super) fn looks_around<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
    ) -> Turn {
        if let Some(landing) = &self.landing {
            let waits = landing.waits();
            return self.answers(waits);
        }
        let view = HipView::new(hip);
        let (cell, ground) = view.ground(window);
        let is_above = view.altitude().cell() >= window.top()
            || matches!(&ground, Ground::Patch(corners) if view.is_above(cell, corners));
        if is_above {
            return self.becomes_free(hip);
        }
        self.phase = Phase::Waiting;
        let is_missing = ground == Ground::Missing;
        self.answers(ContactOutput {
            proxy: hip,
            converged: !is_missing,
            missing_tile: is_missing.then(|| TileIndex::holding(cell)),
            ..ContactOutput::default()
        })
    }

    /// A free proxy has to wait: it is as far as its path is known to be free.
    pub(super) fn waits_at(&mut self, proxy: GridPoint, missing_tile: Option<TileIndex>) -> Turn {
        self.answers(ContactOutput {
            state: ContactState::Free,
            proxy,
            missing_tile,
            ..ContactOutput::default()
        })
    }

    /// The proxy is free, at the HIP; the tick ends.
    pub(super) fn becomes_free(&mut self, hip: GridPoint) -> Turn {
        self.phase = Phase::Free;
        self.answers(ContactOutput {
            state: ContactState::Free,
            proxy: hip,
            converged: true,
            ..ContactOutput::default()
        })
    }

    /// In free space the proxy is the HIP, if it still is.
    ///
    /// Most paths end within the tick; those are not worth storing.
    #[inline(never)]
    pub(super) fn flies<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        let mut sweeping = Sweeping {
            path: Path::through_air(self.hip, hip),
            was_late: false,
            fade: 1.0,
            departures: None,
        };
        let swept = sweeping.path.advance(window, budget);
        if matches!(swept, Swept::Missing(_) | Swept::Suspended) {
            sweeping.was_late = self.settings.execution == Execution::RealTime;
            let at = sweeping.path.at();
            self.phase = Phase::Sweeping(sweeping);
            return self.waits_at(at, swept.missing_tile());
        }
        self.arrives(window, hip, swept, Departures::None, 1.0)
    }

    /// Goes on with a path from an earlier tick, or off the surface.
    #[inline(never)]
    pub(super) fn sweeps<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        let Phase::Sweeping(sweeping) = &mut self.phase else {
            return Turn::Ends;
        };
        let swept = sweeping.path.advance(window, budget);
        if matches!(swept, Swept::Missing(_) | Swept::Suspended) {
            sweeping.was_late |= self.settings.execution == Execution::RealTime;
            let at = sweeping.path.at();
            return self.waits_at(at, swept.missing_tile());
        }
        let fade = if sweeping.was_late {
            0.0
        } else {
            sweeping.fade
        };
        let departures = sweeping.departures;
        self.arrives(window, hip, swept, departures, fade)
    }

    /// What a path that ended comes to: on the surface the tick goes on.
    fn arrives<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        swept: Swept,
        departures: Departures,
        fade: f32,
    ) -> Turn {
        match swept {
            Swept::Hit(point) => {
                self.phase = Phase::OnSurface(OnSurface {
                    leave: may_leave(window, &HipView::new(hip), point, &departures),
                    departures,
                    ..OnSurface::at(point, fade)
                });
                Turn::GoesOn
            }
            Swept::Under => self.loses_contact(window, hip),
            Swept::Clear | Swept::Missing(_) | Swept::Suspended => self.becomes_free(hip),
        }
    }
}
