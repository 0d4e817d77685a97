//! Options that say how a terrain feels, shared by `replay`, `run` and `demo`.

use hapterra_core::contact::Rule;
use hapterra_core::force::ForceLaw;

use crate::cli::failure::{Failure, OrHint};
use crate::raster::Raster;
use crate::terrain::{FeltCells, FeltGrid, Scale, Terrain};

/// How the terrain feels.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Feel")]
pub struct Rendering {
    /// Hand millimetres a cell [default: 1]
    #[arg(long, value_name = "MM")]
    pub cell_mm: Option<f64>,

    /// Hand millimetres a vertical unit of the file [default: its true
    /// proportions where it knows its cell size, else 1]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub height_mm_per_unit: Option<f64>,

    /// Which cells of the file are felt
    #[arg(long, value_enum, default_value_t)]
    pub cells: FeltCells,

    /// Level of detail: every 2^LEVEL-th sample is felt
    #[arg(long, default_value_t = 0)]
    pub level: u8,

    /// Stiffness of the surface
    #[arg(long, value_name = "N/MM", default_value_t = 0.5)]
    pub stiffness_n_per_mm: f32,

    /// Largest force
    #[arg(long, value_name = "N", default_value_t = 8.5)]
    pub max_force_n: f32,

    /// Contact rule
    #[arg(long, value_enum, default_value_t)]
    pub contact: ContactRule,
}

/// Contact rule.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum ContactRule {
    /// Continuous: nothing passes through the surface
    #[default]
    Swept,
    /// As published in the paper, for comparison
    Paper,
}

impl Rendering {
    /// The scale: as stated, the rest by default.
    ///
    /// # Errors
    /// Numbers that no terrain can be scaled with.
    pub fn scale(&self, grid: &FeltGrid<'_>) -> Result<Scale, Failure> {
        let cell_mm = self.cell_mm.unwrap_or(1.0);
        let scale = match self.height_mm_per_unit {
            Some(height) => Scale::new(cell_mm, height),
            None => Scale::true_to(grid, cell_mm),
        };
        scale.or_hint("choose another --cell-mm or --height-mm-per-unit")
    }

    /// The grid that is felt of a raster.
    #[must_use]
    pub fn grid<'r>(&self, raster: &'r Raster) -> FeltGrid<'r> {
        FeltGrid::new(raster, self.cells)
    }

    /// The terrain at a scale.
    ///
    /// # Errors
    /// Heights or a size that positions cannot say, or a level too high.
    pub fn terrain<'r>(&self, grid: FeltGrid<'r>, scale: Scale) -> Result<Terrain<'r>, Failure> {
        Ok(Terrain::over(grid, scale, self.level)?)
    }

    /// The force law.
    ///
    /// # Errors
    /// A stiffness or limit that is negative or not finite.
    pub fn law(&self) -> Result<ForceLaw, Failure> {
        let law = ForceLaw {
            stiffness_n_per_mm: self.stiffness_n_per_mm,
            max_force_n: self.max_force_n,
        };
        let ForceLaw {
            stiffness_n_per_mm: k,
            max_force_n: limit,
        } = law;
        law.is_valid()
            .then_some(law)
            .ok_or_else(|| {
                format!("a stiffness of {k} N/mm and a limit of {limit} N: both must be finite and not negative")
            })
            .or_hint("leave --stiffness-n-per-mm and --max-force-n out for 0.5 N/mm and 8.5 N")
    }

    /// The contact rule.
    #[must_use]
    pub const fn rule(&self) -> Rule {
        match self.contact {
            ContactRule::Swept => Rule::Swept,
            ContactRule::Paper => Rule::Paper,
        }
    }
}
