//! Options that say how a terrain feels, shared by `replay`, `run` and `demo`.

use hapterra_core::contact::Friction;
use hapterra_core::force::{Controller, Damping, ForceLaw, Shading};

use super::exaggeration::Exaggeration;
use super::materials::SurfaceMaterials;
use super::texture::SurfaceTexture;
use crate::cli::failure::{Failure, OrHint};
use crate::place::{Heights, suited_height};
use crate::replay::Rule;
use crate::terrain::{FeltCells, FeltGrid, MAX_TIP_CELLS, Scale, Terrain};
use heightfield::Raster;

/// Radius of the ball by which a hand feels the ground unless another is stated, mm: with a friction
/// of 0.4 no ground that was tried holds it (docs/explanation/tip.md).
const HAND_MM: f64 = 7.0;

/// How the terrain feels.
#[derive(Clone, Debug, Default, clap::Args)]
#[command(next_help_heading = "Feel")]
pub struct Rendering {
    /// Hand millimetres a felt cell of level 0 [default: replay 1, else as --fit has it]
    #[arg(long, value_name = "MM")]
    pub cell_mm: Option<f64>,

    /// Hand millimetres a vertical unit of the file [default: its true
    /// proportions where it knows its cell size, else 1]
    #[arg(
        long,
        value_name = "MM",
        allow_negative_numbers = true,
        conflicts_with = "exaggeration"
    )]
    pub height_mm_per_unit: Option<f64>,

    /// Times that heights are felt higher than true to scale; `auto`: as many as make 15 mm
    /// of relief, and none where there is more [default: 1]
    #[arg(long, value_name = "TIMES|auto", allow_negative_numbers = true)]
    pub exaggeration: Option<Exaggeration>,

    /// Which cells of the file are felt [default: square]
    #[arg(long, value_enum)]
    pub cells: Option<FeltCells>,

    /// Level of detail: every 2^LEVEL-th sample is felt [default: replay 0, else the finest
    /// that the encoders tell]
    #[arg(long)]
    pub level: Option<u8>,

    /// Radius of the ball at the tip, hand millimetres: 2 or 2mm. The HIP is its centre; a level
    /// is felt in which it is at most 8 cells large [default: run and demo 7, replay 0, a point;
    /// with --level 0]
    #[arg(long, value_name = "MM", value_parser = tip_mm, allow_negative_numbers = true)]
    pub tip: Option<f64>,

    /// Stiffness of the surface [default: 0.5]
    #[arg(long, value_name = "N/MM")]
    pub stiffness_n_per_mm: Option<f32>,

    /// Largest force [default: 8.5]
    #[arg(long, value_name = "N")]
    pub max_force_n: Option<f32>,

    /// Friction: tangential over normal force while the tip slides [default: 0, like ice]
    #[arg(long, value_name = "MU", allow_negative_numbers = true)]
    pub friction: Option<f32>,

    /// The same until it begins to slide [default: as --friction]
    #[arg(long, value_name = "MU", allow_negative_numbers = true)]
    pub static_friction: Option<f32>,

    /// Friction that grows with the speed: the time by which the tip trails; as a
    /// coefficient, this times the stiffness [default: 0]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub viscous_friction: Option<f32>,

    /// Damping along the force, N·s/m: at most as much as the spring's force [default: 0]
    #[arg(long, value_name = "NS/M", allow_negative_numbers = true)]
    pub damping_ns_per_m: Option<f32>,

    /// Whether the passivity controller acts: it takes back the energy that a spring which is felt
    /// in ticks creates [default: on]
    #[arg(long, value_enum)]
    pub passivity: Option<PassivityController>,

    /// Whether the force turns evenly over the edges between patches [default: none]
    #[arg(long, value_enum)]
    pub shading: Option<ForceShading>,

    /// The micro-relief.
    #[command(flatten)]
    pub texture: SurfaceTexture,

    /// The materials.
    #[command(flatten)]
    pub materials: SurfaceMaterials,

    /// Contact rule where it is not that of devices: `hapterra-lab replay` states it.
    #[arg(skip)]
    pub contact: Option<Rule>,
}

/// A radius in millimetres, with or without the unit.
fn tip_mm(text: &str) -> Result<f64, String> {
    let number = text.strip_suffix("mm").unwrap_or(text).trim();
    let radius = number.parse().ok().filter(|mm| (0.0..=100.0).contains(mm));
    radius.ok_or_else(|| "a radius from 0 to 100 mm, as 2 or 2mm".to_owned())
}

