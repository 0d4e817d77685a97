//! Surface of a segment's ground: frictionless, or effects and materials drawn at random.

use hapterra::materials::{ClassMaterial, ClassMaterials, Materials};
use hapterra_core::contact::Friction;
use hapterra_core::force::{
    Controller, Damping, Material, MaterialTable, Pattern, Shading, SurfaceParams, Texture,
};
use heightfield::Raster;

use crate::random::Random;

/// Ground of a segment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ground {
    /// The spring alone, frictionless.
    #[default]
    Ice,
    /// Surface drawn by the segment's number: friction, shading, texture, damping, the controller,
    /// materials.
    Drawn,
}

impl Ground {
    /// Returns its option of `cargo xtask campaign`, after a space.
    #[must_use]
    pub const fn option(self) -> &'static str {
        match self {
            Self::Ice => "",
            Self::Drawn => " --effects",
        }
    }
}

/// The effects of a segment.
#[derive(Clone, Debug)]
pub struct Effects {
    params: SurfaceParams,
    classes: Vec<Material>,
    /// Terrain samples along a pixel of the classes.
    pixel: u32,
}

impl Effects {
    /// Draws the effects of a segment with a generator of its own.
    #[must_use]
    pub fn drawn(seed: u64, segment: u64) -> Self {
        let mut random = Random::new(!seed ^ segment.wrapping_mul(0xd134_2543_de82_ef95));
        let random = &mut random;
        let controller = [Controller::Off, Controller::On][random.below(2)];
        let stiffness_n_per_mm = match random.below(2) {
            0 => random.between(0.3, 0.9),
            _ => random.between(1.0, 2.0),
        };
        let default = material(random, stiffness_n_per_mm as f32);
        let params = SurfaceParams {
            max_force_n: [8.5, 8.5, 3.0][random.below(3)],
            shading: [Shading::None, Shading::None, Shading::Smooth][random.below(3)],
            ..default.params(&SurfaceParams {
                damping: Damping {
                    controller,
                    ..Damping::NONE
                },
                ..SurfaceParams::PREMIUM
            })
        };
        let classes = match random.below(2) {
            0 => 0,
            _ => 1 + random.below(MaterialTable::MAX - 1),
        };
        // With one stiffness everywhere, the ground is a spring in the energy checks.
        let is_even = random.below(2) == 0;
        let mut class = |_| {
            let times = match is_even {
                true => 1.0,
                false => [0.0, 0.2, 0.6, 1.0, 1.7][random.below(5)],
            };
            material(random, (stiffness_n_per_mm * times) as f32)
        };
        let classes = (0..classes).map(&mut class).collect();
        let pixel = [1, 3, 10, 60][random.below(4)];
        Self {
            params,
            classes,
            pixel,
        }
    }

    /// Returns the materials over a terrain, if the segment has any.
    ///
    /// # Panics
    /// If the terrain has no samples.
    #[must_use]
    pub fn materials(&self, terrain: &Raster, samples: u32) -> Option<Materials> {
        let count = self.classes.len() as u64;
        if count == 0 {
            return None;
        }
        let classes = Raster::from_fn(samples, samples, |column, row| {
            let place = u64::from(column / self.pixel) << 32 | u64::from(row / self.pixel);
            // One class is missing in the table and has the default.
            (Random::new(place).bits() % (count + 1)) as f32
        });
        let class = |(class, material): (i64, &Material)| ClassMaterial {
            class,
            name: None,
            material: *material,
        };
        let class_materials = ClassMaterials {
            default: Material::of(&self.params),
            class: (1..).zip(&self.classes).map(class).collect(),
        };
        let over = ("terrain", terrain);
        Materials::over(
            over,
            ("classes", classes.expect("classes")),
            class_materials,
        )
        .ok()
    }

    /// Returns the surface parameters of a scene with `times` the stiffness.
    #[must_use]
    pub const fn params(&self, times: f32) -> SurfaceParams {
        SurfaceParams {
            stiffness_n_per_mm: self.params.stiffness_n_per_mm * times,
            ..self.params
        }
    }
}

