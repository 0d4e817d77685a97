//! Placement of a terrain in front of the arm: place, scale, level and heights.

use hapterra_core::force::SurfaceParams;
use hapterra_core::scene::{Scene, Source};

use super::error::PlaceError;
use super::fit::{ABOVE_MM, Extent};
use super::ground;
use super::reach::Reach;
use super::target::Target;
use crate::terrain::{
    Distortion, HapticGrid, MAX_TIP_CELLS, Scale, ScaleError, Terrain, TerrainError,
};

/// Relief of a fitted terrain without true proportions, because its file does not state its cell
/// size, mm.
const RELIEF_MM: f64 = 25.0;
/// Relief that is clearly perceptible in the hand, mm.
pub(crate) const CLEAR_RELIEF_MM: f64 = 15.0;
/// Device millimetres for each haptic cell, at a place without a stated scale.
const CELL_MM: f64 = 1.0;

/// Requested size of the terrain.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Sizing {
    /// The target fills the arm's workspace; at a place, a haptic cell is 1 mm.
    #[default]
    Fit,
    /// Device millimetres for each haptic cell of level 0.
    CellMm(f64),
    /// Ground metres for each device millimetre.
    GroundMPerMm(f64),
}

/// Requested height of the terrain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Heights {
    /// A multiple of its true proportions. A file without a cell size has none: its relief is then
    /// 25 mm times this if it is fitted, and a vertical unit is 1 mm times this if its scale is
    /// stated.
    Exaggerated(f64),
    /// Height from [`suited_height`].
    Suited,
    /// Device millimetres for each vertical unit of the file.
    MmPerUnit(f64),
}

impl Default for Heights {
    fn default() -> Self {
        Self::Exaggerated(1.0)
    }
}

/// Returns device millimetres for each vertical unit of a terrain that may be too flat to feel:
/// `plain`, which is true to scale, or more if that is needed to make a `relief` (vertical units)
/// 15 mm high.
#[must_use]
pub fn suited_height(plain: f64, relief: f64) -> f64 {
    match relief > 0.0 {
        true => plain.max(CLEAR_RELIEF_MM / relief),
        false => plain,
    }
}

/// Requested placement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlacementOptions {
    /// Part of the terrain.
    pub target: Target,
    /// Its size.
    pub sizing: Sizing,
    /// Its height.
    pub heights: Heights,
    /// Level of detail; by default it depends on the encoders' resolution.
    pub level: Option<u8>,
}

/// Placement of a terrain in front of the arm: place, scale, level and heights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// The point of the terrain under the tip in its home pose, device millimetres east,
    /// north and up from the south-west sample at height zero.
    pub home_mm: [f64; 3],
    /// The same point in the file's coordinates.
    pub home_ground: [f64; 2],
    /// Scale of level 0.
    pub scale: Scale,
    /// Level L: every 2ᴸ-th sample is rendered.
    pub level: u8,
    /// Side of a haptic cell of level 0 on the ground, m, if the file states it.
    pub side_m: Option<f64>,
    /// Height of the terrain relative to its true proportions, if the file states them.
    pub exaggeration: Option<f64>,
    /// The part in front of the arm: west, south, east, north, device millimetres; the whole
    /// terrain if only place and scale are stated.
    pub extent_mm: [f64; 4],
    /// Lowest and highest point of that part, device millimetres.
    pub heights_mm: [f64; 2],
    /// The arm's workspace ([`Reach::sides_mm`]).
    pub reach_mm: [f64; 4],
}

