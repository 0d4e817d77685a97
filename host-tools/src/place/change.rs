//! Changes of a placement while it is rendered: the current placement and the requested changes
//! give the next one, or an error with the reason.

use hapterra_core::force::SurfaceParams;

use super::placement::{Placement, coarsest_level, finest_level};
use super::surface_change::{SurfaceChange, SurfaceError};
use crate::terrain::{HapticGrid, ScaleError, Terrain, TerrainError};

/// Maximum width of a file's sample in the hand, mm: a wider one feels like one flat patch.
const MAX_CELL_MM: f64 = 50.0;
/// Minimum longer side of a terrain in the hand, mm: a shorter one shows no detail.
const MIN_TERRAIN_MM: f64 = 5.0;
/// Maximum stiffness, N/mm: above it an arm most likely buzzes or kicks
/// (`docs/explanation/stability.md`).
pub const MAX_STIFFNESS_N_PER_MM: f32 = 1.0;
/// Minimum stiffness, N/mm: a softer surface is not noticeable.
const MIN_STIFFNESS_N_PER_MM: f32 = 0.005;
/// Smallest and largest radius of a ball at the tip, device millimetres; 0 is a point.
pub const TIPS_MM: [f64; 2] = [0.0, 100.0];

/// Change of a placement during a session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlacementChange {
    /// Another place under the hand, this far away in device millimetres.
    Pan {
        /// Device millimetres east.
        east_mm: f64,
        /// Device millimetres north.
        north_mm: f64,
    },
    /// Another place under the hand, this far away in ground metres.
    PanGround {
        /// Ground metres east.
        east_m: f64,
        /// Ground metres north.
        north_m: f64,
    },
    /// Another scale: multiplied by this factor, about the place under the hand.
    Zoom(f64),
    /// Other heights: multiplied by this factor.
    Exaggerate(f64),
    /// Another stiffness: multiplied by this factor.
    Stiffness(f64),
    /// Another surface parameter.
    Surface(SurfaceChange),
    /// Another radius of the ball at the tip, device millimetres; 0 for a point.
    Tip(f64),
    /// Initial scale, heights, surface and tip, at the place under the hand.
    Reset,
}

/// Reason to refuse a change; the placement stays as it is.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ChangeError {
    /// A place beyond the samples.
    #[error("that place is outside of the terrain")]
    Outside,
    /// Ground metres for a file without a cell size on the ground.
    #[error("the file does not state its cell size on the ground: pan by device millimetres")]
    NoGroundSize,
    /// A factor that is not positive and finite.
    #[error("{0} is not a valid factor: it must be above zero, and finite")]
    Factor(f64),
    /// A scale beyond the detail of the file.
    #[error(
        "a sample of the file would be {cell_mm:.0} mm wide in the hand: it has no more detail"
    )]
    NoDetail {
        /// Device millimetres a haptic cell of level 0.
        cell_mm: f64,
    },
    /// A terrain too small to render.
    #[error("the whole terrain would be {size_mm:.1} mm wide in the hand")]
    TooSmall {
        /// Longer side of the terrain, device millimetres.
        size_mm: f64,
    },
    /// A stiffness outside the valid range, N/mm.
    #[error(
        "a stiffness of {0:.3} N/mm: from {MIN_STIFFNESS_N_PER_MM} to {MAX_STIFFNESS_N_PER_MM} N/mm can be had"
    )]
    Stiffness(f32),
    /// A stiffness of a material above the maximum, N/mm.
    #[error(
        "the stiffest of the materials would have {0:.3} N/mm: up to {MAX_STIFFNESS_N_PER_MM} N/mm can be had"
    )]
    Material(f32),
    /// An invalid surface parameter.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// A tip radius outside [`TIPS_MM`].
    #[error("a tip of {0} mm: from {min} to {max} mm can be had", min = TIPS_MM[0], max = TIPS_MM[1])]
    Tip(f64),
    /// Numbers with which no terrain can be rendered.
    #[error(transparent)]
    Terrain(#[from] TerrainError),
    /// An invalid scale.
    #[error(transparent)]
    Scale(#[from] ScaleError),
}

/// A placement and its surface parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedSurface {
    /// Place, scale, level and heights.
    pub view: Placement,
    /// Stiffness, friction, damping, texture and shading.
    pub params: SurfaceParams,
}