/// Draws a material with this stiffness.
fn material(random: &mut Random, stiffness_n_per_mm: f32) -> Material {
    let dynamic_mu = [0.0, 0.0, 0.2, 0.6, 1.5][random.below(5)];
    let friction = Friction {
        dynamic_mu,
        static_mu: dynamic_mu * [1.0, 1.0, 1.5][random.below(3)],
        viscous_s: [0.0, 0.0, 0.004][random.below(3)],
    };
    let pattern = [
        Pattern::None,
        Pattern::None,
        Pattern::Grain,
        Pattern::Grating,
    ];
    let pattern = pattern[random.below(4)];
    let wavelength_mm = [0.5, 1.0, 2.5][random.below(3)];
    let texture = Texture {
        pattern,
        amplitude_mm: wavelength_mm * [0.02, 0.1][random.below(2)],
        wavelength_mm,
        direction_deg: random.between(-180.0, 180.0) as f32,
        seed: random.bits() as u32,
    };
    Material {
        stiffness_n_per_mm,
        friction,
        damping_ns_per_m: [0.0, 0.0, 1.0, 4.0][random.below(4)],
        texture: match pattern {
            Pattern::None => Texture::NONE,
            _ => texture,
        },
    }
}

/// The surface parameters of each material of a scene.
#[derive(Clone, Debug)]
pub struct SceneSurfaces {
    all_params: Vec<SurfaceParams>,
    hardest: SurfaceParams,
}

impl SceneSurfaces {
    /// Collects surface parameters, and those of a table if there is one.
    #[must_use]
    pub fn of(params: &SurfaceParams, table: Option<&MaterialTable>) -> Self {
        let Some(table) = table else {
            let (all_params, hardest) = (vec![*params], *params);
            return Self {
                all_params,
                hardest,
            };
        };
        let default = table
            .materials()
            .first()
            .map_or(params.stiffness_n_per_mm, |default| {
                default.stiffness_n_per_mm
            });
        let times = params.stiffness_n_per_mm / default;
        let of = |one: &Material| SurfaceParams {
            stiffness_n_per_mm: one.stiffness_n_per_mm * times,
            ..one.params(params)
        };
        Self {
            all_params: table.materials().iter().map(of).collect(),
            hardest: table.hardest(params),
        }
    }

    /// Returns the largest stiffness, N/mm.
    #[must_use]
    pub fn stiffest_n_per_mm(&self) -> f32 {
        self.all_params
            .iter()
            .fold(0.0, |max, params| params.stiffness_n_per_mm.max(max))
    }

    /// Returns the largest force of a spring at this depth, N.
    #[must_use]
    pub fn max_n(&self, depth_mm: f32) -> f32 {
        let spring_n = self.stiffest_n_per_mm() * depth_mm;
        spring_n.min(self.hardest.max_force_n)
    }

    /// Returns true if the passivity controller is on.
    #[must_use]
    pub const fn is_controlled(&self) -> bool {
        self.hardest.is_controlled()
    }

    /// Returns the energy of the stiffest spring at a depth, mJ, with a force of `max_n` at most.
    #[must_use]
    pub fn stored_mj(&self, depth_mm: f32, max_n: f32) -> f32 {
        let stiffness = self.stiffest_n_per_mm();
        let force_n = self.max_n(depth_mm).min(max_n);
        match stiffness > 0.0 {
            true => force_n * (depth_mm - 0.5 * force_n / stiffness),
            false => 0.0,
        }
    }

    /// Returns true if the force is that of one spring: no material has another stiffness.
    #[must_use]
    pub fn is_spring(&self) -> bool {
        let stiff = |params: &SurfaceParams| params.stiffness_n_per_mm;
        let mut pairs = self.all_params.windows(2);
        pairs.all(|pair| stiff(&pair[0]) == stiff(&pair[1]))
    }

    /// Returns true if any surface is damped.
    #[must_use]
    pub fn is_damped(&self) -> bool {
        self.all_params
            .iter()
            .any(|params| params.damping.ns_per_m > 0.0)
    }

    /// Returns the largest height of a texture, mm, and the largest slope.
    #[must_use]
    pub fn relief(&self) -> [f32; 2] {
        let relief = |max: [f32; 2], params: &SurfaceParams| {
            let texture = &params.texture;
            if texture.is_none() {
                return max;
            }
            let steep = std::f32::consts::TAU * texture.amplitude_mm / texture.wavelength_mm;
            [max[0].max(texture.amplitude_mm), max[1].max(steep)]
        };
        self.all_params.iter().fold([0.0; 2], relief)
    }

    /// Returns true if any surface is shaded.
    #[must_use]
    pub fn is_shaded(&self) -> bool {
        self.hardest.shading != Shading::None
    }
}
