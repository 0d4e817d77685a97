//! Materials: the surface of one class of ground, and a scene's table of them.
//!
//! The host sorts the ground into classes and sends the device each sample's index into the table,
//! so the device does not need the classes of the file. `active_material.rs` implements the
//! transition between materials.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::{SurfaceParams, Texture};
use crate::contact::Friction;
use crate::crc::{CRC, add};
use crate::force::Damping;

/// Time of the transition from one material to the next, seconds. So at a border of classes, a
/// force changes per second by at most ten times the difference of the two materials.
pub const MATERIAL_CHANGE_S: f32 = 0.1;

/// Surface of one class of ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Material {
    /// Newtons per millimetre between the HIP and the proxy.
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

    /// Returns the same parameters with this material; the limit, the controller and the shading
    /// stay the same.
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

    /// Returns true if all numbers are in their valid ranges.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.params(&SurfaceParams::PREMIUM).is_valid()
    }
}

/// Maximum number of materials, including the default: an index is half a byte.
const MAX_MATERIALS: usize = 16;

/// The materials of a scene. The first is the default, for ground without a class or with a class
/// that is not in the table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MaterialTable {
    materials: Vec<Material, MAX_MATERIALS>,
}

impl MaterialTable {
    /// Maximum number of materials, including the default.
    pub const MAX: usize = MAX_MATERIALS;
    /// An empty table, which is not valid in a scene.
    pub const EMPTY: Self = Self {
        materials: Vec::new(),
    };

    /// Creates a table of these materials, the default first; returns `None` without materials, or
    /// with more than [`Self::MAX`].
    #[must_use]
    pub fn new(materials: &[Material]) -> Option<Self> {
        let materials = Vec::from_slice(materials).ok()?;
        (!materials.is_empty()).then_some(Self { materials })
    }

    /// Returns the materials, the default first.
    #[must_use]
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// Returns true if there is a default with a stiffness, and all numbers are in their valid
    /// ranges.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let is_stiff = |default: &Material| default.stiffness_n_per_mm > 0.0;
        self.materials.first().is_some_and(is_stiff)
            && self.materials.iter().all(Material::is_valid)
    }

    /// Returns the identifier of a table ([`Scene::materials`](crate::scene::Scene::materials)):
    /// CRC-32 of all numbers, as little-endian bytes in the order of the fields.
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

    /// Returns the material of an index; the default for an unknown index.
    #[must_use]
    pub fn at(&self, index: u8) -> Option<&Material> {
        let named = self.materials.get(usize::from(index));
        named.or_else(|| self.materials.first())
    }

    /// Returns the factor by which surface parameters scale the stiffness of all materials: their
    /// stiffness divided by the default's. A placement that is twice as stiff is so on each
    /// material.
    #[must_use]
    pub fn stiffness_scale(&self, params: &SurfaceParams) -> f32 {
        let default = self.at(0).map_or(0.0, |default| default.stiffness_n_per_mm);
        match default > 0.0 {
            true => params.stiffness_n_per_mm / default,
            false => 1.0,
        }
    }

    /// Returns surface parameters with the maximum stiffness and the maximum damping of all
    /// materials: a stability rule must hold for them.
    #[must_use]
    pub fn hardest(&self, params: &SurfaceParams) -> SurfaceParams {
        let max_of = |of: fn(&Material) -> f32| {
            let all = self.materials.iter().map(of);
            all.fold(0.0, |max: f32, one| max.max(one))
        };
        SurfaceParams {
            stiffness_n_per_mm: max_of(|m| m.stiffness_n_per_mm) * self.stiffness_scale(params),
            damping: Damping {
                ns_per_m: max_of(|m| m.damping_ns_per_m),
                ..params.damping
            },
            ..*params
        }
    }

    /// Returns the friction of one material that has friction, or none if all are frictionless.
    #[must_use]
    pub(crate) fn some_friction(&self) -> Friction {
        let mut all = self.materials.iter().map(|material| material.friction);
        all.find(|friction| !friction.is_none())
            .unwrap_or(Friction::NONE)
    }
}
