//! Friction: a rough surface holds the proxy back (Salisbury et al. 1995; the friction
//! cone: Harwin and Melder 2002).
//!
//! A proxy stays where it is while the HIP pulls it from inside the static friction cone over the
//! surface there. Outside of the cone the proxy slides: it follows the pull until dynamic and
//! viscous friction hold it (`stick_or_slide`). `cone` computes the pull and the friction limit.

mod cone;
mod cone_root;
mod stick_or_slide;

use serde::{Deserialize, Serialize};

pub(super) use cone::Cone;
pub(super) use stick_or_slide::{Walk, WalkEnd};

/// Friction of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Friction {
    /// Coulomb's coefficient at rest: the maximum ratio of tangential to normal force at which the
    /// proxy stays. Not below `dynamic_mu`.
    pub static_mu: f32,
    /// Coulomb's coefficient while the proxy slides.
    pub dynamic_mu: f32,
    /// The viscous part, as a time in seconds: its coefficient (N·s/mm) divided by the stiffness
    /// (N/mm). At a speed v the proxy trails by v times this in addition.
    pub viscous_s: f32,
}

impl Friction {
    /// Maximum coefficient: tan 84°.
    pub const MAX: f32 = 10.0;
    /// Maximum of [`Self::viscous_s`].
    pub const MAX_VISCOUS_S: f32 = 1.0;
    /// A frictionless surface: the proxy is the surface's closest point.
    pub const NONE: Self = Self {
        static_mu: 0.0,
        dynamic_mu: 0.0,
        viscous_s: 0.0,
    };

    /// Creates friction with the same coefficient at rest and during sliding.
    #[must_use]
    pub const fn coulomb(mu: f32) -> Self {
        Self {
            static_mu: mu,
            dynamic_mu: mu,
            viscous_s: 0.0,
        }
    }

    /// Returns true if the surface is frictionless.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// Returns true if every number is in its valid range.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let ordered = self.dynamic_mu <= self.static_mu;
        ordered
            && (0.0..=Self::MAX).contains(&self.dynamic_mu)
            && (0.0..=Self::MAX).contains(&self.static_mu)
            && (0.0..=Self::MAX_VISCOUS_S).contains(&self.viscous_s)
    }
}

#[cfg(test)]
mod tests;
