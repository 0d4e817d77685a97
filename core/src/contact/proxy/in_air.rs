//! A tick of a proxy in the air, which moves straight to the HIP until it meets the surface.

use super::departures::{Departures, may_leave};
use super::{Contact, OnSurface, Phase, Sweeping, Turn};
use crate::contact::budget::Budget;
use crate::contact::output::{ContactOutput, ContactState};
use crate::contact::surface::HipView;
use crate::contact::sweep::{Path, Swept};
use crate::grid::GridPoint;
use crate::terrain::{CellContent, Window};

impl Contact {
    /// Ends [`Phase::Unseeded`] when the HIP is above the patch under it, or above everything.
    #[inline(never)]
    pub(super) fn looks_around<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        if let Some(onset) = &self.onset {
            let waits = onset.waits(budget);
            return self.answers(waits);
        }
        let view = HipView::new(hip);
        let (cell, ground) = view.ground(window);
        let is_above = view.altitude().cell() >= window.top()
            || matches!(&ground, CellContent::Patch(corners) if view.is_above(cell, corners));
        if is_above {
            return self.becomes_free(hip);
        }
        self.phase = Phase::Unseeded;
        let is_missing = ground == CellContent::Missing;
        if is_missing {
            budget.lacks(cell);
        }
        self.answers(ContactOutput {
            proxy: hip,
            converged: !is_missing,
            ..ContactOutput::default()
        })
    }

    /// Stops a free proxy that has to wait, at the end of the known free part of its path.
    pub(super) fn waits_at(&mut self, proxy: GridPoint) -> Turn {
        self.answers(ContactOutput {
            state: ContactState::Free,
            proxy,
            ..ContactOutput::default()
        })
    }

    /// Ends the tick with the proxy free, at the HIP.
    pub(super) fn becomes_free(&mut self, hip: GridPoint) -> Turn {
        self.phase = Phase::Free;
        self.answers(ContactOutput {
            state: ContactState::Free,
            proxy: hip,
            converged: true,
            ..ContactOutput::default()
        })
    }

    /// Moves the proxy to the HIP in free space, if the path is clear.
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
        if matches!(swept, Swept::Missing | Swept::Suspended) {
            sweeping.was_late = matches!(swept, Swept::Missing);
            let at = sweeping.path.at();
            self.phase = Phase::Sweeping(sweeping);
            return self.waits_at(at);
        }
        self.arrives(window, hip, swept, (Departures::None, 1.0), budget)
    }

    /// Continues a path of an earlier tick, or one off the surface.
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
        if matches!(swept, Swept::Missing | Swept::Suspended) {
            sweeping.was_late |= matches!(swept, Swept::Missing);
            let at = sweeping.path.at();
            return self.waits_at(at);
        }
        let fade = if sweeping.was_late {
            0.0
        } else {
            sweeping.fade
        };
        let departures = sweeping.departures;
        self.arrives(window, hip, swept, (departures, fade), budget)
    }

    /// Handles the end of a path; on the surface the tick continues.
    fn arrives<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        swept: Swept,
        (departures, fade): (Departures, f32),
        budget: &mut Budget,
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
            Swept::Under => self.loses_contact(window, hip, budget),
            Swept::Clear | Swept::Missing | Swept::Suspended => self.becomes_free(hip),
        }
    }
}
