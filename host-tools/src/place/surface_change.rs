//! Changes of a surface during a session.

use hapterra_core::contact::Friction;
use hapterra_core::force::{Damping, Shading, SurfaceParams, Texture};

use crate::named_surfaces::NamedSurface;

/// Change of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SurfaceChange {
    /// Coefficients of friction: dynamic and static.
    Friction {
        /// While the tip slides.
        dynamic_mu: f32,
        /// At rest.
        static_mu: f32,
    },
    /// Friction that grows with the speed, s.
    ViscousFriction(f32),
    /// Damping along the force, N·s/m.
    Damping(f32),
    /// The normals for the force's direction.
    Shading(Shading),
    /// The micro-relief.
    Texture(Texture),
    /// Another surface, including its stiffness.
    Named(&'static NamedSurface),
}

/// Reason why a surface cannot be changed. It stays as it is.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// Coefficients outside their range.
    #[error(
        "a friction of {dynamic_mu}, and {static_mu} at rest: from 0 to {max}, and at rest not less than while the tip slides",
        max = Friction::MAX
    )]
    Friction {
        /// While the tip slides.
        dynamic_mu: f32,
        /// At rest.
        static_mu: f32,
    },
    /// A time outside its range.
    #[error("a viscous friction of {0} s: from 0 to {max} s are possible", max = Friction::MAX_VISCOUS_S)]
    ViscousFriction(f32),
    /// Damping outside its range.
    #[error("a damping of {0} N·s/m: from 0 to {max} N·s/m are possible", max = Damping::MAX_NS_PER_M)]
    Damping(f32),
    /// A texture outside its range, or too fine for a tick.
    #[error(
        "a texture of {amplitude_mm} mm every {wavelength_mm} mm: a wavelength from {shortest} to {longest} mm, and an amplitude above 0 up to an eighth of it and {max} mm are possible",
        shortest = Texture::WAVELENGTHS_MM.0,
        longest = Texture::WAVELENGTHS_MM.1,
        max = Texture::MAX_AMPLITUDE_MM
    )]
    Texture {
        /// Height above and below the surface.
        amplitude_mm: f32,
        /// Distance from ridge to ridge.
        wavelength_mm: f32,
    },
    /// A quantity that each material of the scene has for itself.
    #[error(
        "each material of the scene has its own: change the table and start again, or start without --materials"
    )]
    OfMaterials,
}

impl SurfaceChange {
    /// Returns the surface parameters after this change; `has_materials` is true if the ground has
    /// several materials.
    ///
    /// # Errors
    /// [`SurfaceError`].
    pub fn of(
        self,
        params: &SurfaceParams,
        has_materials: bool,
    ) -> Result<SurfaceParams, SurfaceError> {
        let mut params = *params;
        if has_materials && !matches!(self, Self::Shading(_)) {
            return Err(SurfaceError::OfMaterials);
        }
        match self {
            Self::Friction {
                dynamic_mu,
                static_mu,
            } => {
                (params.friction.dynamic_mu, params.friction.static_mu) = (dynamic_mu, static_mu);
                let error = SurfaceError::Friction {
                    dynamic_mu,
                    static_mu,
                };
                params.friction.is_valid().then_some(params).ok_or(error)
            }
            Self::ViscousFriction(viscous_s) => {
                params.friction.viscous_s = viscous_s;
                let error = SurfaceError::ViscousFriction(viscous_s);
                params.friction.is_valid().then_some(params).ok_or(error)
            }
            Self::Damping(ns_per_m) => {
                params.damping.ns_per_m = ns_per_m;
                let error = SurfaceError::Damping(ns_per_m);
                params.damping.is_valid().then_some(params).ok_or(error)
            }
            Self::Shading(shading) => {
                params.shading = shading;
                Ok(params)
            }
            Self::Named(named) => Ok(named.material.params(&params)),
            Self::Texture(texture) => {
                params.texture = texture;
                let error = SurfaceError::Texture {
                    amplitude_mm: texture.amplitude_mm,
                    wavelength_mm: texture.wavelength_mm,
                };
                let is_rendered = texture.is_none() || texture.amplitude_mm > 0.0;
                (is_rendered && texture.is_valid())
                    .then_some(params)
                    .ok_or(error)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hapterra_core::force::{Material, Pattern};

    fn texture(amplitude_mm: f32, wavelength_mm: f32) -> SurfaceChange {
        SurfaceChange::Texture(Texture {
            pattern: Pattern::Grain,
            amplitude_mm,
            wavelength_mm,
            ..Texture::NONE
        })
    }

    const fn friction(dynamic_mu: f32, static_mu: f32) -> SurfaceChange {
        SurfaceChange::Friction {
            dynamic_mu,
            static_mu,
        }
    }

    #[test]
    fn accepted_surface_change_leaves_valid_params() {
        for change in [
            friction(0.0, 0.0),
            friction(0.3, 0.5),
            friction(10.0, 10.0),
            SurfaceChange::ViscousFriction(1.0),
            SurfaceChange::Damping(20.0),
            SurfaceChange::Shading(Shading::Smooth),
            SurfaceChange::Texture(Texture::NONE),
            texture(0.125, 1.0),
        ] {
            let params = change
                .of(&SurfaceParams::PREMIUM, false)
                .expect("can be had");
            assert!(params.is_valid(), "{change:?}");
            let SurfaceParams {
                stiffness_n_per_mm,
                max_force_n,
                ..
            } = SurfaceParams::PREMIUM;
            assert_eq!(params.stiffness_n_per_mm, stiffness_n_per_mm);
            assert_eq!(params.max_force_n, max_force_n);
        }
    }

    #[test]
    fn named_surface_keeps_limit_and_shading() {
        let sand = NamedSurface::find("sand").expect("named");
        let before = SurfaceParams {
            max_force_n: 4.0,
            shading: Shading::Smooth,
            ..SurfaceParams::PREMIUM
        };
        let params = SurfaceChange::Named(sand).of(&before, false).expect("sand");
        assert_eq!(Material::of(&params), sand.material);
        assert_eq!((params.max_force_n, params.shading), (4.0, Shading::Smooth));
    }

    #[test]
    fn refused_surface_change_states_the_accepted_range() {
        for (change, expected) in [
            (friction(0.5, 0.3), "at rest not less"),
            (friction(-0.1, 0.0), "from 0 to 10"),
            (friction(f32::NAN, 1.0), "from 0 to 10"),
            (friction(1.0, 11.0), "from 0 to 10"),
            (SurfaceChange::ViscousFriction(1.5), "from 0 to 1 s"),
            (SurfaceChange::Damping(21.0), "from 0 to 20 N·s/m"),
            (SurfaceChange::Damping(f32::INFINITY), "from 0 to 20 N·s/m"),
            (texture(0.2, 1.0), "up to an eighth"),
            (texture(0.0, 1.0), "above 0"),
            (texture(0.01, 0.1), "from 0.25 to 100 mm"),
        ] {
            let error = change
                .of(&SurfaceParams::PREMIUM, false)
                .expect_err(expected);
            assert!(error.to_string().contains(expected), "{error}");
        }
    }

    #[test]
    fn material_surfaces_only_accept_shading_changes() {
        let params = &SurfaceParams::PREMIUM;
        let damping = SurfaceChange::Damping(1.0);
        assert_eq!(damping.of(params, true), Err(SurfaceError::OfMaterials));
        assert!(
            SurfaceChange::Shading(Shading::Smooth)
                .of(params, true)
                .is_ok()
        );
    }
}