impl Placement {
    /// Computes the placement of a terrain in front of an arm.
    ///
    /// The grid must be the target's own ([`Target::grid`]): its cells are square at the place.
    ///
    /// # Errors
    /// [`PlaceError`]: no such place or box, nothing known there, an invalid scale, or heights
    /// beyond the arm's reach. [`heightfield::Raster::check_complete`] returns the reason for
    /// [`PlaceError::Unread`].
    pub fn new(
        grid: &HapticGrid<'_>,
        reach: &Reach,
        options: &PlacementOptions,
    ) -> Result<Self, PlaceError> {
        let request = CheckedRequest::new(grid, options)?;
        match (options.target, options.sizing) {
            (Target::At(place, coordinates), _) => {
                let (haptic, height) = ground::spot(grid, place, coordinates)?;
                let scale = request.stated_scale()?;
                request.over(reach, scale, haptic, height)
            }
            (Target::Whole, Sizing::CellMm(_) | Sizing::GroundMPerMm(_)) => {
                let scale = request.stated_scale()?;
                let haptic = request.last().map(|last| 0.5 * last);
                // The middle may be no-data; the ground around it is rendered all the same.
                let [low, high] = request.whole_heights();
                let (height, status) = grid.read_surface(haptic);
                if !status.is_complete() {
                    let place = "the middle of the terrain".into();
                    return Err(PlaceError::Unread { place });
                }
                let height = height.unwrap_or(0.5 * (low + high));
                request.over(reach, scale, haptic, height)
            }
            (Target::Whole, Sizing::Fit) => {
                let [east, north] = request.last();
                request.fitted(reach, [0.0, 0.0, east, north], request.whole_heights())
            }
            (Target::Box(bounds, coordinates), _) => {
                let (cells, heights) = ground::area(grid, bounds, coordinates)?;
                request.fitted(reach, cells, heights)
            }
        }
    }

    /// Returns ground metres for each device millimetre, if the file states its cell size.
    #[must_use]
    pub fn ground_m_per_mm(&self) -> Option<f64> {
        self.side_m.map(|side| side / self.scale.cell_mm())
    }

    /// Returns ground metres for each haptic cell of the placement's level, if the file states its
    /// cell size.
    #[must_use]
    pub fn haptic_cell_m(&self) -> Option<f64> {
        self.side_m.map(|side| side * f64::from(self.level).exp2())
    }

    /// Returns device millimetres for each haptic cell of the placement's level.
    #[must_use]
    pub fn haptic_cell_mm(&self) -> f64 {
        self.scale.at_level(self.level).cell_mm()
    }

    /// Returns the most distorted haptic cell within the arm's reach, in the placement's own grid.
    /// `None` if the file does not state its cell size.
    #[must_use]
    pub fn worst_reached(&self, grid: &HapticGrid<'_>) -> Option<Distortion> {
        let cells =
            |index: usize| (self.home_mm[index % 2] + self.reach_mm[index]) / self.scale.cell_mm();
        grid.worst_in([0, 1, 2, 3].map(cells))
    }

    /// Returns the placement at another scale: device millimetres for each haptic cell of level 0,
    /// and for each vertical unit. The caller then has to call [`Self::moved_to`].
    pub(super) fn scaled(self, cell_mm: f64, height_mm_per_unit: f64) -> Result<Self, ScaleError> {
        let scale = Scale::new(cell_mm, height_mm_per_unit)?;
        let steeper = scale.height_cells(1.0) / self.scale.height_cells(1.0);
        Ok(Self {
            scale,
            exaggeration: self.exaggeration.map(|times| times * steeper),
            ..self
        })
    }

    /// Returns the placement over cells measured at another place, equally large on the ground and
    /// in device millimetres, so that scale and exaggeration stay. The caller then has to call
    /// [`Self::moved_to`].
    pub(super) fn measured_as(self, grid: &HapticGrid<'_>) -> Result<Self, ScaleError> {
        let cell_mm = self.scale.cell_mm() * self.as_large_as_in(grid);
        Ok(Self {
            scale: Scale::new(cell_mm, self.scale.height_mm_per_unit())?,
            side_m: grid.side_m(),
            ..self
        })
    }

    /// Returns the ratio of a grid's cell size on the ground to that of the placement; 1 if it is
    /// unknown.
    pub(super) fn as_large_as_in(&self, grid: &HapticGrid<'_>) -> f64 {
        let sides = grid.side_m().zip(self.side_m);
        sides.map_or(1.0, |(there, here)| there / here)
    }