/// Bounds of all placements of a session.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// The initial placement.
    pub first: PlacedSurface,
    /// Resolution of the encoders at the tip, mm.
    pub resolution_mm: f64,
    /// Level of detail, if the user has stated one.
    pub level: Option<u8>,
    /// Initial radius of the ball at the tip, device millimetres; 0 for a point.
    pub tip_mm: f64,
    /// Levels above the finest one, without a stated level.
    pub coarser: u8,
}

/// Measurement of the haptic cells at the place under the hand, when a placement changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// The cells are measured again, if they differ there.
    Again,
    /// The cells stay, for a change of the level alone.
    Keep,
}

/// The HIP and the proxy, device millimetres of the current placement. The placement changes about
/// the proxy, or about the HIP in the air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// The HIP.
    pub hip_mm: [f64; 3],
    /// The proxy, while it touches.
    pub proxy_mm: Option<[f64; 3]>,
}

impl Hand {
    /// Returns the place about which the placement changes.
    fn at_mm(&self) -> [f64; 3] {
        self.proxy_mm.unwrap_or(self.hip_mm)
    }

    /// Returns true if the terrain's cells at this place differ from the rendered ones
    /// ([`HapticGrid::remeasured_at`]).
    #[must_use]
    pub fn has_other_cell_size(&self, terrain: &Terrain<'_>) -> bool {
        let cell_mm = terrain.scale_of_level_0().cell_mm();
        let [east, north, _] = self.at_mm();
        let remeasured = terrain
            .grid()
            .remeasured_at([east / cell_mm, north / cell_mm]);
        remeasured.is_some()
    }
}

/// A changed placement, and the HIP in it.
#[derive(Clone)]
pub struct Changed<'r> {
    /// The new placement and its surface parameters.
    pub placed_surface: PlacedSurface,
    /// Its terrain.
    pub terrain: Terrain<'r>,
    /// The HIP, device millimetres of the new placement. Its height over the place under the hand
    /// is unchanged.
    pub hip_mm: [f64; 3],
    /// The place about which the placement changes, device millimetres of the new placement; `None`
    /// if its height is unknown or it has none.
    pub place_mm: Option<[f64; 3]>,
    /// True if the heights under the hand have been read. Otherwise the HIP keeps its old height,
    /// and the same changes give the right one after the heights have been read.
    pub ground_is_known: bool,
}