/// Which normals the force follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum ForceShading {
    /// Those of the patches
    None,
    /// Normals that turn evenly from patch to patch
    Smooth,
}

/// Whether the passivity controller acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum PassivityController {
    /// As on. Earlier versions decided by the stiffness
    #[value(hide = true)]
    Auto,
    /// Wherever a current may flow
    On,
    /// Never
    Off,
}

impl Rendering {
    /// The scale: as stated, the rest by default.
    ///
    /// # Errors
    /// Numbers that no terrain can be scaled with.
    pub fn scale(&self, grid: &FeltGrid<'_>) -> Result<Scale, Failure> {
        let cell_mm = self.cell_mm.unwrap_or(1.0);
        let plain = grid.true_scale(cell_mm);
        let scale = match (
            self.height_mm_per_unit,
            self.exaggeration.unwrap_or_default(),
        ) {
            (Some(height), _) => Scale::new(cell_mm, height),
            (None, Exaggeration::Auto) => plain.and_then(|plain| {
                let (plain, summary) = (plain.height_mm_per_unit(), grid.raster().summary());
                let relief = summary.highest - summary.lowest;
                Scale::new(cell_mm, suited_height(plain, relief))
            }),
            (None, Exaggeration::Times(times)) => {
                plain.and_then(|plain| Scale::new(cell_mm, plain.height_mm_per_unit() * times))
            }
        };
        scale.or_hint("choose another --cell-mm, --exaggeration or --height-mm-per-unit")
    }

    /// How high the terrain is asked to be.
    #[must_use]
    pub fn heights(&self) -> Heights {
        match (
            self.height_mm_per_unit,
            self.exaggeration.unwrap_or_default(),
        ) {
            (Some(height), _) => Heights::MmPerUnit(height),
            (None, Exaggeration::Times(times)) => Heights::Exaggerated(times),
            (None, Exaggeration::Auto) => Heights::Suited,
        }
    }

