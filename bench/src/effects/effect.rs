//! The compared effects, each as the surface parameters of a scene.

use hapterra_core::contact::Friction;
use hapterra_core::force::{Controller, Damping, Pattern, Shading, SurfaceParams, Texture};

/// Effect of a surface in addition to the spring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// A frictionless surface.
    None,
    /// Friction resists the tip, at rest more than during a slide.
    Friction,
    /// The force turns gradually from patch to patch.
    Shading,
    /// A random micro-relief.
    Grain,
    /// A micro-relief of ridges.
    Grating,
    /// Damping dissipates energy of a motion against it.
    Damping,
    /// The passivity controller dissipates the energy leak.
    Controller,
    /// All at once, with grain.
    All,
}

/// The friction that is measured.
pub(super) const FRICTION: Friction = Friction {
    static_mu: 0.5,
    dynamic_mu: 0.3,
    viscous_s: 0.0,
};
/// The damping that is measured, N·s/m.
pub(super) const DAMPING_NS_PER_M: f32 = 2.0;

/// The texture that is measured.
pub(super) const fn texture(pattern: Pattern) -> Texture {
    Texture {
        pattern,
        amplitude_mm: 0.1,
        wavelength_mm: 1.0,
        direction_deg: 30.0,
        seed: 7,
    }
}

impl Effect {
    /// All effects, in the order of the table.
    pub const ALL: [Self; 8] = [
        Self::None,
        Self::Friction,
        Self::Shading,
        Self::Grain,
        Self::Grating,
        Self::Damping,
        Self::Controller,
        Self::All,
    ];

    /// Returns its name in tables.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Friction => "friction",
            Self::Shading => "shading",
            Self::Grain => "texture, grain",
            Self::Grating => "texture, grating",
            Self::Damping => "damping",
            Self::Controller => "controller",
            Self::All => "all",
        }
    }

    /// Returns the surface parameters of a scene with only this effect. The controller is off in
    /// all others.
    pub(super) fn params(self) -> SurfaceParams {
        let of = |effect| self == effect || self == Self::All;
        let mut params = SurfaceParams::PREMIUM;
        if of(Self::Friction) {
            params.friction = FRICTION;
        }
        if of(Self::Shading) {
            params.shading = Shading::Smooth;
        }
        if of(Self::Grain) {
            params.texture = texture(Pattern::Grain);
        }
        if self == Self::Grating {
            params.texture = texture(Pattern::Grating);
        }
        let ns_per_m = if of(Self::Damping) {
            DAMPING_NS_PER_M
        } else {
            0.0
        };
        let controller = if of(Self::Controller) {
            Controller::On
        } else {
            Controller::Off
        };
        params.damping = Damping {
            ns_per_m,
            controller,
        };
        params
    }
}
