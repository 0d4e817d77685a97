//! Changes of a view while it is rendered: the view before and what is asked for make the next
//! one, or say why not.

use hapterra_core::force::SurfaceParams;

use super::placement::{Placement, finest_level};
use super::surface_change::{SurfaceChange, SurfaceError};
use crate::terrain::{HapticGrid, ScaleError, Terrain, TerrainError};

/// A sample of the file as large as this in the hand feels like one flat patch, mm.
const MAX_CELL_MM: f64 = 50.0;
/// The longer side of a terrain as small as this in the hand tells nothing any more, mm.
const SMALLEST_TERRAIN_MM: f64 = 5.0;
/// Above this an arm most likely buzzes or kicks, N/mm: people hold 0.4 to 0.8 N/mm on a
/// Premium 1.5 (`docs/reference/hardware.md`).
pub const STIFFEST_N_PER_MM: f32 = 1.0;
/// A smaller change is not noticeable, N/mm.
const SOFTEST_N_PER_MM: f32 = 0.005;
/// Smallest and largest radius of a ball at the tip, device millimetres; 0 is a point.
pub const TIPS_MM: [f64; 2] = [0.0, 100.0];

/// Change of a placement during a session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlacementChange {
    /// Another place under the hand: so many device millimetres farther east and north.
    Pan {
        /// Device millimetres east.
        east_mm: f64,
        /// Device millimetres north.
        north_mm: f64,
    },
    /// The same in ground metres.
    PanGround {
        /// Ground metres east.
        east_m: f64,
        /// Ground metres north.
        north_m: f64,
    },
    /// So many times larger, about the place under the hand.
    Zoom(f64),
    /// Heights so many times larger.
    Exaggerate(f64),
    /// A spring so many times stiffer.
    Stiffness(f64),
    /// Something else of the surface.
    Surface(SurfaceChange),
    /// A ball of another radius in device millimetres at the tip; 0 for a point.
    Tip(f64),
    /// Scale, heights, surface and tip of the beginning, at the place under the hand.
    Reset,
}

/// Reason for which a placement cannot be changed. It stays as it is.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ChangeError {
    /// A place beyond the samples.
    #[error("that place is outside of the terrain")]
    Outside,
    /// Ground metres, of a file without a size.
    #[error("the file does not state its cell size on the ground: pan by device millimetres")]
    NoGroundSize,
    /// A factor that is none.
    #[error("{0} is not a valid factor: it must be above zero, and finite")]
    Factor(f64),
    /// Larger than there is detail.
    #[error(
        "a sample of the file would be {cell_mm:.0} mm wide in the hand: it has no more detail"
    )]
    NoDetail {
        /// Device millimetres a haptic cell of level 0.
        cell_mm: f64,
    },
    /// Smaller than can be rendered.
    #[error("the whole terrain would be {size_mm:.1} mm wide in the hand")]
    TooSmall {
        /// Its longer side.
        size_mm: f64,
    },
    /// A spring that an arm cannot make.
    #[error(
        "a stiffness of {0:.3} N/mm: from {SOFTEST_N_PER_MM} to {STIFFEST_N_PER_MM} N/mm can be had"
    )]
    Stiffness(f32),
    /// The same of a material of the scene.
    #[error(
        "the stiffest of the materials would have {0:.3} N/mm: up to {STIFFEST_N_PER_MM} N/mm can be had"
    )]
    Material(f32),
    /// Something of the surface that cannot be had.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// A ball that no tip can have.
    #[error("a tip of {0} mm: from {least} to {most} mm can be had", least = TIPS_MM[0], most = TIPS_MM[1])]
    Tip(f64),
    /// Numbers that no terrain can be rendered at.
    #[error(transparent)]
    Terrain(#[from] TerrainError),
    /// A scale that none can have.
    #[error(transparent)]
    Scale(#[from] ScaleError),
}

/// A view, and its surface parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Laid {
    /// Place, scale, level and heights.
    pub view: Placement,
    /// Stiffness and limit.
    pub params: SurfaceParams,
}

/// Bounds of all placements of a session.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// The view of the beginning.
    pub first: Laid,
    /// Resolution of the encoders at the tip, mm.
    pub resolution_mm: f64,
    /// A level that the user has stated.
    pub level: Option<u8>,
    /// Radius of the ball of the beginning, device millimetres; 0 for a point.
    pub tip_mm: f64,
}

/// The HIP, and the place of the terrain about which the placement changes: device
/// millimetres of the view in force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// The HIP.
    pub hip_mm: [f64; 3],
    /// The proxy, while it touches.
    pub proxy_mm: Option<[f64; 3]>,
}

impl Hand {
    /// The place that a view is changed at.
    fn at_mm(&self) -> [f64; 3] {
        self.proxy_mm.unwrap_or(self.hip_mm)
    }

    /// Returns true if the cells of a terrain at this place are others than they are rendered
    /// ([`HapticGrid::measured_anew`]).
    #[must_use]
    pub fn is_far_from_measure(&self, terrain: &Terrain<'_>) -> bool {
        let cell_mm = terrain.scale_of_level_0().cell_mm();
        let [east, north, _] = self.at_mm();
        let anew = terrain
            .grid()
            .measured_anew([east / cell_mm, north / cell_mm]);
        anew.is_some()
    }
}

