//! Largest size of a terrain within an arm's workspace.

use super::error::PlaceError;
use super::reach::Reach;

/// Space above the highest point, for a hand that lifts, and below the lowest, for one that
/// presses, mm.
pub(super) const ABOVE_MM: f64 = 15.0;
const BELOW_MM: f64 = 10.0;
/// Bisections of the search for the scale, far finer than a step of the reach's profile.
const HALVINGS: usize = 24;
/// Min size of a terrain as a share of the largest: its heights may require a small one.
const MIN_SCALE_SHARE: f64 = 1e-6;

/// Extent to fit to the workspace.
pub(super) struct Extent<'a> {
    /// Extent east and north, haptic cells.
    pub(super) cells: [f64; 2],
    /// Lowest and highest point, device millimetres, as a function of the cell size, device
    /// millimetres.
    pub(super) heights_mm: &'a dyn Fn(f64) -> [f64; 2],
}

/// Result of a fit to the workspace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fitted {
    /// Device millimetres for each haptic cell.
    pub(super) cell_mm: f64,
    /// The middle of the extent, east and north of the home position, mm.
    pub(super) middle_mm: [f64; 2],
    /// The terrain's height coordinate at the home position, mm.
    pub(super) home_up_mm: f64,
}

impl Extent<'_> {
    /// Fits the extent to the workspace, as large as possible; `round` reduces a fitting cell size
    /// to a round number.
    pub(super) fn fit(
        &self,
        reach: &Reach,
        round: impl Fn(f64) -> f64,
    ) -> Result<Fitted, PlaceError> {
        let longest = self.cells[0].max(self.cells[1]);
        let widest = reach.middle_of([1.0, 1.0, ABOVE_MM + BELOW_MM]);
        widest.ok_or(PlaceError::NoReach)?;
        // No arm reaches more than twice its home pose's distances to each side.
        let mut too_large = 4.0 * reach.height_mm().max(1.0) / longest;
        let mut fitting = too_large * MIN_SCALE_SHARE;
        if !self.fits(reach, fitting) {
            let [low, high] = (self.heights_mm)(fitting);
            return Err(PlaceError::TooTall {
                relief_mm: high - low,
                reach_mm: reach.height_mm(),
            });
        }
        for _ in 0..HALVINGS {
            let middle = (fitting * too_large).sqrt();
            match self.fits(reach, middle) {
                true => fitting = middle,
                false => too_large = middle,
            }
        }
        let cell_mm = round(fitting);
        let size = self.size_mm(cell_mm);
        let middle = reach.middle_of(size).ok_or(PlaceError::NoReach)?;
        let [low, _] = (self.heights_mm)(cell_mm);
        let bottom = middle[2] - 0.5 * size[2];
        Ok(Fitted {
            cell_mm,
            middle_mm: [middle[0], middle[1]],
            home_up_mm: low - BELOW_MM - bottom,
        })
    }

    fn fits(&self, reach: &Reach, cell_mm: f64) -> bool {
        reach.middle_of(self.size_mm(cell_mm)).is_some()
    }

    fn size_mm(&self, cell_mm: f64) -> [f64; 3] {
        let [low, high] = (self.heights_mm)(cell_mm);
        let [east, north] = self.cells.map(|cells| cells * cell_mm);
        [east, north, high - low + ABOVE_MM + BELOW_MM]
    }
}