    /// The grid that is felt of a raster, of cells as they are at a place in its
    /// coordinates, else in its middle.
    #[must_use]
    pub fn grid<'r>(&self, raster: &'r Raster, measured_at: Option<[f64; 2]>) -> FeltGrid<'r> {
        let cells = self.cells.unwrap_or_default();
        let grid = match measured_at {
            Some(ground) => FeltGrid::at(raster, cells, ground),
            None => FeltGrid::new(raster, cells),
        };
        grid.with_tip(self.tip_mm())
    }

    /// Radius of the ball at the tip, hand millimetres; 0 for a point.
    #[must_use]
    pub fn tip_mm(&self) -> f64 {
        self.tip.unwrap_or(0.0)
    }

    /// The same of an arm that a hand holds: a stated level is felt by a point.
    #[must_use]
    pub fn tip_of_hand_mm(&self) -> f64 {
        let usual = if self.level.is_none() { HAND_MM } else { 0.0 };
        self.tip.unwrap_or(usual)
    }

    /// The terrain at a scale; without a stated level the finest in which the tip is not too many
    /// cells large.
    ///
    /// # Errors
    /// Heights or a size that positions cannot say, or a level too high.
    pub fn terrain<'r>(&self, grid: FeltGrid<'r>, scale: Scale) -> Result<Terrain<'r>, Failure> {
        let holds = |level: &u8| grid.tip_mm() / scale.at_level(*level).cell_mm() <= MAX_TIP_CELLS;
        let level = self.level.or_else(|| (0..31).find(holds));
        Ok(Terrain::over(grid, scale, level.unwrap_or(0))?)
    }

    /// The force law.
    ///
    /// # Errors
    /// A stiffness or limit that is negative or not finite.
    pub fn law(&self) -> Result<ForceLaw, Failure> {
        let usual = ForceLaw::PREMIUM;
        let law = ForceLaw {
            stiffness_n_per_mm: self.stiffness_n_per_mm.unwrap_or(usual.stiffness_n_per_mm),
            max_force_n: self.max_force_n.unwrap_or(usual.max_force_n),
            friction: self.surface()?,
            damping: self.damping()?,
            shading: self.normals(),
            texture: self.texture.relief()?,
        };
        let plain = ForceLaw {
            stiffness_n_per_mm: law.stiffness_n_per_mm,
            max_force_n: law.max_force_n,
            damping: Damping {
                ns_per_m: 0.0,
                ..law.damping
            },
            ..ForceLaw::PREMIUM
        };
        if self.rule() == Rule::Paper && law != plain {
            return Err("an effect with the paper's contact rule, which has none".to_owned())
                .or_hint("leave --contact paper out, or friction, damping, shading and texture");
        }
        let ForceLaw {
            stiffness_n_per_mm: k,
            max_force_n: limit,
            ..
        } = law;
        law.is_valid()
            .then_some(law)
            .ok_or_else(|| {
                format!("a stiffness of {k} N/mm and a limit of {limit} N: both must be finite and not negative")
            })
            .or_hint("leave --stiffness-n-per-mm and --max-force-n out for 0.5 N/mm and 8.5 N")
    }

    /// How rough the surface is.
    ///
    /// # Errors
    /// Coefficients that no surface has.
    fn surface(&self) -> Result<Friction, Failure> {
        let dynamic_mu = self.friction.unwrap_or(0.0);
        let friction = Friction {
            dynamic_mu,
            static_mu: self.static_friction.unwrap_or(dynamic_mu),
            viscous_s: self.viscous_friction.unwrap_or(0.0),
        };
        if !friction.is_valid() {
            let Friction {
                static_mu,
                viscous_s,
                ..
            } = friction;
            let why = format!(
                "a friction of {dynamic_mu}, {static_mu} at rest, trailing by {viscous_s} s"
            );
            return Err(why).or_hint(format!(
                "--friction from 0 to {}, --static-friction not below it, --viscous-friction from 0 to {} s",
                Friction::MOST,
                Friction::MOST_VISCOUS_S
            ));
        }
        Ok(friction)
    }

    /// What takes energy out of a motion against the surface.
    ///
    /// # Errors
    /// Damping that no tick can make.
    fn damping(&self) -> Result<Damping, Failure> {
        let ns_per_m = self.damping_ns_per_m.unwrap_or(0.0);
        if self.passivity == Some(PassivityController::Auto) {
            tracing::warn!("--passivity auto is on: the controller acts on every surface");
        }
        let damping = Damping {
            ns_per_m,
            controller: match self.passivity {
                None | Some(PassivityController::Auto | PassivityController::On) => Controller::On,
                Some(PassivityController::Off) => Controller::Off,
            },
        };
        damping
            .is_valid()
            .then_some(damping)
            .ok_or_else(|| format!("a damping of {ns_per_m} N·s/m"))
            .or_hint(format!(
                "--damping-ns-per-m from 0 to {}",
                Damping::MOST_NS_PER_M
            ))
    }

    /// Which normals the force follows.
    const fn normals(&self) -> Shading {
        match self.shading {
            None | Some(ForceShading::None) => Shading::None,
            Some(ForceShading::Smooth) => Shading::Smooth,
        }
    }

    /// Returns an error if the paper's contact rule is asked for, which no device has.
    ///
    /// # Errors
    /// The rule, and where it is.
    pub fn needs_the_devices_rule(&self) -> Result<(), Failure> {
        match self.rule() {
            Rule::Swept => Ok(()),
            Rule::Paper => {
                Err("--contact paper: no device has the paper's contact rule".to_owned()).or_hint(
                    "leave it out, or render a trajectory: hapterra-lab replay --contact paper",
                )
            }
        }
    }

    /// The contact rule.
    #[must_use]
    pub const fn rule(&self) -> Rule {
        match self.contact {
            None => Rule::Swept,
            Some(rule) => rule,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damping_that_no_tick_can_make_is_refused() {
        for bad in [-1.0, 20.5, f32::NAN, f32::INFINITY] {
            let rendering = Rendering {
                damping_ns_per_m: Some(bad),
                ..Rendering::default()
            };
            assert!(rendering.law().is_err(), "{bad}");
        }
    }

    #[test]
    fn friction_that_no_surface_has_is_refused_with_what_to_do() {
        let with = |friction, static_friction, viscous_friction| Rendering {
            friction,
            static_friction,
            viscous_friction,
            ..Rendering::default()
        };
        let bad = [
            with(Some(-0.1), None, None),
            with(Some(f32::NAN), None, None),
            with(Some(0.5), Some(0.4), None),
            with(Some(11.0), None, None),
            with(None, None, Some(-0.1)),
            Rendering {
                contact: Some(Rule::Paper),
                ..with(Some(0.5), None, None)
            },
        ];
        for rendering in bad {
            assert!(rendering.law().is_err(), "{rendering:?}");
        }
        let law = with(Some(0.5), None, None).law().expect("valid");
        assert_eq!(law.friction, Friction::coulomb(0.5));
        let law = with(None, Some(0.2), None).law().expect("valid");
        assert_eq!(
            (law.friction.static_mu, law.friction.dynamic_mu),
            (0.2, 0.0)
        );
    }
}
