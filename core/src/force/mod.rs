//! From proxy and haptic interface point to newtons.
//!
//! - `material`, `active_material`: surface parameters, and the change from one material to
//!   another;
//! - `shading`, `slopes`: the force turned evenly from patch to patch;
//! - `texture`, `texturer`, `relief`: grain and gratings: parameters, force and heights;
//! - `damping`, `passivity`, `rate_limit_softening`, `depth`: damping along the force, the
//!   passivity observer and controller, and the softening of a fast contact;
//! - `effects`, `effect_context`: all of these for a scene.

mod active_material;
mod damping;
mod depth;
mod effect_context;
mod effects;
mod material;
mod passivity;
mod rate_limit_softening;
mod relief;
mod shading;
mod slopes;
mod texture;
mod texturer;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::contact::Friction;
pub use crate::scalar::clamp_length;
use crate::scalar::smaller;
pub(crate) use damping::Damper;
pub use damping::{Controller, Damping};
pub(crate) use effect_context::EffectContext;
pub(crate) use effects::Effects;
pub use material::{MATERIAL_CHANGE_S, Material, MaterialTable};
pub(crate) use passivity::{PassivityInputs, Shares};
pub use shading::{Shader, Shading};
pub use texture::{Pattern, Texture};
pub use texturer::Texturer;

/// The parameters of a surface: its spring, and every effect. Immutable during a tick. The tick
/// computes a force from all of them; [`Self::spring`] covers the spring alone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SurfaceParams {
    /// Newtons per millimetre between the HIP and the proxy.
    pub stiffness_n_per_mm: f32,
    /// Maximum force in newtons; the direction is kept.
    pub max_force_n: f32,
    /// Friction of the surface.
    pub friction: Friction,
    /// Damping of motion against the surface.
    pub damping: Damping,
    /// Choice of the normals that the force follows.
    pub shading: Shading,
    /// The micro-relief of the surface.
    pub texture: Texture,
}

impl SurfaceParams {
    /// 0.5 N/mm and 8.5 N on a frictionless surface: the continuous ability of a Phantom Premium
    /// 1.5.
    pub const PREMIUM: Self = Self {
        stiffness_n_per_mm: 0.5,
        max_force_n: 8.5,
        friction: Friction::NONE,
        damping: Damping::NONE,
        shading: Shading::None,
        texture: Texture::NONE,
    };

    /// Returns true if stiffness and limit are finite and not negative, and friction, damping and
    /// texture are valid.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let ok = |x: f32| x.is_finite() && x >= 0.0;
        ok(self.stiffness_n_per_mm)
            && ok(self.max_force_n)
            && self.friction.is_valid()
            && self.damping.is_valid()
            && self.texture.is_valid()
    }

    /// Returns the spring, without friction, damping, shading and texture.
    #[must_use]
    pub const fn spring(&self) -> Spring {
        Spring {
            stiffness_n_per_mm: self.stiffness_n_per_mm,
            max_force_n: self.max_force_n,
        }
    }

    /// Returns true if the passivity controller acts on an arm.
    #[must_use]
    pub const fn is_controlled(&self) -> bool {
        matches!(self.damping.controller, Controller::On)
    }
}

/// The spring between the haptic interface point (HIP) and the proxy (paper §4.3.4), and the limit
/// of its force.
///
/// ```
/// use hapterra_core::{Vec3, force::Spring};
///
/// let spring = Spring { stiffness_n_per_mm: 0.5, max_force_n: 8.5 };
/// // The proxy is 4 mm above the HIP: half a newton for each.
/// assert_eq!(spring.force_n(Vec3::Z * 4.0), Vec3::Z * 2.0);
/// // Farther away the limit is kept, and so is the direction.
/// let most = spring.force_n(Vec3::new(300.0, -400.0, 0.0));
/// assert!((most - Vec3::new(5.1, -6.8, 0.0)).length() < 1e-5);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Newtons per millimetre between the HIP and the proxy.
    pub stiffness_n_per_mm: f32,
    /// Maximum force in newtons; the direction is kept.
    pub max_force_n: f32,
}

impl Spring {
    /// Returns the force in newtons for a proxy `displacement_mm` away from the HIP.
    ///
    /// It points along `displacement_mm`, is proportional to its length, and is clamped as a
    /// vector. Always finite: a displacement that is not finite results in no force.
    #[must_use]
    pub fn force_n(&self, displacement_mm: Vec3) -> Vec3 {
        clamp_length(displacement_mm * self.stiffness_n_per_mm, self.max_force_n)
    }

    /// Returns the energy stored at a depth, mJ.
    pub(crate) fn stored_mj(&self, depth_mm: f32) -> f32 {
        let stretched_n = depth_mm * self.stiffness_n_per_mm;
        let at_limit_n = smaller(stretched_n, self.max_force_n);
        // Beyond the limit the force is constant: F (d - d_m) more than at the limit.
        at_limit_n * (stretched_n - 0.5 * at_limit_n) / self.stiffness_n_per_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_is_proportional_below_the_limit() {
        let f = SurfaceParams::PREMIUM
            .spring()
            .force_n(Vec3::new(0.0, 0.0, 4.0));
        assert_eq!(f, Vec3::new(0.0, 0.0, 2.0));
    }

    #[test]
    fn force_limit_keeps_the_direction() {
        for displacement in [
            Vec3::new(300.0, -400.0, 0.0),
            Vec3::splat(3e38),
            Vec3::new(18.0, 0.0, 0.1),
        ] {
            let f = SurfaceParams::PREMIUM.spring().force_n(displacement);
            assert!(
                f.length() <= 8.5 && f.length() > 8.499_99,
                "{displacement} -> {f}"
            );
            assert!(f.x.signum() == displacement.x.signum());
        }
        let f = SurfaceParams::PREMIUM
            .spring()
            .force_n(Vec3::new(300.0, -400.0, 0.0));
        assert!((f - Vec3::new(5.1, -6.8, 0.0)).length() < 1e-5);
    }

    #[test]
    fn non_finite_displacement_renders_no_force() {
        for bad in [f32::NAN, f32::INFINITY] {
            assert_eq!(
                SurfaceParams::PREMIUM
                    .spring()
                    .force_n(Vec3::new(0.0, bad, 1.0)),
                Vec3::ZERO
            );
        }
    }
}
