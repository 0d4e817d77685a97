//! The requested part of a terrain.

use super::coordinates::Coordinates;
use super::error::PlaceError;
use super::ground;
use crate::terrain::{HapticCells, HapticGrid};
use heightfield::{Georeference, Raster, Sides, around};

/// The requested part of a terrain.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Target {
    /// All of it.
    #[default]
    Whole,
    /// A rectangle. In degrees its west may be larger than its east: it then lies across the line
    /// where longitudes start again.
    Box(Sides, Coordinates),
    /// A place under the tip in the home pose.
    At([f64; 2], Coordinates),
}

impl Target {
    /// Returns the haptic grid of a raster for this target: its cells are square there.
    ///
    /// # Errors
    /// [`PlaceError`] if there is no such place.
    pub fn grid<'r>(
        &self,
        raster: &'r Raster,
        cells: HapticCells,
    ) -> Result<HapticGrid<'r>, PlaceError> {
        Ok(match self.middle(&raster.georeference())? {
            Some(ground) => HapticGrid::at(raster, cells, ground),
            None => HapticGrid::new(raster, cells),
        })
    }

    /// Returns the middle of the target in the file's coordinates; `None` for the whole terrain.
    ///
    /// # Errors
    /// As [`Target::grid`].
    pub fn middle(&self, file: &Georeference<'_>) -> Result<Option<[f64; 2]>, PlaceError> {
        Ok(match *self {
            Self::Whole => None,
            Self::At(place, coordinates) => Some(ground::place(file, place, coordinates)?),
            Self::Box(bounds, coordinates) => {
                let corners = ground::outline(file, bounds, coordinates)?;
                let [west, south, east, north] = around(corners);
                Some([0.5 * (west + east), 0.5 * (south + north)])
            }
        })
    }
}