    /// Returns the placement with another point under the tip in the home pose, device millimetres,
    /// after a change of scale or grid.
    pub(super) fn moved_to(
        self,
        grid: &HapticGrid<'_>,
        home_mm: [f64; 3],
        (before, grid_before): (Scale, &HapticGrid<'_>),
    ) -> Self {
        let cells = self.extent_mm.map(|mm| mm / before.cell_mm());
        let cells = grid.around_sides_of(grid_before, cells);
        let higher = self.scale.height_mm_per_unit() / before.height_mm_per_unit();
        let haptic = [home_mm[0], home_mm[1]].map(|mm| mm / self.scale.cell_mm());
        Self {
            home_mm,
            home_ground: grid.to_ground(haptic),
            extent_mm: cells.map(|cells| cells * self.scale.cell_mm()),
            heights_mm: match higher.is_finite() {
                true => self.heights_mm.map(|mm| mm * higher),
                false => self.heights_mm,
            },
            ..self
        }
    }

    /// Returns the terrain at the placement's scale and level.
    ///
    /// # Errors
    /// [`TerrainError`].
    pub fn terrain<'r>(&self, grid: HapticGrid<'r>) -> Result<Terrain<'r>, TerrainError> {
        Terrain::over(grid, self.scale, self.level)
    }

    /// Returns the scene of the placement's terrain for an arm.
    ///
    /// # Errors
    /// [`PlaceError::FarAway`] if the home position is too far from the origin for its coordinates.
    pub fn scene(&self, terrain: &Terrain<'_>, params: SurfaceParams) -> Result<Scene, PlaceError> {
        let home = terrain.scale().to_grid(self.home_mm);
        let home = home.ok_or(PlaceError::FarAway(self.home_mm))?;
        let scene = terrain.scene(params, Source::Encoders, home);
        Ok(terrain.with_fallback(scene, self.reach_mm))
    }
}

/// Checked request for a grid.
struct CheckedRequest<'g> {
    grid: &'g HapticGrid<'g>,
    options: PlacementOptions,
}

impl<'g> CheckedRequest<'g> {
    fn new(grid: &'g HapticGrid<'g>, options: &PlacementOptions) -> Result<Self, PlaceError> {
        match options.sizing {
            Sizing::GroundMPerMm(scale) if !(scale.is_finite() && scale > 0.0) => {
                return Err(PlaceError::GroundScale(scale));
            }
            Sizing::GroundMPerMm(_) if grid.side_m().is_none() => {
                return Err(PlaceError::NoGroundSize);
            }
            _ => {}
        }
        match options.heights {
            Heights::Exaggerated(times) if !times.is_finite() || times == 0.0 => {
                return Err(PlaceError::Exaggeration(times));
            }
            _ => {}
        }
        Ok(Self {
            grid,
            options: *options,
        })
    }

    /// Returns column and row of the last rendered sample.
    fn last(&self) -> [f64; 2] {
        [self.grid.columns(), self.grid.rows()].map(|count| f64::from(count) - 1.0)
    }

    fn whole_heights(&self) -> [f64; 2] {
        let summary = self.grid.raster().summary();
        [summary.lowest, summary.highest]
    }

    fn stated_scale(&self) -> Result<Scale, PlaceError> {
        let side_m = self.grid.side_m();
        let cell_mm = match self.options.sizing {
            Sizing::Fit => CELL_MM,
            Sizing::CellMm(cell_mm) => cell_mm,
            Sizing::GroundMPerMm(scale) => side_m.ok_or(PlaceError::NoGroundSize)? / scale,
        };
        Ok(Scale::new(cell_mm, self.height_mm_per_unit(cell_mm, None))?)
    }

    /// Returns device millimetres for each vertical unit, for a cell size in device millimetres;
    /// `relief` is that of a fitted part, in vertical units.
    fn height_mm_per_unit(&self, cell_mm: f64, relief: Option<f64>) -> f64 {
        let plain = match (self.grid.cells_per_vertical_unit(), relief) {
            (Some(cells), _) => cells * cell_mm,
            (None, Some(relief)) if relief > 0.0 => rounded_down(RELIEF_MM / relief),
            (None, _) => 1.0,
        };
        match self.options.heights {
            Heights::MmPerUnit(height) => height,
            Heights::Exaggerated(times) => times * plain,
            Heights::Suited => {
                let [low, high] = self.whole_heights();
                suited_height(plain, relief.unwrap_or(high - low))
            }
        }
    }

    /// Returns a placement with a place of the terrain under the home position.
    fn over(
        &self,
        reach: &Reach,
        scale: Scale,
        haptic: [f64; 2],
        height: f64,
    ) -> Result<Placement, PlaceError> {
        let [east, north] = haptic.map(|cells| cells * scale.cell_mm());
        // In the home pose the tip is above the ground of its place.
        let up = height * scale.height_mm_per_unit() + ABOVE_MM;
        let [columns, rows] = self.last();
        let cells = [0.0, 0.0, columns, rows];
        Ok(self.view(reach, scale, [east, north, up], cells, self.whole_heights()))
    }

