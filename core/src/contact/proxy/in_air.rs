//! A tick of a proxy in the air, which moves straight to the HIP until it meets the surface.

use super::departures::{Departures, departure_rule};
use super::{Contact, OnSurface, Phase, Sweeping, TickProgress};
use crate::contact::budget::Budget;
use crate::contact::output::{ContactOutput, ContactState};
use crate::contact::surface::HipView;
use crate::contact::sweep::{Path, SweepEnd};
use crate::grid::GridPoint;
use crate::terrain::{CellContent, Window};

impl Contact {
    /// Ends [`Phase::Unseeded`] when the HIP is above the patch under it, or above everything.
    #[inline(never)]
    pub(super) fn try_seed<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> TickProgress {
        if let Some(onset) = &self.onset {
            let pending_output = onset.pending_output(budget);
            return self.set_output(pending_output);
        }
        let view = HipView::new(hip);
        let (cell, ground) = view.ground(window);
        let is_above = view.altitude().cell() >= window.top()
            || matches!(&ground, CellContent::Patch(corners) if view.is_above(cell, corners));
        if is_above {
            return self.set_free(hip);
        }
        self.phase = Phase::Unseeded;
        let is_missing = ground == CellContent::Missing;
        if is_missing {
            budget.record_missing(cell);
        }
        self.set_output(ContactOutput {
            proxy: hip,
            converged: !is_missing,
            ..ContactOutput::default()
        })
    }

    /// Stops a free proxy that has to wait, at the end of the checked free part of its path.
    pub(super) fn stop_at(&mut self, proxy: GridPoint) -> TickProgress {
        self.set_output(ContactOutput {
            state: ContactState::Free,
            proxy,
            ..ContactOutput::default()
        })
    }

    /// Ends the tick with the proxy free, at the HIP.
    pub(super) fn set_free(&mut self, hip: GridPoint) -> TickProgress {
        self.phase = Phase::Free;
        self.set_output(ContactOutput {
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
    pub(super) fn start_sweep<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> TickProgress {
        let mut sweeping = Sweeping {
            path: Path::through_air(self.hip, hip),
            was_late: false,
            fade: 1.0,
            departures: None,
        };
        let sweep_end = sweeping.path.advance(window, budget);
        if matches!(sweep_end, SweepEnd::MissingTile | SweepEnd::Suspended) {
            sweeping.was_late = matches!(sweep_end, SweepEnd::MissingTile);
            let at = sweeping.path.at();
            self.phase = Phase::Sweeping(sweeping);
            return self.stop_at(at);
        }
        self.end_sweep(window, hip, sweep_end, (Departures::None, 1.0), budget)
    }

    /// Continues a path of an earlier tick, or one off the surface.
    #[inline(never)]
    pub(super) fn continue_sweep<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> TickProgress {
        let Phase::Sweeping(sweeping) = &mut self.phase else {
            return TickProgress::Done;
        };
        let sweep_end = sweeping.path.advance(window, budget);
        if matches!(sweep_end, SweepEnd::MissingTile | SweepEnd::Suspended) {
            sweeping.was_late |= matches!(sweep_end, SweepEnd::MissingTile);
            let at = sweeping.path.at();
            return self.stop_at(at);
        }
        let fade = if sweeping.was_late {
            0.0
        } else {
            sweeping.fade
        };
        let departures = sweeping.departures;
        self.end_sweep(window, hip, sweep_end, (departures, fade), budget)
    }

    /// Handles the end of a path; on the surface the tick continues.
    fn end_sweep<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        sweep_end: SweepEnd,
        (departures, fade): (Departures, f32),
        budget: &mut Budget,
    ) -> TickProgress {
        match sweep_end {
            SweepEnd::Hit(point) => {
                self.phase = Phase::OnSurface(OnSurface {
                    departure_rule: departure_rule(window, &HipView::new(hip), point, &departures),
                    departures,
                    ..OnSurface::at(point, fade)
                });
                TickProgress::Continue
            }
            SweepEnd::Under => self.release(window, hip, budget),
            SweepEnd::Clear | SweepEnd::MissingTile | SweepEnd::Suspended => self.set_free(hip),
        }
    }
}