impl Bounds {
    /// Applies changes in order, at the place under the hand, where the cells are then measured
    /// again if `measure` requests it.
    ///
    /// # Errors
    /// [`ChangeError`] of the first invalid change; then nothing is changed.
    pub fn apply<'r>(
        &self,
        terrain: &Terrain<'r>,
        before: &PlacedSurface,
        changes: &[PlacementChange],
        (hand, measure): (&Hand, Measure),
    ) -> Result<Changed<'r>, ChangeError> {
        let at_mm = hand.at_mm();
        let cell_mm = before.view.scale.cell_mm();
        let mut placed_surface = *before;
        let mut at = [at_mm[0] / cell_mm, at_mm[1] / cell_mm];
        let mut grid = *terrain.grid();
        for change in changes {
            (placed_surface, at) = self.step(&mut grid, placed_surface, at, change)?;
        }
        if measure == Measure::Again
            && let Some(remeasured) = grid.remeasured_at(at)
        {
            at = remeasured.of_ground(grid.to_ground(at));
            placed_surface.view = placed_surface.view.measured_as(&remeasured)?;
            grid = remeasured;
        }
        placed_surface.view.level = match self.level {
            Some(level) => level,
            None => {
                let finest = self.finest_level(&grid, &placed_surface.view);
                let last = coarsest_level(&grid).max(finest);
                finest.saturating_add(self.coarser).min(last)
            }
        };
        let terrain_after =
            terrain.with_grid(grid, placed_surface.view.scale, placed_surface.view.level)?;
        let (hip_mm, ground_is_known) = hip_after((terrain, &terrain_after), hand, at_mm, at);
        let place_mm = place_on(&terrain_after, at);
        let moved = |axis: usize| before.view.home_mm[axis] + hip_mm[axis] - hand.hip_mm[axis];
        let home_mm = [moved(0), moved(1), moved(2)];
        let was = (before.view.scale, terrain.grid());
        placed_surface.view = placed_surface.view.moved_to(&grid, home_mm, was);
        Ok(Changed {
            placed_surface,
            ground_is_known,
            place_mm,
            terrain: terrain_after,
            hip_mm,
        })
    }

    /// Returns the finest level of a placement that the encoders resolve.
    #[must_use]
    pub fn finest_level(&self, grid: &HapticGrid<'_>, view: &Placement) -> u8 {
        finest_level(grid, self.resolution_mm, &view.scale)
    }

    /// Applies one change, at a place in haptic cells of level 0.
    fn step(
        &self,
        grid: &mut HapticGrid<'_>,
        mut placed_surface: PlacedSurface,
        mut at: [f64; 2],
        change: &PlacementChange,
    ) -> Result<(PlacedSurface, [f64; 2]), ChangeError> {
        let PlacedSurface { view, params } = &mut placed_surface;
        let scale = view.scale;
        let (cell_mm, height) = (scale.cell_mm(), scale.height_mm_per_unit());
        match *change {
            PlacementChange::Pan { east_mm, north_mm } => {
                at = [at[0] + east_mm / cell_mm, at[1] + north_mm / cell_mm];
                within(grid, at)?;
            }
            PlacementChange::PanGround { east_m, north_m } => {
                let side = grid.side_m().ok_or(ChangeError::NoGroundSize)?;
                at = [at[0] + east_m / side, at[1] + north_m / side];
                within(grid, at)?;
            }
            PlacementChange::Zoom(factor) => {
                let factor = factor_of(factor)?;
                *view = view.scaled(cell_mm * factor, height * factor)?;
                check_size(grid, view, factor)?;
            }
            PlacementChange::Exaggerate(factor) => {
                *view = view.scaled(cell_mm, height * factor_of(factor)?)?;
            }
            PlacementChange::Stiffness(factor) => {
                let stiffness = params.stiffness_n_per_mm * factor_of(factor)? as f32;
                // An initial stiffness above the maximum may be reduced and restored.
                let max = MAX_STIFFNESS_N_PER_MM.max(self.first.params.stiffness_n_per_mm);
                if !(MIN_STIFFNESS_N_PER_MM..=max).contains(&stiffness) {
                    return Err(ChangeError::Stiffness(stiffness));
                }
                params.stiffness_n_per_mm = stiffness;
                // The scene's other materials become stiffer by the same factor.
                if let Some(materials) = grid.materials() {
                    let stiffest = |params| materials.table().hardest(params).stiffness_n_per_mm;
                    let (now, first) = (stiffest(params), stiffest(&self.first.params));
                    if now > MAX_STIFFNESS_N_PER_MM.max(first) {
                        return Err(ChangeError::Material(now));
                    }
                }
            }
            PlacementChange::Surface(change) => {
                *params = change.of(params, grid.materials().is_some())?;
            }
            PlacementChange::Tip(mm) => {
                if !(TIPS_MM[0]..=TIPS_MM[1]).contains(&mm) {
                    return Err(ChangeError::Tip(mm));
                }
                *grid = grid.with_tip(mm);
            }
            PlacementChange::Reset => {
                let first = &self.first.view;
                let cell_mm = first.scale.cell_mm() * first.as_large_as_in(grid);
                let height = first.scale.height_mm_per_unit();
                *view = view.scaled(cell_mm, height)?;
                view.exaggeration = first.exaggeration;
                *params = self.first.params;
                *grid = grid.with_tip(self.tip_mm);
            }
        }
        Ok((placed_surface, at))
    }
}