    /// Returns a placement with a part of the terrain in the middle of the reach.
    fn fitted(
        &self,
        reach: &Reach,
        cells: [f64; 4],
        heights: [f64; 2],
    ) -> Result<Placement, PlaceError> {
        let [west, south, east, north] = cells;
        let relief = heights[1] - heights[0];
        let mm_per_unit = |cell_mm: f64| self.height_mm_per_unit(cell_mm, Some(relief));
        let heights_mm = |cell_mm: f64| sorted(heights.map(|h| h * mm_per_unit(cell_mm)));
        let extent = Extent {
            cells: [east - west, north - south],
            heights_mm: &heights_mm,
        };
        let side_m = self.grid.side_m();
        let fitted = extent.fit(reach, |cell_mm| match side_m {
            Some(side) => side / rounded_up(side / cell_mm),
            None => rounded_down(cell_mm),
        })?;
        let scale = Scale::new(fitted.cell_mm, mm_per_unit(fitted.cell_mm))?;
        let middle = [0.5 * (west + east), 0.5 * (south + north)];
        let [east, north] =
            [0, 1].map(|axis| middle[axis] * scale.cell_mm() - fitted.middle_mm[axis]);
        let home_mm = [east, north, fitted.home_up_mm];
        Ok(self.view(reach, scale, home_mm, cells, heights))
    }

    fn view(
        &self,
        reach: &Reach,
        scale: Scale,
        home_mm: [f64; 3],
        cells: [f64; 4],
        heights: [f64; 2],
    ) -> Placement {
        let haptic = [home_mm[0], home_mm[1]].map(|mm| mm / scale.cell_mm());
        let true_height = self.grid.cells_per_vertical_unit();
        Placement {
            home_mm,
            home_ground: self.grid.to_ground(haptic),
            scale,
            level: self
                .options
                .level
                .unwrap_or_else(|| finest_level(self.grid, reach.resolution_mm(), &scale)),
            side_m: self.grid.side_m(),
            exaggeration: true_height.map(|cells| scale.height_cells(1.0) / cells),
            extent_mm: cells.map(|cells| cells * scale.cell_mm()),
            heights_mm: sorted(heights.map(|height| height * scale.height_mm_per_unit())),
            reach_mm: reach.sides_mm(),
        }
    }
}

/// Returns the finest level whose cells are not finer than a count of the encoders, and in which
/// the tip's radius is at most [`MAX_TIP_CELLS`], or the coarsest level with a patch.
pub(super) fn finest_level(grid: &HapticGrid<'_>, resolution_mm: f64, scale: &Scale) -> u8 {
    let last = coarsest_level(grid);
    let min_mm = resolution_mm.max(grid.tip_mm() / MAX_TIP_CELLS);
    let fine = |level: &u8| scale.at_level(*level).cell_mm() < min_mm;
    (0..last).find(|level| !fine(level)).unwrap_or(last)
}

/// Returns the coarsest level with a patch.
pub(super) fn coarsest_level(grid: &HapticGrid<'_>) -> u8 {
    let fewest = grid.columns().min(grid.rows()) - 1;
    fewest.max(1).ilog2() as u8
}

fn sorted([a, b]: [f64; 2]) -> [f64; 2] {
    [a.min(b), a.max(b)]
}

/// Returns the smallest number with three digits that is not below `x` (positive).
fn rounded_up(x: f64) -> f64 {
    let unit = 10f64.powf(x.log10().floor() - 2.0);
    let rounded = (x / unit - 1e-9).ceil() * unit;
    // Removes binary rounding: 0.3, not 0.30000000000000004.
    format!("{rounded:.2e}").parse().unwrap_or(rounded)
}

/// Returns the largest number with three digits that is not above `x` (positive).
fn rounded_down(x: f64) -> f64 {
    let unit = 10f64.powf(x.log10().floor() - 2.0);
    let rounded = (x / unit + 1e-9).floor() * unit;
    format!("{rounded:.2e}").parse().unwrap_or(rounded)
}

#[cfg(test)]
#[path = "placement_tests.rs"]
mod tests;
