//! Materials: what a class of ground feels like, and the table of them that a scene has.
//!
//! The host sorts the ground into classes, and tells the device which material of the table
//! each sample has; so the device needs no classes of the file.
//! `active_material.rs` beside this file has how one material follows another.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::{SurfaceParams, Texture};
use crate::contact::Friction;
use crate::crc::{CRC, add};
use crate::force::Damping;

/// Time from one material to the next, seconds. So a border of
/// classes changes a force by at most ten times a second what the two materials differ by.
pub const MATERIAL_CHANGE_S: f32 = 0.1;

/// Surface of one class of ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Material {
    /// Newtons for a millimetre between the HIP and the proxy.
    pub stiffness_n_per_mm: f32,
    /// Its friction.
    pub friction: Friction,
    /// Damping along the force, N·s/m, as [`Damping::ns_per_m`].
    pub damping_ns_per_m: f32,
    /// Its micro-relief.
    pub texture: Texture,
}

impl Material {
    /// Returns the material that a scene's surface parameters describe.
    #[must_use]
    pub const fn of(params: &SurfaceParams) -> Self {
        Self {
            stiffness_n_per_mm: params.stiffness_n_per_mm,
            friction: params.friction,
            damping_ns_per_m: params.damping.ns_per_m,
            texture: params.texture,
        }
    }

    /// The same parameters with this material; the limit, the controller and the shading
    /// stay.
    #[must_use]
    pub const fn params(&self, params: &SurfaceParams) -> SurfaceParams {
        SurfaceParams {
            stiffness_n_per_mm: self.stiffness_n_per_mm,
            friction: self.friction,
            damping: Damping {
                ns_per_m: self.damping_ns_per_m,
                ..params.damping
            },
            texture: self.texture,
            ..*params
        }
    }

    /// Returns true if its numbers are such that a loop can work with.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.params(&SurfaceParams::PREMIUM).is_valid()
    }
}

/// Most materials, the default among them: an index is half a byte.
const MAX_MATERIALS: usize = 16;

/// The materials of a scene. The first is the default: the material where the ground has no
/// class, or one that the table does not name.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MaterialTable {
    materials: Vec<Material, MAX_MATERIALS>,
}

impl MaterialTable {
    /// Most materials, the default among them.
    pub const MOST: usize = MAX_MATERIALS;
    /// A table without any, which no scene can have.
    pub const EMPTY: Self = Self {
        materials: Vec::new(),
    };

    /// A table of these materials, the default first; `None` where there are none, or more
    /// than [`Self::MOST`].
    #[must_use]
    pub fn new(materials: &[Material]) -> Option<Self> {
        let materials = Vec::from_slice(materials).ok()?;
        (!materials.is_empty()).then_some(Self { materials })
    }

    /// The materials, the default first.
    #[must_use]
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// Returns true if there is a default with a stiffness, and all numbers are such that a loop can
    /// work with.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let is_stiff = |default: &Material| default.stiffness_n_per_mm > 0.0;
        self.materials.first().is_some_and(is_stiff)
            && self.materials.iter().all(Material::is_valid)
    }

    /// Tells tables apart ([`Scene::materials`](crate::scene::Scene::materials)): a check sum of
    /// all numbers, CRC-32 over their little-endian bytes in the order of the fields.
    #[must_use]
    pub fn check_sum(&self) -> u32 {
        let mut digest = CRC.digest();
        for material in &self.materials {
            let Material {
                stiffness_n_per_mm,
                friction,
                damping_ns_per_m,
                texture,
            } = material;
            let numbers = [
                *stiffness_n_per_mm,
                friction.static_mu,
                friction.dynamic_mu,
                friction.viscous_s,
                *damping_ns_per_m,
                texture.amplitude_mm,
                texture.wavelength_mm,
                texture.direction_deg,
            ];
            for number in numbers {
                add(&mut digest, &number.to_le_bytes());
            }
            add(&mut digest, &texture.seed.to_le_bytes());
            add(&mut digest, &[texture.pattern as u8]);
        }
        digest.finalize()
    }

    /// The material of an index; the default's where there is no such one.
    #[must_use]
    pub fn at(&self, index: u8) -> Option<&Material> {
        let named = self.materials.get(usize::from(index));
        named.or_else(|| self.materials.first())
    }

    /// Factor of surface parameters on the stiffness of all materials: their own stiffness over
    /// the default's. A placement that is twice as stiff is so on each material.
    #[must_use]
    pub fn stiffness_scale(&self, params: &SurfaceParams) -> f32 {
        let default = self.at(0).map_or(0.0, |default| default.stiffness_n_per_mm);
        match default > 0.0 {
            true => params.stiffness_n_per_mm / default,
            false => 1.0,
        }
    }

    /// Surface parameters as stiff as the stiffest material, and as damped as the most damped: a
    /// stability rule has to hold for them.
    #[must_use]
    pub fn hardest(&self, params: &SurfaceParams) -> SurfaceParams {
        let most = |of: fn(&Material) -> f32| {
            let all = self.materials.iter().map(of);
            all.fold(0.0, |most: f32, one| most.max(one))
        };
        SurfaceParams {
            stiffness_n_per_mm: most(|m| m.stiffness_n_per_mm) * self.stiffness_scale(params),
            damping: Damping {
                ns_per_m: most(|m| m.damping_ns_per_m),
                ..params.damping
            },
            ..*params
        }
    }

    /// A friction that one of the materials has; none where all are like ice.
    #[must_use]
    pub(crate) fn some_friction(&self) -> Friction {
        let mut all = self.materials.iter().map(|material| material.friction);
        all.find(|friction| !friction.is_none())
            .unwrap_or(Friction::NONE)
    }
}
