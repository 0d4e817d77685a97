//! Largest size of a terrain within an arm's workspace.

use super::error::PlaceError;
use super::reach::Reach;

/// Room over the highest point, for a hand that lifts, and below the lowest, for one
/// that presses, mm.
pub(super) const ABOVE_MM: f64 = 15.0;
const BELOW_MM: f64 = 10.0;
/// The scale is found to this share: a step of the reach's profile is coarser.
const HALVINGS: usize = 24;
/// A terrain is laid smaller than the reach by up to this factor, for its heights.
const SMALLEST: f64 = 1e-6;

/// Extent to fit to the workspace.
pub(super) struct Extent<'a> {
    /// East and north, haptic cells.
    pub(super) cells: [f64; 2],
    /// Lowest and highest point in the hand, mm, with cells of a size in the hand, mm.
    pub(super) heights_mm: &'a dyn Fn(f64) -> [f64; 2],
}

/// Result of a fit to the workspace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fitted {
    /// Device millimetres a haptic cell.
    pub(super) cell_mm: f64,
    /// The middle of the extent east and north of the home position, mm.
    pub(super) middle_mm: [f64; 2],
    /// Height of the terrain at the home position's height, mm.
    pub(super) home_up_mm: f64,
}

impl Extent<'_> {
    /// Lays the extent into the reach as large as it fits; `round` makes a cell that fits
    /// smaller by a little, for a scale in round numbers.
    pub(super) fn fit(
        &self,
        reach: &Reach,
        round: impl Fn(f64) -> f64,
    ) -> Result<Fitted, PlaceError> {
        let longest = self.cells[0].max(self.cells[1]);
        let widest = reach.middle_of([1.0, 1.0, ABOVE_MM + BELOW_MM]);
        widest.ok_or(PlaceError::NoReach)?;
        // No arm reaches twice its home pose's distances to each side.
        let mut too_large = 4.0 * reach.height_mm().max(1.0) / longest;
        let mut fitting = too_large * SMALLEST;
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
