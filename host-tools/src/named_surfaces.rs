//! Surfaces by name.

use hapterra_core::contact::Friction;
use hapterra_core::force::{Material, Pattern, Texture};

/// A surface with a name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NamedSurface {
    /// Its name.
    pub name: &'static str,
    /// Its surface.
    pub material: Material,
}

/// The named surfaces. Their numbers are chosen for a Phantom Premium 1.5, whose users tolerate 0.4
/// to 0.8 N/mm; they are not measurements of ground.
pub static NAMED_SURFACES: [NamedSurface; 3] = [
    NamedSurface {
        name: "ice",
        material: Material {
            stiffness_n_per_mm: 0.5,
            friction: Friction::NONE,
            damping_ns_per_m: 0.0,
            texture: Texture::NONE,
        },
    },
    NamedSurface {
        name: "sand",
        material: Material {
            stiffness_n_per_mm: 0.4,
            friction: Friction::coulomb(0.5),
            damping_ns_per_m: 2.0,
            texture: Texture {
                pattern: Pattern::Grain,
                amplitude_mm: 0.1,
                wavelength_mm: 1.5,
                direction_deg: 0.0,
                seed: 0,
            },
        },
    },
    NamedSurface {
        name: "rock",
        material: Material {
            stiffness_n_per_mm: 0.8,
            friction: Friction {
                static_mu: 0.6,
                dynamic_mu: 0.4,
                viscous_s: 0.0,
            },
            damping_ns_per_m: 0.0,
            texture: Texture {
                pattern: Pattern::Grain,
                amplitude_mm: 0.05,
                wavelength_mm: 0.8,
                direction_deg: 0.0,
                seed: 0,
            },
        },
    },
];

impl NamedSurface {
    /// Returns the surface with a name.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        NAMED_SURFACES.iter().find(|surface| surface.name == name)
    }
}

#[cfg(test)]
mod tests {
    use hapterra_core::force::SurfaceParams;
    use hapterra_core::rate::TickRate;

    use super::*;
    use crate::place::MAX_STIFFNESS_N_PER_MM;

    #[test]
    fn named_surfaces_can_be_rendered() {
        for NamedSurface { name, material } in NAMED_SURFACES {
            assert!(material.is_valid(), "{name}");
            assert!(
                material.stiffness_n_per_mm <= MAX_STIFFNESS_N_PER_MM,
                "{name}"
            );
            let texture = &material.texture;
            let shortest_mm = Texture::shortest_mm(TickRate::default());
            assert!(
                texture.is_none() || texture.wavelength_mm >= shortest_mm,
                "{name}"
            );
        }
        let ice = NamedSurface::find("ice").map(|ice| ice.material);
        assert_eq!(ice, Some(Material::of(&SurfaceParams::PREMIUM)));
        assert_eq!(NamedSurface::find("mud"), None);
    }
}