/// Another view, and where the HIP is in it.
#[derive(Clone)]
pub struct Changed<'r> {
    /// The view.
    pub laid: Laid,
    /// Its terrain.
    pub terrain: Terrain<'r>,
    /// The HIP, device millimetres of the new view. Its height over the place under
    /// the hand is what it was.
    pub hip_mm: [f64; 3],
    /// True if the heights that this follows from have been read. If not, the HIP has the
    /// height of before, and the same changes give the right one when they have come.
    pub ground_is_known: bool,
}

impl Bounds {
    /// Applies changes one after the other, at the place under the hand. Cells are then
    /// as large as they are there.
    ///
    /// # Errors
    /// [`ChangeError`] of the first that cannot be had; then nothing is changed.
    pub fn apply<'r>(
        &self,
        terrain: &Terrain<'r>,
        before: &Laid,
        changes: &[PlacementChange],
        hand: &Hand,
    ) -> Result<Changed<'r>, ChangeError> {
        let at_mm = hand.at_mm();
        let cell_mm = before.view.scale.cell_mm();
        let mut laid = *before;
        let mut at = [at_mm[0] / cell_mm, at_mm[1] / cell_mm];
        let mut grid = *terrain.grid();
        for change in changes {
            (laid, at) = self.step(&mut grid, laid, at, change)?;
        }
        if let Some(anew) = grid.measured_anew(at) {
            at = anew.of_ground(grid.to_ground(at));
            laid.view = laid.view.measured_as(&anew)?;
            grid = anew;
        }
        laid.view.level = match self.level {
            Some(level) => level,
            None => finest_level(&grid, self.resolution_mm, &laid.view.scale),
        };
        let terrain_after = terrain.relaid(grid, laid.view.scale, laid.view.level)?;
        let (hip_mm, ground_is_known) = hip_after((terrain, &terrain_after), hand, at_mm, at);
        let moved = |axis: usize| before.view.home_mm[axis] + hip_mm[axis] - hand.hip_mm[axis];
        let home_mm = [moved(0), moved(1), moved(2)];
        let was = (before.view.scale, terrain.grid());
        laid.view = laid.view.moved_to(&grid, home_mm, was);
        Ok(Changed {
            laid,
            ground_is_known,
            terrain: terrain_after,
            hip_mm,
        })
    }

    /// One change, at a place in haptic cells of level 0.
    fn step(
        &self,
        grid: &mut HapticGrid<'_>,
        mut laid: Laid,
        mut at: [f64; 2],
        change: &PlacementChange,
    ) -> Result<(Laid, [f64; 2]), ChangeError> {
        let Laid { view, params } = &mut laid;
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
                // A stiffness of the user's own may go down, and return.
                let most = STIFFEST_N_PER_MM.max(self.first.params.stiffness_n_per_mm);
                if !(SOFTEST_N_PER_MM..=most).contains(&stiffness) {
                    return Err(ChangeError::Stiffness(stiffness));
                }
                params.stiffness_n_per_mm = stiffness;
                // Other materials of the scene become as much stiffer.
                if let Some(materials) = grid.materials() {
                    let stiffest = |params| materials.table().hardest(params).stiffness_n_per_mm;
                    let (now, first) = (stiffest(params), stiffest(&self.first.params));
                    if now > STIFFEST_N_PER_MM.max(first) {
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
        Ok((laid, at))
    }
}

/// The HIP in the view that comes after: beside the place under the hand as far as before,
/// and as high over its ground, or as deep; and whether both grounds are known.
fn hip_after(
    (before, after): (&Terrain<'_>, &Terrain<'_>),
    hand: &Hand,
    at_mm: [f64; 3],
    at: [f64; 2],
) -> ([f64; 3], bool) {
    let cell_mm = after.scale_of_level_0().cell_mm();
    let [east, north] = at.map(|cells| cells * cell_mm);
    let beside = |axis: usize| hand.hip_mm[axis] - at_mm[axis];
    let cell_before_mm = before.scale_of_level_0().cell_mm();
    let place_before = [0, 1].map(|axis| at_mm[axis] / cell_before_mm);
    let (ground_before, before_is_known) = match hand.proxy_mm {
        Some(proxy) => (Some(proxy[2]), true),
        None => ground_of(before, [at_mm[0], at_mm[1]], place_before),
    };
    let (ground_after, after_is_known) = ground_of(after, [east, north], at);
    // Over a hole the height stays what it is.
    let risen = ground_before
        .zip(ground_after)
        .map_or(0.0, |(before, after)| after - before);
    let hip_mm = [east + beside(0), north + beside(1), hand.hip_mm[2] + risen];
    (hip_mm, before_is_known && after_is_known)
}

/// The ground at a place, in millimetres and in haptic cells of level 0. Where the terrain's level
/// is coarse and not here yet it is that of the finest level. And whether it is known: no-data is.
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

/// Refuses what is too large or too small, unless it comes nearer to what is not.
fn check_size(grid: &HapticGrid<'_>, view: &Placement, factor: f64) -> Result<(), ChangeError> {
    let cell_mm = view.scale.cell_mm();
    let size_mm = f64::from(grid.columns().max(grid.rows()) - 1) * cell_mm;
    if factor > 1.0 && cell_mm > MAX_CELL_MM {
        return Err(ChangeError::NoDetail { cell_mm });
    }
    if factor < 1.0 && size_mm < SMALLEST_TERRAIN_MM {
        return Err(ChangeError::TooSmall { size_mm });
    }
    Ok(())
}

#[cfg(test)]
#[path = "change_tests.rs"]
mod tests;