/// Returns the HIP in the new placement, with the same offset from the place under the hand and the
/// same height over its ground, and true if both ground heights are known.
fn hip_after(
    (before, after): (&Terrain<'_>, &Terrain<'_>),
    hand: &Hand,
    at_mm: [f64; 3],
    at: [f64; 2],
) -> ([f64; 3], bool) {
    let cell_mm = after.scale_of_level_0().cell_mm();
    let [east, north] = at.map(|cells| cells * cell_mm);
    let offset = |axis: usize| hand.hip_mm[axis] - at_mm[axis];
    let cell_before_mm = before.scale_of_level_0().cell_mm();
    let place_before = [0, 1].map(|axis| at_mm[axis] / cell_before_mm);
    let (ground_before, before_is_known) = match hand.proxy_mm {
        Some(proxy) => (Some(proxy[2]), true),
        None => ground_of(before, [at_mm[0], at_mm[1]], place_before),
    };
    let (ground_after, after_is_known) = ground_of(after, [east, north], at);
    // At no-data the height stays the same.
    let risen = ground_before
        .zip(ground_after)
        .map_or(0.0, |(before, after)| after - before);
    let hip_mm = [east + offset(0), north + offset(1), hand.hip_mm[2] + risen];
    (hip_mm, before_is_known && after_is_known)
}

/// Returns a place on a terrain, device millimetres, from haptic cells of level 0; `None` if its
/// height is unknown or it has none.
fn place_on(terrain: &Terrain<'_>, at: [f64; 2]) -> Option<[f64; 3]> {
    let cell_mm = terrain.scale_of_level_0().cell_mm();
    let [east, north] = at.map(|cells| cells * cell_mm);
    let (height, _) = ground_of(terrain, [east, north], at);
    Some([east, north, height?])
}

/// Returns the ground height in mm at a place, given in millimetres and in haptic cells of level 0,
/// and true if it is known (no-data is known). If a coarse level has not been read here yet, the
/// finest level is used.
fn ground_of(terrain: &Terrain<'_>, [east, north]: [f64; 2], at: [f64; 2]) -> (Option<f64>, bool) {
    let (ground, status) = terrain.read_height_mm(east, north);
    if ground.is_some() || status.is_complete() {
        return (ground, true);
    }
    let (height, status) = terrain.grid().read_surface(at);
    let per_unit = terrain.scale().height_mm_per_unit();
    let ground = height.map(|height| height * per_unit);
    (ground, ground.is_some() || status.is_complete())
}

fn factor_of(factor: f64) -> Result<f64, ChangeError> {
    match factor.is_finite() && factor > 0.0 {
        true => Ok(factor),
        false => Err(ChangeError::Factor(factor)),
    }
}

fn within(grid: &HapticGrid<'_>, at: [f64; 2]) -> Result<(), ChangeError> {
    let last = [grid.columns(), grid.rows()].map(|count| f64::from(count) - 1.0);
    let inside = (0..2).all(|axis| (0.0..=last[axis]).contains(&at[axis]));
    inside.then_some(()).ok_or(ChangeError::Outside)
}

/// Refuses a scale that is too large or too small, unless the factor brings it closer to the limit.
fn check_size(grid: &HapticGrid<'_>, view: &Placement, factor: f64) -> Result<(), ChangeError> {
    let cell_mm = view.scale.cell_mm();
    let size_mm = f64::from(grid.columns().max(grid.rows()) - 1) * cell_mm;
    if factor > 1.0 && cell_mm > MAX_CELL_MM {
        return Err(ChangeError::NoDetail { cell_mm });
    }
    if factor < 1.0 && size_mm < MIN_TERRAIN_MM {
        return Err(ChangeError::TooSmall { size_mm });
    }
    Ok(())
}

#[cfg(test)]
#[path = "change_tests.rs"]
mod tests;
