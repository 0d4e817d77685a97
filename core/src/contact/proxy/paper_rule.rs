//! A tick by the paper's rule, which looks for the surface under the segment of the HIP.

use super::{Contact, OnSurface, Phase, Turn};
use crate::contact::budget::Budget;
use crate::contact::paper::{self, Candidate, Candidates};
use crate::contact::settings::Execution;
use crate::contact::surface::HipView;
use crate::grid::GridPoint;
use crate::terrain::Window;

impl Contact {
    /// By the paper's rule: the first candidate under the segment.
    #[inline(never)]
    pub(super) fn seeks<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        hip: GridPoint,
        budget: &mut Budget,
    ) -> Turn {
        let Phase::Seeking { cells, was_late } = &mut self.phase else {
            return Turn::Ends;
        };
        let missing_tile = match cells.find(window, budget) {
            Candidate::At(point) => {
                let fade = if *was_late { 0.0 } else { 1.0 };
                self.phase = Phase::OnSurface(OnSurface::at(point, fade));
                return Turn::GoesOn;
            }
            Candidate::None if cells.to == hip => return self.becomes_free(hip),
            Candidate::None => {
                // The HIP has moved on meanwhile.
                *cells = Candidates::between(cells.to, hip);
                return Turn::GoesOn;
            }
            Candidate::Missing(tile) => Some(tile),
            Candidate::Suspended => None,
        };
        *was_late |= self.settings.execution == Execution::RealTime;
        let from = cells.from;
        self.waits_at(from, missing_tile)
    }

    /// By the paper's rule: the closest point decides about contact.
    pub(super) fn decides<const D: usize>(
        &mut self,
        window: &Window<'_, D>,
        view: &HipView,
        hip: GridPoint,
    ) -> Turn {
        let Phase::OnSurface(on) = &self.phase else {
            return Turn::Ends;
        };
        match on.descent.nearest(window, view) {
            Some((point, z)) if paper::is_inside(window, view, &point, z) => {
                self.touches(window, hip, true, None)
            }
            _ => self.becomes_free(hip),
        }
    }
}
