//! Options for the rendering of a terrain, shared by `replay`, `run`, `demo` and `view`.

use super::exaggeration::Exaggeration;
use super::level::LevelChoice;
use super::scale::MapScale;
use super::surface::SurfaceOptions;
use crate::cli::failure::{Failure, OrHint};
use crate::place::{TIPS_MM, suited_height};
use crate::quantity::LENGTH;
use crate::terrain::{HapticCells, HapticGrid, MAX_TIP_CELLS, Scale, Terrain};
use heightfield::Raster;

/// Default radius of the ball at an arm's tip, mm: with a friction of 0.4 it does not get stuck on
/// any tested ground (docs/explanation/tip.md).
const HAND_MM: f64 = 7.0;

/// Rendering of the terrain.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Place and scale")]
pub struct Rendering {
    /// Ground metres per device mm (5m/mm), or mm per cell (1.5mm/cell)
    ///
    /// [default: replay 1mm/cell; else the terrain is fitted to the workspace, and with --at it is
    /// 1mm/cell] mm/cell is the size of a haptic cell; a number alone is in m/mm.
    #[arg(long, value_name = "SCALE", allow_negative_numbers = true)]
    pub scale: Option<MapScale>,

    /// Factor on the true height, auto, or 0.05mm/unit
    ///
    /// [default: 1] mm/unit: device millimetres per vertical unit of the file. auto: the factor that
    /// makes 15 mm of relief, at least 1. A file that states no size of its cells has no true scale:
    /// without this option a vertical unit is 1 mm, or the relief is fitted.
    #[arg(long, value_name = "TIMES|auto", allow_hyphen_values = true)]
    pub exaggeration: Option<Exaggeration>,

    /// Level of detail: every 2^LEVEL-th sample, or by-speed
    ///
    /// [default: replay 0, else the finest that the encoders resolve] by-speed: `run` and `demo`
    /// begin at that level, and render a coarser one while the pressing hand is fast.
    #[arg(long, value_name = "LEVEL|by-speed")]
    pub level: Option<LevelChoice>,

    /// Radius of the ball at the tip, such as 2mm
    ///
    /// [default: 7mm; replay 0mm] The HIP is the ball's centre; 0 is a point, the default with --level. The level is such that the
    /// radius is at most 8 cells.
    #[arg(long, value_name = "MM", allow_negative_numbers = true,
          value_parser = |text: &str| LENGTH.read_within(text, TIPS_MM))]
    pub tip: Option<f64>,

    /// Surface of the terrain.
    #[command(flatten)]
    pub surface: SurfaceOptions,
}

impl Rendering {
    /// Returns the stated level, if there is one.
    #[must_use]
    pub const fn fixed_level(&self) -> Option<u8> {
        match self.level {
            Some(LevelChoice::Fixed(level)) => Some(level),
            Some(LevelChoice::BySpeed) | None => None,
        }
    }

    /// Returns true if the level follows the hand's speed.
    #[must_use]
    pub fn is_level_by_speed(&self) -> bool {
        self.level == Some(LevelChoice::BySpeed)
    }

    /// Checks that the level is a number, or the default, for a command without a hand.
    ///
    /// # Errors
    /// The level follows the hand's speed.
    pub fn check_level_without_hand(&self) -> Result<(), Failure> {
        match self.is_level_by_speed() {
            true => Err("--level by-speed is for `run` and `demo`: there is no hand here")
                .or_hint("state a level such as --level 2, or leave the option out"),
            false => Ok(()),
        }
    }

    /// Logs that the level does not follow the hand's speed on a terrain with materials.
    pub fn warn_if_level_is_kept(&self, has_materials: bool) {
        if has_materials && self.is_level_by_speed() {
            tracing::warn!("--level by-speed has no effect on a terrain with materials");
        }
    }

    /// Returns the scale of the options, with defaults.
    ///
    /// # Errors
    /// A terrain cannot be scaled with these numbers.
    pub fn scale(&self, grid: &HapticGrid<'_>) -> Result<Scale, Failure> {
        let cell_mm = match self.scale {
            None => 1.0,
            Some(scale) => scale
                .cell_mm(grid.side_m())
                .ok_or("the file does not state its cell size on the ground")
                .or_hint("state the size of a cell, as --scale 1mm/cell, or of the file's cells, as --input cell=30m")?,
        };
        let plain = || grid.true_scale(cell_mm);
        let scale = match self.exaggeration.unwrap_or_default() {
            Exaggeration::MmPerUnit(height) => Scale::new(cell_mm, height),
            Exaggeration::Auto => plain().and_then(|plain| {
                let (plain, summary) = (plain.height_mm_per_unit(), grid.raster().summary());
                let relief = summary.highest - summary.lowest;
                Scale::new(cell_mm, suited_height(plain, relief))
            }),
            Exaggeration::Times(times) => {
                plain().and_then(|plain| Scale::new(cell_mm, plain.height_mm_per_unit() * times))
            }
        };
        scale.or_hint("choose another --scale or --exaggeration")
    }

    /// Returns the grid of a raster. Its cells are those at a place in its coordinates, by default
    /// in its middle.
    #[must_use]
    pub fn grid<'r>(
        &self,
        (raster, cells): (&'r Raster, HapticCells),
        measured_at: Option<[f64; 2]>,
    ) -> HapticGrid<'r> {
        let grid = match measured_at {
            Some(ground) => HapticGrid::at(raster, cells, ground),
            None => HapticGrid::new(raster, cells),
        };
        grid.with_tip(self.tip.unwrap_or(0.0))
    }

    /// Returns the radius of the ball at an arm's tip, mm. With a stated level the default is a
    /// point.
    #[must_use]
    pub fn tip_of_hand_mm(&self) -> f64 {
        let default_mm = if self.level.is_none() { HAND_MM } else { 0.0 };
        self.tip.unwrap_or(default_mm)
    }

    /// Returns the terrain at a scale. The default level is the finest in which the tip is at most
    /// `MAX_TIP_CELLS` large.
    ///
    /// # Errors
    /// Positions cannot represent its heights or size, or the level is too high.
    pub fn terrain<'r>(&self, grid: HapticGrid<'r>, scale: Scale) -> Result<Terrain<'r>, Failure> {
        let holds = |level: &u8| grid.tip_mm() / scale.at_level(*level).cell_mm() <= MAX_TIP_CELLS;
        let level = self.fixed_level().or_else(|| (0..31).find(holds));
        Ok(Terrain::over(grid, scale, level.unwrap_or(0))?)
    }
}
